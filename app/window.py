"""The window: the view in the middle, and the parts around it. What it does lies in its parts, see `app.parts`."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

from pathlib import Path

# Imported before any window exists: it sets the OpenGL format of the whole process.
import pyvistaqt  # noqa: F401
from PyQt6.QtCore import QEvent, QSettings
from PyQt6.QtGui import QAction, QCloseEvent, QDragEnterEvent, QDropEvent, QUndoStack
from PyQt6.QtWidgets import QDockWidget, QMainWindow, QVBoxLayout, QWidget

from app import dialogs
from app.action_registry import ActionRegistry
from app.banner import Banner
from app.cache_folder import cache_folder
from app.controller import Controller
from app.defects import reported_defects
from app.docks import build_docks, panel_action
from app.document import Document
from app.engine import Engine
from app.engine_worker import Bake, bake_job
from app.garbage import SettingAside
from app.jobs import Jobs, favour_window
from app.lazy_picker import LazyPicker
from app.panels import build_panels
from app.parts import PARTS
from app.parts.baking import BakingPart
from app.parts.session import SessionPart
from app.parts.views import ViewsPart
from app.preferences import Preferences
from app.probe_strip import ProbeStrip
from app.progress_panel import ProgressPanel
from app.readouts import Readouts
from app.style import application, apply_scheme, style_sheet
from app.user_commands import UserCommands
from app.view_area import ViewArea
from app.view_presenter import ViewPresenter
from app.window_parts import AnyPart, Workbench

LONG_BAKE_SECONDS = 30.0
"""A bake that has run longer is not thrown away without asking."""


def open_window(path: Path | None) -> int:
    """Opens the window and returns the exit code when it is closed.

    Args:
        path: A scene file or a result folder; None for the sample level.
    """
    app = application()
    window = Window(cache_folder())
    window.show()
    with reported_defects(window.banner):
        begin = lambda: window.controller.open(path)  # noqa: E731
        if path is not None or not window.part(SessionPart).offer(begin):
            begin()
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
        favour_window()
        self.store = store if store is not None else QSettings("obscura", "obscura")
        apply_scheme(Preferences.read(self.store).scheme)
        self.document = Document()
        self.engine = Engine(bake, self)
        self.controller = Controller(self.document, self.engine, cache, self)
        self.picker = LazyPicker(self)
        self._styled_for = ""
        self.setWindowTitle("Obscura")
        self.setAcceptDrops(True)
        self._build_centre()
        self.panels = build_panels(self.document)
        self.bench = Workbench(
            window=self,
            store=self.store,
            document=self.document,
            engine=self.engine,
            controller=self.controller,
            jobs=Jobs(self),
            picker=self.picker,
            area=self.area,
            presenter=self.presenter,
            readouts=self.readouts,
            panels=self.panels,
            banner=self.banner,
            progress=self.progress,
            registry=ActionRegistry(self, self.store),
            undo=QUndoStack(self),
            docks={},
            menus={},
            cache=cache,
            parts=[],
        )
        for make in PARTS:  # one by one: a part may use those before it
            self.bench.parts.append(make(self.bench))
        self.bench.docks.update(build_docks(self, [spec for part in self.bench.parts for spec in part.docks()]))
        for part in self.bench.parts:
            for spec, slot in part.actions():
                self.bench.registry.add(spec, slot)
        for title, dock in self.bench.docks.items():
            self.bench.registry.adopt(panel_action(title), dock.toggleViewAction() or QAction(self))
        self.bench.menus.update(self.bench.registry.fill_menus())
        self.document.opened.connect(self._on_opened)
        self.resize(1280, 800)
        for part in self.bench.parts:
            part.connect()
        self._restyle()
        self._aside = SettingAside(self.document, lambda: self.bench.jobs.is_busy or not self.controller.is_idle, self)
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

    def part(self, kind: type[AnyPart]) -> AnyPart:
        """The window's part of a kind."""
        return self.bench.part(kind)

    @property
    def docks(self) -> dict[str, QDockWidget]:
        """Docks by title."""
        return dict(self.bench.docks)

    @property
    def actions_by_id(self) -> dict[str, QAction]:
        """All actions."""
        return self.bench.registry.actions

    @property
    def commands(self) -> UserCommands:
        """What menus and keys do with view and selection."""
        return self.part(ViewsPart).commands

    def _on_opened(self) -> None:
        self.setWindowTitle(f"{self.document.scene_name} — Obscura")
        self.setWindowFilePath(str(self.document.scene_path or ""))

    def _restyle(self) -> None:
        sheet = style_sheet(self.palette())
        if sheet != self._styled_for:  # a new sheet changes the palette event again
            self._styled_for = sheet
            self.setStyleSheet(sheet)

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
        """Lets every part end, then everything that runs."""
        running = self.part(BakingPart).seconds
        if event is not None and running > LONG_BAKE_SECONDS and not dialogs.may_drop_bake(self, running / 60.0):
            event.ignore()
            return
        for part in reversed(self.bench.parts):
            part.close()
        self.bench.jobs.close()
        self.picker.stop()
        self.controller.close()
        self.presenter.close()
        self.area.close_views()
        for document_event in self.document.events():
            document_event.clear()
        super().closeEvent(event)
