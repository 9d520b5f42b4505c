"""Rebaking what changed: on request or at once, all of it or what is chosen."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence

import numpy as np
from PyQt6.QtCore import QTimer

from app.actions import Action, ActionSpec
from app.controller import ALPHA
from app.engine_protocol import RebakeDone, RebakeValues
from app.parts.results_history import ResultsHistoryPart
from app.parts.scene_watch import SceneWatchPart
from app.rebake_layers import LayerInfo, names_of
from app.rebake_panel import RebakePanel
from app.rebaker import Rebaker
from app.region_part import RegionsPart
from app.stale_marks import StaleMarks
from app.window_parts import DockSpec, Part, Side, Workbench
from bake.settings import BakeSettings
from bake.types import BakeResult, Int32Array, Progress
from viewer.boxes import object_boxes
from viewer.picture import boxes_in_picture, picture_matrix

PANEL = "Rebake"
_SLOW_MS = 4000
"""After this time a rebake is shown where a bake is."""
_AT_ONCE = "rebake-at-once"

Faces = Mapping[str, Int32Array]

logger = logging.getLogger(__name__)


class RebakePart(Part):
    """The Rebake panel, its actions, and the automatic rebake."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.panel = RebakePanel()
        self.rebaker = Rebaker(bench.document, bench.engine, bench.window)
        self.marks = StaleMarks(bench.document, lambda: bench.area.viewports)
        self._objects: tuple[str, ...] | None = None
        self._faces: Faces | None = None
        self._settings: BakeSettings | None = None
        self._seen: dict[str, str] = {}
        self._auto = self._own_bake = self._replaced = self._look_again = False
        self._slow = QTimer(bench.window)
        self._slow.setSingleShot(True)
        self._slow.setInterval(_SLOW_MS)
        self._slow.timeout.connect(lambda: bench.controller.busy.emit("Rebaking"))

    def docks(self) -> Sequence[DockSpec]:
        """The panel."""
        return [DockSpec(PANEL, self.panel, Side.RIGHT, scrolled=True)]

    def actions(self) -> list[Action]:
        """What to rebake."""
        menu = "Bake"
        needs = ("result", "scene-file")
        chosen = (*needs, "selection")
        return [
            (
                ActionSpec(
                    "rebake", menu, "&Rebake", "Bake anew what the changes since the bake can reach, and nothing else",
                    ("F6",), group=1, needs=needs,
                ),
                self.rebake,
            ),
            (
                ActionSpec(
                    "rebake-selection", menu, "Rebake &selection", "Only values of the selected objects may change",
                    ("Shift+F6",), group=1, context=("object",), needs=chosen,
                ),
                lambda: self.rebake(self.selected()),
            ),
            (
                ActionSpec(
                    "rebake-view", menu, "Rebake what is in &view", "Only values of objects in the picture may change",
                    group=1, needs=needs,
                ),
                lambda: self.rebake(self._in_view()),
            ),
            (
                ActionSpec(
                    "rebake-region", menu, "Rebake the selected re&gion", "Only of objects that reach into it", group=1,
                    needs=(*needs, "region"),
                ),
                lambda: self.rebake(self._in_region()),
            ),
            (
                ActionSpec(
                    _AT_ONCE, menu, "Rebake at &once", "Rebake after every change, in place of the rebake under way",
                    ("Ctrl+F6",), True, 1, needs=needs,
                ),
                self.set_auto,
            ),
            (
                ActionSpec(
                    "stale-marks", "View", "Mark what is &stale", "Boxes around what has changed since the bake",
                    checkable=True, group=5,
                ),
                self.marks.set_shown,
            ),
            (
                ActionSpec(
                    "select-region", "Regions", "Select its &objects", "Select what reaches into the selected region",
                    group=1, needs=("region",),
                ),
                lambda: self._select(self._in_region()),
            ),
        ]  # fmt: skip

    def connect(self) -> None:
        """Joins panel, engine, document and undo stack."""
        bench, document, registry = self.bench, self.bench.document, self.bench.registry
        self.panel.add_buttons(
            [registry[name] for name in ("rebake", "rebake-selection", "rebake-view", "rebake-region")],
            ("Rebake", "Selection", "In view", "Region"),
        )
        self.panel.auto_toggled.connect(self.set_auto)
        self.rebaker.told.connect(self._on_told)
        self.rebaker.shown.connect(self._on_shown)
        self.rebaker.done.connect(self._on_done)
        self.rebaker.ended.connect(lambda _replaced: self._on_stopped())
        self.rebaker.overtaken.connect(lambda: bench.controller.reload_result(lambda _well: None))
        bench.progress.cancel_requested.connect(self.rebaker.cancel)
        bench.controller.about_to_bake.connect(lambda _path: self._on_bake())
        bench.engine.bake_finished.connect(self._on_baked)
        bench.part(ResultsHistoryPart).about_to_put.connect(self.rebaker.cancel)
        document.current_changed.connect(self._on_current)
        bench.part(SceneWatchPart).edited.connect(self._on_edited)
        document.result_changed.connect(self.refresh)
        document.opened.connect(self._on_opened)
        document.result_changed.connect(self._on_result)
        self.panel.alpha.moved.connect(bench.controller.solve_alpha)
        self.panel.alpha.dropped.connect(lambda: bench.controller.solve_alpha(None))
        self.panel.alpha.kept.connect(self._keep_alpha)
        bench.controller.solving.connect(self._on_solving)
        bench.docks[PANEL].visibilityChanged.connect(lambda shown: self._prepare() if shown else None)
        bench.panels.bake.form.changed.connect(self._on_form)
        registry["stale-marks"].setChecked(True)
        self.refresh()

    def escape(self) -> bool:
        """Stops the rebake under way."""
        was_busy = self.rebaker.is_busy
        self.rebaker.cancel()
        return was_busy

    def close(self) -> None:
        """Stops what runs."""
        self._slow.stop()
        self.rebaker.cancel()

    # What the user asks for

    def rebake(self, objects: tuple[str, ...] | None = None, *, faces: Faces | None = None) -> None:
        """Rebakes what the changes can reach.

        Args:
            objects: Paths of the only objects whose values may change; None for all.
            faces: The same by triangles, numbered within their objects, by path.
        """
        settings = self.bench.panels.bake.settings()
        if settings is None or (objects is not None and not objects):
            self.bench.banner.show_message(logging.INFO, "There is nothing to rebake there.")
            return
        result, current = self.bench.document.result, self.bench.document.current
        if current is not None and current.is_fresh and result is not None and result.settings == settings:
            self.bench.banner.show_message(logging.INFO, "The result is up to date.")
            return
        self._start(settings, objects, faces)

    def set_auto(self, on: bool) -> None:
        """Whether every change is followed at once."""
        self._auto = on
        self.panel.auto.setChecked(on)
        self.bench.part(SceneWatchPart).waits = on  # the engine gets the processor first
        self.bench.registry[_AT_ONCE].setChecked(on)
        if on:
            self.bench.part(SceneWatchPart).want_scene()
            self._follow()

    def refresh(self) -> None:
        """Shows what is stale."""
        document = self.bench.document
        if document.result is None:
            self.panel.show_stale(None)
        else:
            self.panel.show_stale("" if document.current is None else document.current.summary())

    # What happens

    def _start(self, settings: BakeSettings, objects: tuple[str, ...] | None, faces: Faces | None = None) -> None:
        document = self.bench.document
        if document.result is None or document.result_path is None or self.bench.engine.is_baking:
            return
        self._settings, self._objects, self._faces = settings, objects, faces
        was_busy, viewport = self.rebaker.is_busy, self.bench.area.main
        camera = picture_matrix(viewport.camera, viewport.view.aspect)
        self.rebaker.request(settings, objects=objects, faces=faces, camera=camera)
        if not was_busy:  # what is stored is kept while the engine is at work already
            self._own_bake = True
            self.bench.controller.about_to_bake.emit(document.result_path)
            self._own_bake = False
        self._slow.start()
        self.panel.show_state("Starting …")

    def _on_bake(self) -> None:
        """A whole bake takes the place of a rebake."""
        if not self._own_bake:
            self._replaced = True
            self.rebaker.cancel()
            self._replaced = False

    def _on_baked(self, _done: object) -> None:
        """What was changed while the bake ran is followed when its state is known."""
        self._look_again = self._auto

    def _on_edited(self, name: str, digest: str) -> None:
        """Starts before the window itself has read the change."""
        if self._auto or self.rebaker.is_busy:
            self._seen = {**self._seen, name: digest}
            self._restart()

    def _on_current(self) -> None:
        self.refresh()
        current = self.bench.document.current
        if current is None or current.complaint or current.scene is None:
            return
        self._prepare()
        changed = dict(current.files) != self._seen
        first, self._seen = not self._seen, dict(current.files)
        if (changed and not first) or self._look_again:
            self._look_again = False
            self._follow()

    def _follow(self) -> None:
        """Rebakes after a change, if it is to be at once, or if it concerns a rebake under way."""
        document = self.bench.document
        result, current = document.result, document.current
        if result is None or current is None or current.scene is None:
            return
        if self.rebaker.is_busy or (self._auto and not current.is_fresh):
            self._restart()

    def _restart(self) -> None:
        """Rebakes as the rebake under way does, or everything."""
        result = self.bench.document.result
        if self.rebaker.is_busy and self._settings is not None:
            self._start(self._settings, self._objects, self._faces)
        elif result is not None:
            self._start(self._followed_settings(result), None)

    def _prepare(self) -> None:
        """Somebody looks at objects' places, or at the slider of smoothing, so a change is likely."""
        result, current = self.bench.document.result, self.bench.document.current
        if result is not None and current is not None and current.is_fresh:
            self.rebaker.prepare(result.settings)

    def _followed_settings(self, result: BakeResult) -> BakeSettings:
        """Those of the result: what else the form says is not followed before it is asked for."""
        form = self.bench.panels.bake.settings()
        own = result.settings
        if form is None:
            return own
        return own.replaced(alpha=form.alpha, back_face_threshold=form.back_face_threshold)

    def _on_form(self) -> None:
        """A change of smoothing or threshold alone needs no ray, so it is followed at once as well."""
        result = self.bench.document.result
        if self._auto and result is not None and self._followed_settings(result) != result.settings:
            self._start(self._followed_settings(result), None)

    def _on_result(self) -> None:
        result = self.bench.document.result
        self.panel.alpha.set_stored(None if result is None else result.settings.alpha)

    def _on_solving(self, purpose: str, on: bool) -> None:
        if purpose == ALPHA and not on:
            self.panel.alpha.set_state(
                "Preview: the stored result still has its own." if self.bench.document.is_preview else ""
            )

    def _keep_alpha(self, alpha: float) -> None:
        panel = self.bench.panels.bake
        panel.form.editor("alpha").set_value(alpha)
        panel.refresh()
        self.rebake()

    def _on_told(self, progress: Progress) -> None:
        share = f" {progress.done / progress.total:.0%}" if progress.total else ""
        self.panel.show_state(f"{progress.stage.capitalize()}{share} …")
        if not self._slow.isActive():
            self.bench.progress.set_progress(progress, 0.0)

    def _on_shown(self, values: RebakeValues) -> None:
        self._show_timing()
        if values.rays_total or values.final:
            self.bench.part(SceneWatchPart).catch_up()

    def _show_timing(self) -> None:
        timing = self.rebaker.timing
        if timing.final >= 0.0:
            self.panel.show_state(f"Final after {timing.final:.2f} s, being stored …")
        elif timing.first >= 0.0:
            self.panel.show_state(f"First picture after {timing.first:.2f} s, being refined …")

    def _on_done(self, done: RebakeDone) -> None:
        report = done.report
        if report is None:
            return
        self.bench.part(ResultsHistoryPart).next_step = (
            names_of(report.changed),
            LayerInfo(report.vertices_changed, report),
        )
        self.panel.show_report(report, self.rebaker.timing)
        timing = self.rebaker.timing
        stages = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in report.stages.items() if seconds >= 0.05)
        times = (timing.first, timing.final, timing.stored)
        logger.info("rebaked: first %.2f s, final %.2f s, stored %.2f s (%s)", *times, stages)
        self.bench.controller.reload_result(self._on_reloaded)

    def _on_reloaded(self, well: bool) -> None:
        self._end()
        self.bench.controller.bake_ended.emit(well)

    def _on_stopped(self) -> None:
        self._end()
        if not self._replaced:
            self.bench.controller.bake_ended.emit(False)

    def _end(self) -> None:
        self._slow.stop()
        self.panel.show_state("")
        if not self.bench.engine.is_baking:
            self.bench.controller.busy.emit("")

    def _on_opened(self) -> None:
        self._seen = {}
        self.rebaker.cancel()
        self.refresh()

    # Which objects

    def selected(self) -> tuple[str, ...]:
        """Paths of the selected objects."""
        document = self.bench.document
        return () if document.world is None else tuple(document.world.object_paths[i] for i in document.selection)

    def _in_view(self) -> tuple[str, ...]:
        document, viewport = self.bench.document, self.bench.area.main
        if document.world is None:
            return ()
        boxes = object_boxes(document.world)
        drawn = document.visible & np.isfinite(boxes[:, 0, 0])
        boxes[~drawn] = 0.0
        matrix = np.array(picture_matrix(viewport.camera, viewport.view.aspect)).reshape(4, 4)
        seen = boxes_in_picture(boxes, matrix) & drawn
        return tuple(path for path, inside in zip(document.world.object_paths, seen, strict=True) if inside)

    def _in_region(self) -> tuple[str, ...]:
        """Paths of what reaches into the selected region."""
        document, state = self.bench.document, self.bench.part(RegionsPart).state
        if document.world is None or state.regions is None:
            return ()
        region = state.view.region
        if not 0 <= region < len(state.regions.graph):
            return ()
        low, high = state.regions.graph.minimum[region], state.regions.graph.maximum[region]
        boxes = object_boxes(document.world)
        inside = (boxes[:, 0] <= high).all(axis=1) & (boxes[:, 1] >= low).all(axis=1)
        return tuple(path for path, own in zip(document.world.object_paths, inside, strict=True) if own)

    def _select(self, paths: tuple[str, ...]) -> None:
        world, wanted = self.bench.document.world, set(paths)
        if world is not None:
            self.bench.document.select_all(i for i, path in enumerate(world.object_paths) if path in wanted)
