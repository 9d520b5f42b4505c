"""Explaining a clicked point: who takes its light, what if one did not, what is wrong, and what would mend it."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import TYPE_CHECKING

from app.actions import Action, ActionSpec
from app.explain_live import PREVIEW, SURFACE, WITHOUT, ExplainLive
from app.explain_panel import ExplainPanel
from app.explain_task import ExplainedSpot
from app.parts.scene_edits import SceneEditsPart
from app.window_parts import DockSpec, Part, Side, Workbench
from bake.errors import ObscuraError
from bake.explain.cause_types import Remedy
from bake.explain.types import SpotWithout, SurfaceWithout
from bake.types import VertexField
from viewer.explain_view import ray_lines, sample_marks
from viewer.fields import distance_label
from viewer.picking import Pick

if TYPE_CHECKING:
    from bake.explain.preview import Preview
    from bake.scene.side_file_writer import SideFileEdit

PANEL = "Explain"
_RAYS, _SAMPLES = "explained rays", "explained samples"
_SAMPLE_PIXELS = 7.0


class ExplainPart(Part):
    """The panel, its marks in the view, and what it asks of the engine.

    Attributes:
        explained: What is shown; None while nothing is.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.panel = ExplainPanel()
        self.live = ExplainLive(bench.document, bench.engine, bench.window)
        self.explained: ExplainedSpot | None = None
        self._asked_for: Pick | None = None
        self._surface_of = -1  # the object without which the surface is shown

    def docks(self) -> Sequence[DockSpec]:
        """To the right."""
        return [DockSpec(PANEL, self.panel, Side.RIGHT, scrolled=True)]

    def actions(self) -> Sequence[Action]:
        """Explaining the clicked point."""
        spec = ActionSpec(
            "explain", "View", "E&xplain point", "Say why the clicked point is as dark as it is", ("X",),
            group=3, context=("view",), needs=("result",),
        )  # fmt: skip
        return [(spec, self.explain)]

    def connect(self) -> None:
        """Joins panel, document and engine."""
        bench, panel, live = self.bench, self.panel, self.live
        bench.document.result_changed.connect(self._on_result)
        bench.document.field_changed.connect(self._on_field)
        bench.document.pinned_changed.connect(self._on_pinned)
        bench.docks[PANEL].visibilityChanged.connect(lambda _seen: self._follow())
        panel.explain_asked.connect(self.explain)
        panel.column_chosen.connect(lambda _column: self._draw())
        panel.drawing_changed.connect(self._draw)
        panel.occluder_chosen.connect(lambda _owner: self._draw())
        panel.without_wanted.connect(self._on_without_wanted)
        panel.surface_asked.connect(self._on_surface_asked)
        panel.causes.preview_asked.connect(self._on_preview_asked)
        panel.causes.apply_asked.connect(self.apply)
        live.explained.connect(self._on_explained)
        live.spot_without.connect(self._on_spot_without)
        live.surface_without.connect(self._on_surface_without)
        live.previewed.connect(self._on_previewed)
        live.failed.connect(self._on_failed)
        live.ended.connect(self._on_ended)
        bench.area.main.camera_changed.connect(lambda camera: panel.dome.set_up(camera.up))
        self._on_result()

    def close(self) -> None:
        """Wants nothing more of the engine."""
        self.live.forget()

    def explain(self) -> None:
        """Explains the clicked point and brings the panel to the front."""
        self.bench.show_panel(PANEL)
        if self.bench.readouts.pinned is None:
            self.panel.set_message()
        self._follow(anew=True)

    def apply(self, remedy: Remedy) -> None:
        """Writes a remedy into the side file, as a step that can be undone."""
        scene = self.bench.document.scene_path

        def plan() -> SideFileEdit:
            from bake.explain.remedies import plan_remedy

            assert scene is not None
            return plan_remedy(scene, remedy)

        if scene is not None:
            self.bench.jobs.run(
                "remedy",
                plan,
                lambda edit: self.bench.part(SceneEditsPart).push(edit, remedy.text.rstrip(".").lower()),
                self._on_error,
            )

    def _follow(self, *, anew: bool = False) -> None:
        """Explains the clicked point, unless that is shown already or the panel is out of sight."""
        pick, result = self.bench.readouts.pinned, self.bench.document.result
        if pick is None or result is None or not self.panel.isVisible() or (pick is self._asked_for and not anew):
            return
        self._asked_for = pick
        self.panel.set_message("Asking …")
        self.live.explain(pick, result.settings.column_distances[self.panel.column])

    def _on_result(self) -> None:
        result, display = self.bench.document.result, self.bench.document.display
        self.live.forget()
        self.explained, self._asked_for, self._surface_of = None, None, -1
        if result is not None:
            labels = [distance_label(metres) for metres in result.settings.column_distances]
            self.panel.set_distances(labels, display.column)
        self.panel.set_message()
        self.panel.set_enabled(False)
        self._draw()

    def _on_pinned(self) -> None:
        pick = self.bench.readouts.pinned
        self.panel.set_enabled(pick is not None and self.bench.document.result is not None)
        if pick is None and self.explained is not None:
            self.explained, self._asked_for = None, None
            self.panel.set_message()
            self._draw()
        else:
            self._follow()

    def _on_explained(self, explained: ExplainedSpot) -> None:
        result = self.bench.document.result
        if result is None:
            return
        self.explained = explained
        self.panel.dome.set_up(self.bench.area.main.camera.up)
        self.panel.set_explanation(explained.explanation, result.world.object_paths)
        self.panel.causes.set_causes(explained.causes)
        self._draw()

    def _on_without_wanted(self, owner: int) -> None:
        if self.explained is not None:
            self.live.without(self.explained.explanation.spot, owner)

    def _on_spot_without(self, without: SpotWithout) -> None:
        self.panel.set_without(without)
        if self._surface_of >= 0 and without.object == self.panel.looked_at() != self._surface_of:
            self._ask_for_surface(without.object)

    def _on_surface_asked(self, owner: int) -> None:
        document = self.bench.document
        if self._surface_of >= 0 and document.result is not None:
            self._surface_of = -1
            document.set_field(document.result.field)
        else:
            self._ask_for_surface(owner)

    def _ask_for_surface(self, owner: int) -> None:
        if self.explained is not None and owner >= 0:
            self.panel.set_surface(shown=self._surface_of >= 0, busy=True)
            self.live.without(self.explained.explanation.spot, owner, surface=True)

    def _on_surface_without(self, without: SurfaceWithout) -> None:
        document = self.bench.document
        if document.result is None:
            return
        name = document.result.world.object_paths[without.object].rpartition("/")[2]
        field = VertexField(without.ao, without.state, document.result.field.report)
        document.set_field(field, f"as if {name} did not cast, not stored")
        self._surface_of = without.object
        self._show_surface()
        self.panel.forget_estimate(without.object)

    def _on_field(self) -> None:
        if not self.bench.document.is_preview:
            self._surface_of = -1
        self._show_surface()

    def _show_surface(self) -> None:
        self.panel.set_surface(shown=self._surface_of >= 0, busy=self.live.is_asked(SURFACE))

    def _on_preview_asked(self, remedy: Remedy) -> None:
        if self.explained is not None:
            self.panel.causes.set_busy(True)
            self.live.preview(self.explained.explanation.spot, remedy)

    def _on_previewed(self, preview: Preview) -> None:
        self.panel.causes.set_preview(preview)

    def _on_ended(self, purpose: str) -> None:
        if purpose == PREVIEW:
            self.panel.causes.set_busy(False)
        elif purpose == SURFACE:
            self._show_surface()

    def _on_failed(self, purpose: str, text: str) -> None:
        if purpose in (PREVIEW, WITHOUT, SURFACE):
            self.bench.banner.show_message(logging.WARNING, text)
        else:
            self.panel.set_message(text)

    def _on_error(self, error: ObscuraError) -> None:
        self.bench.banner.show_message(logging.ERROR, str(error))

    def _draw(self) -> None:
        explanation = self.explained.explanation if self.explained is not None else None
        panel = self.panel
        rays = marks = None
        if explanation is not None and panel.rays.isChecked():
            rays = ray_lines(explanation, panel.column, occluder=panel.occluder())
        if explanation is not None and panel.samples.isChecked():
            marks = sample_marks(explanation)
        for viewport in self.bench.area.viewports:
            viewport.set_shapes(_RAYS, rays, opacity=0.7, width=1.0)
            viewport.set_points(_SAMPLES, marks, _SAMPLE_PIXELS)
