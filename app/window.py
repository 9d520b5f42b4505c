"""The window: panels around the view, and who listens to whom."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from pathlib import Path

# Imported before any window exists: it sets the OpenGL format of the whole process.
import pyvistaqt  # noqa: F401
from PyQt6.QtCore import QByteArray, QEvent, QSettings
from PyQt6.QtGui import QCloseEvent, QDragEnterEvent, QDropEvent
from PyQt6.QtWidgets import QMainWindow, QMenu, QVBoxLayout, QWidget

from app import dialogs
from app.actions import build_actions
from app.banner import Banner
from app.cache_folder import cache_folder
from app.controller import OTHER_MAPPING, THRESHOLD, Controller
from app.docks import build_docks, build_panels
from app.document import Document
from app.engine import Engine
from app.engine_worker import Bake, bake_job
from app.lazy_picker import LazyPicker
from app.log_panel import LogBridge
from app.probe_strip import ProbeStrip
from app.progress_panel import ProgressPanel
from app.readouts import Readouts
from app.recent_files import add_recent_file, clear_recent_files, recent_files
from app.style import application, apply_scheme, style_sheet
from app.user_commands import UserCommands
from app.view_area import ViewArea
from app.view_presenter import Overlays, ViewPresenter
from viewer.camera import Camera, robust_bounds

LAYOUT_VERSION = 2
LONG_BAKE_SECONDS = 30.0
"""A bake that has run longer is not thrown away without asking."""

logger = logging.getLogger(__name__)


def open_window(path: Path | None) -> int:
    """Opens the window and returns the exit code when it is closed.

    Args:
        path: A scene file or a result folder; None for the sample level.
    """
    app = application()
    window = Window(cache_folder())
    window.show()
    window.controller.open(path)
    return app.exec()


class Window(QMainWindow):
    """The main window.

    Args:
        cache: Folder for the window's own results.
        store: Layout, recent files and other habits; the user's own by default.
        bake: Runs a bake inside the engine process.
    """

    def __init__(self, cache: Path, store: QSettings | None = None, bake: Bake = bake_job) -> None:
        super().__init__()
        self.store = store if store is not None else QSettings("obscura", "obscura")
        apply_scheme(str(self.store.value("window/scheme", "")))
        self.document = Document()
        self.engine = Engine(bake, self)
        self.controller = Controller(self.document, self.engine, cache, self)
        self.picker = LazyPicker(self)
        self._bake_began: float | None = None
        self._styled_for = ""
        self.setWindowTitle("Obscura")
        self.setAcceptDrops(True)
        self._build_centre()
        self.panels = build_panels(self.document)
        self.docks = build_docks(self, self.panels)
        self.commands = UserCommands(self, self.document, self.controller, self.area, self.panels)
        self.actions_by_id = build_actions(self, {**self.commands.slots(), **self._slots()})
        self._build_menus()
        self.log_bridge = LogBridge(self)
        self.log_bridge.attach()
        self._connect_controller()
        self._connect_panels()
        self._follow_document()
        self.resize(1280, 800)
        self._default_state = self.saveState(LAYOUT_VERSION)
        self._restore_layout()
        self._restyle()
        self.engine.start()

    def _build_centre(self) -> None:
        self.banner = Banner()
        self.area = ViewArea(self.picker)
        self.progress = ProgressPanel()
        self.strip = ProbeStrip()
        centre = QWidget()
        layout = QVBoxLayout(centre)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        for widget, stretch in ((self.banner, 0), (self.area, 1), (self.progress, 0), (self.strip, 0)):
            layout.addWidget(widget, stretch)
        self.setCentralWidget(centre)
        self.presenter = ViewPresenter(self.document, [self.area.main])
        self.readouts = Readouts(self.document, self.strip)
        self.readouts.follow(self.area.main)

    def _build_menus(self) -> None:
        self._recent = QMenu("Open &recent", self)
        self._recent.aboutToShow.connect(self._fill_recent)
        bar = self.menuBar()
        assert bar is not None
        menus = {menu.title().replace("&", ""): menu for menu in bar.findChildren(QMenu)}
        menus["File"].insertMenu(self.actions_by_id["open-sample"], self._recent)
        panels = QMenu("&Panels", self)
        for dock in self.docks.values():
            panels.addAction(dock.toggleViewAction())
        menus["View"].insertMenu(self.actions_by_id["reset-layout"], panels)
        self._show_scheme()

    def _slots(self) -> dict[str, Callable[..., object]]:
        return {
            "save-picture": self._ask_for_picture,
            "open-scene": lambda: self._open_if_given(dialogs.ask_for_scene(self, self._last_folder())),
            "open-result": lambda: self._open_if_given(dialogs.ask_for_result(self, self._last_folder())),
            "save-result": self._ask_where_to_save,
            "quit": self.close,
            "cancel": self._escape,
            "compare": self.compare,
            "tree-models": self.compare_tree_models,
            "up-y": lambda _on: self._set_up_axis(1),
            "up-z": lambda _on: self._set_up_axis(2),
            "light-palette": lambda on: self._set_scheme("light" if on else ""),
            "dark-palette": lambda on: self._set_scheme("dark" if on else ""),
            "reset-layout": lambda: self.restoreState(self._default_state, LAYOUT_VERSION),
        }

    def _connect_controller(self) -> None:
        controller, banner = self.controller, self.banner
        controller.message.connect(banner.show_message)
        controller.busy.connect(self._on_busy)
        controller.baking.connect(self._on_baking)
        controller.progressed.connect(self.progress.set_progress)
        controller.cancelling.connect(self.progress.set_cancelling)
        controller.solving.connect(self._on_solving)
        controller.scene_opened.connect(lambda path: add_recent_file(self.store, path))
        controller.result_saved.connect(lambda path: banner.show_message(logging.INFO, f"Result saved to {path}"))
        self.engine.logged.connect(lambda level, name, text: self.panels.log.add(level, f"engine: {name}", text))
        self.log_bridge.line.connect(self.panels.log.add)

    def _connect_panels(self) -> None:
        panels, controller, banner = self.panels, self.controller, self.banner
        self.progress.cancel_requested.connect(controller.cancel)
        panels.bake.cancel_requested.connect(controller.cancel)
        panels.bake.bake_requested.connect(controller.bake)
        panels.bake.command_copied.connect(lambda text: banner.show_message(logging.INFO, f"Copied: {text}"))
        panels.overlays.overlays_changed.connect(self._on_overlays)
        panels.overlays.threshold_settled.connect(controller.solve_threshold)
        panels.overlays.threshold_kept.connect(self._keep_threshold)
        panels.outliner.object_activated.connect(lambda _index: self.commands.frame())
        panels.findings.object_chosen.connect(self.commands.select_path)
        panels.findings.object_activated.connect(lambda _path: self.commands.frame())
        panels.instances.object_chosen.connect(self.document.select)
        panels.instances.object_activated.connect(lambda _index: self.commands.frame())
        panels.decorators.models_requested.connect(lambda: self.compare_tree_models(True))
        panels.decorators.table_requested.connect(self._show_instances)
        panels.probe.fly_requested.connect(lambda: self.commands.fly_to(self.readouts.pinned))
        panels.probe.cleared.connect(lambda: self.readouts.click(None))
        banner.log_requested.connect(lambda: self.show_panel("Log"))

    def _follow_document(self) -> None:
        document = self.document
        document.opened.connect(self._on_opened)
        document.world_changed.connect(self._on_world)
        document.visibility_changed.connect(lambda: self.picker.set_world(document.world, document.face_visible()))
        document.result_changed.connect(self._on_result)
        document.display_changed.connect(self._on_display)
        document.threshold_changed.connect(self._show_drawn)
        document.pinned_changed.connect(lambda: self.panels.probe.set_readout(document.pinned))
        self._on_display()

    def compare(self, on: bool) -> None:
        """Shows the other mapping beside the result's own, on one camera."""
        self.actions_by_id["compare"].setChecked(on)
        if on and self.area.other is None:
            viewport = self.area.split()
            self.readouts.follow(viewport)
            self.presenter.add_viewport(viewport)
        elif not on and self.area.other is not None:
            self.presenter.remove_viewport(self.area.other)
            self.area.unsplit()
        self.controller.compare(on)

    def compare_tree_models(self, on: bool) -> None:
        """Shows the three models of the selected tree side by side, on a camera of their own."""
        self.actions_by_id["tree-models"].setChecked(on)
        if on and self.area.trees is None:
            self.area.compare_trees(self.document).close_requested.connect(lambda: self.compare_tree_models(False))
        elif not on:
            self.area.end_tree_comparison()

    def _show_instances(self, kind: str) -> None:
        self.panels.instances.set_kind(kind)
        self.show_panel("Instances")

    def show_panel(self, title: str) -> None:
        """Brings a panel to the front."""
        self.docks[title].show()
        self.docks[title].raise_()

    def _escape(self) -> None:
        if self.engine.is_baking:
            self.controller.cancel()
        else:
            self.readouts.click(None)

    def _set_up_axis(self, axis: int) -> None:
        self.document.set_up_axis(axis)
        self._reset_camera()

    def _keep_threshold(self, threshold: float) -> None:
        self.panels.bake.set_threshold(threshold)
        self.show_panel("Bake")

    def _open_if_given(self, path: Path | None) -> None:
        if path is not None:
            self.controller.open(path)

    def _ask_where_to_save(self) -> None:
        if self.document.result is None:
            self.banner.show_message(logging.WARNING, "There is no result to save yet; bake first.")
            return
        name = f"{self.document.result.scene_path.stem}-result"
        target = dialogs.ask_where_to_save(self, self._last_folder() / name)
        if target is not None:
            self.controller.save_result_as(target)

    def _ask_for_picture(self) -> None:
        stem = Path(self.document.scene_name or "view").stem
        target = dialogs.ask_for_picture(self, self._last_folder() / f"{stem}.png")
        if target is not None:
            self.save_picture(target)

    def save_picture(self, target: Path) -> None:
        """Saves the view, with its legend, as a picture file."""
        if self.area.picture().save(str(target)):
            self.banner.show_message(logging.INFO, f"Picture saved to {target}")
        else:
            self.banner.show_message(logging.ERROR, f"{target}: could not be written; choose another folder")

    def _last_folder(self) -> Path:
        recent = recent_files(self.store)
        return recent[0].parent if recent else Path.home()

    # What follows from what happened

    def _on_busy(self, what: str) -> None:
        if what:
            self.progress.begin(what)
        elif self._bake_began is None:
            self.progress.end()

    def _on_baking(self, on: bool) -> None:
        self._bake_began = time.monotonic() if on else None
        self.panels.bake.set_baking(on)
        if not on:
            self.progress.end()

    def _on_solving(self, purpose: str, on: bool) -> None:
        if purpose == THRESHOLD:
            self.panels.overlays.set_solving(on)
        elif purpose == OTHER_MAPPING and not on:
            self.panels.display.refresh()

    def _on_overlays(self, overlays: Overlays) -> None:
        self.presenter.set_overlays(overlays)
        self.actions_by_id["invalid"].setChecked(overlays.invalid)
        self._show_drawn()

    def _show_drawn(self) -> None:
        self.panels.overlays.set_drawn(self.presenter.drawn_note)

    def _on_opened(self) -> None:
        self.banner.hide()
        self.setWindowTitle(f"{self.document.scene_name} — Obscura")
        self.setWindowFilePath(str(self.document.scene_path or ""))
        self.panels.findings.set_findings(self.document.findings)

    def _on_world(self) -> None:
        self.picker.set_world(self.document.world, self.document.face_visible())
        self._reset_camera()

    def _on_result(self) -> None:
        self.panels.stages.set_result(self.document.result)
        self.panels.findings.set_findings(self.document.findings)

    def _on_display(self) -> None:
        display = self.document.display
        states = {
            "edges": display.edges,
            "shading": display.shading,
            "back-faces": not display.back_faces,
            "game": display.game,
            "up-y": self.document.up_axis == 1,
            "up-z": self.document.up_axis == 2,
        }
        for name, on in states.items():
            self.actions_by_id[name].setChecked(on)

    def _reset_camera(self) -> None:
        world, viewport = self.document.world, self.area.main
        if world is not None and world.vertex_count:
            viewport.set_camera(Camera(up_axis=self.document.up_axis))
            viewport.frame(*robust_bounds(world.positions), fly=False)

    # Habits

    def _fill_recent(self) -> None:
        self._recent.clear()
        for path in recent_files(self.store):
            action = self._recent.addAction(str(path))
            assert action is not None
            action.triggered.connect(lambda _checked=False, path=path: self.controller.open(path))
        self._recent.addSeparator()
        clear = self._recent.addAction("Clear the list")
        assert clear is not None
        clear.triggered.connect(lambda: clear_recent_files(self.store))

    def _set_scheme(self, name: str) -> None:
        self.store.setValue("window/scheme", name)
        apply_scheme(name)
        self._show_scheme()

    def _show_scheme(self) -> None:
        name = str(self.store.value("window/scheme", ""))
        self.actions_by_id["light-palette"].setChecked(name == "light")
        self.actions_by_id["dark-palette"].setChecked(name == "dark")

    def _restyle(self) -> None:
        sheet = style_sheet(self.palette())
        if sheet != self._styled_for:  # a new sheet changes the palette event again
            self._styled_for = sheet
            self.setStyleSheet(sheet)

    def _restore_layout(self) -> None:
        geometry, state = self.store.value("window/geometry"), self.store.value("window/state")
        if isinstance(geometry, QByteArray):
            self.restoreGeometry(geometry)
        if isinstance(state, QByteArray):
            self.restoreState(state, LAYOUT_VERSION)

    # Qt events

    def changeEvent(self, event: QEvent | None) -> None:
        """Follows a change between bright and dark."""
        super().changeEvent(event)
        if event is not None and event.type() is QEvent.Type.PaletteChange and self._styled_for:
            self._restyle()

    def dragEnterEvent(self, event: QDragEnterEvent | None) -> None:
        """Takes one local file or folder."""
        data = event.mimeData() if event is not None else None
        if event is not None and data is not None and any(url.isLocalFile() for url in data.urls()):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent | None) -> None:
        """Opens what was dropped: a scene or a result folder."""
        data = event.mimeData() if event is not None else None
        paths = [Path(url.toLocalFile()) for url in data.urls() if url.isLocalFile()] if data is not None else []
        if event is not None and paths:
            event.acceptProposedAction()
            self.controller.open(paths[0])

    def closeEvent(self, event: QCloseEvent | None) -> None:
        """Saves the layout and ends everything that runs."""
        running = time.monotonic() - self._bake_began if self._bake_began is not None else 0.0
        if event is not None and running > LONG_BAKE_SECONDS and not dialogs.may_drop_bake(self, running / 60.0):
            event.ignore()
            return
        self.store.setValue("window/geometry", self.saveGeometry())
        self.store.setValue("window/state", self.saveState(LAYOUT_VERSION))
        self.log_bridge.detach()
        self.picker.stop()
        self.controller.close()
        self.presenter.close()
        self.area.close_views()
        for document_event in self.document.events():
            document_event.clear()
        super().closeEvent(event)
