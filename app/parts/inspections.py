"""What the surface can be looked at by besides AO: made off the window's thread, and only what is shown."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from app.actions import Action, ActionSpec
from app.engine_protocol import SolveJob
from app.scene_preview import padded_field
from app.window_parts import Part, Workbench
from bake.errors import ObscuraError
from bake.types import BakeResult, VertexField
from viewer.around import Around
from viewer.fields import Quantity, SurfaceField
from viewer.inspections import Inspection, inspect

_JOB = "inspection"
_KEPT = 6
"""Inspections to come back to at once."""
_UNTUGGED = "values without smoothing"


class InspectionsPart(Part):
    """Keeps the document's inspection in step with what the display asks for."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self._made: tuple[object, ...] = ()
        self._untugged: tuple[BakeResult, VertexField] | None = None
        self._around: Around | None = None
        self._kept: list[tuple[tuple[object, ...], SurfaceField]] = []
        self._sources: list[tuple[object, ...]] = []

    def actions(self) -> Sequence[Action]:
        """One a kind."""
        document = self.bench.document
        return [
            (
                ActionSpec(f"inspect-{kind.value}", "View/Inspect", kind.heading, kind.meaning, needs=("result",)),
                lambda kind=kind: document.set_display(
                    document.display.replaced(quantity=Quantity.INSPECTION, inspection=kind, inspected_range=None)
                ),
            )
            for kind in Inspection
        ]

    def connect(self) -> None:
        """Follows the document."""
        document = self.bench.document
        document.display_changed.connect(self._follow)
        document.field_changed.connect(self._follow)
        document.result_changed.connect(self._forget)
        self.bench.engine.solve_finished.connect(self._on_solved)

    def _forget(self) -> None:
        if self._around is not None and self._around.result is not self.bench.document.result:
            self._around, self._kept, self._sources = None, [], []

    def _follow(self) -> None:
        document = self.bench.document
        display, result, field = document.display, document.result, document.field
        if display.quantity is not Quantity.INSPECTION or result is None or field is None:
            return
        column = min(display.column, len(result.settings.column_distances) - 1)
        wanted = (result, field, display.inspection, column)
        if self._made and _keyed(self._made) == _keyed(wanted):
            return
        untugged = self._without_smoothing(result) if display.inspection is Inspection.TUG else None
        self._made = wanted
        for known, inspection in self._kept:
            if known == _keyed(wanted):
                self.bench.jobs.drop(_JOB)
                document.set_inspection(inspection)
                return
        document.set_inspection(None)
        if display.inspection is Inspection.TUG and untugged is None:
            settings = result.settings.replaced(alpha=0.0)
            if document.result_path is not None and document.stored is not None:
                self.bench.engine.solve(
                    _UNTUGGED, document.result_path, settings, document.stored.world.vertex_count,
                    len(result.settings.column_distances),
                )  # fmt: skip
            return
        kind, around = display.inspection, self._around_of(result)
        self.bench.jobs.run(
            _JOB,
            lambda: inspect(kind, result, field, column, untugged=untugged, around=around),
            lambda inspection: self._on_made(inspection, wanted),
            self._on_failed,
        )

    def _around_of(self, result: BakeResult) -> Around:
        if self._around is None or self._around.result is not result:
            self._around = Around(result)
        return self._around

    def _without_smoothing(self, result: BakeResult) -> VertexField | None:
        return self._untugged[1] if self._untugged is not None and self._untugged[0] is result else None

    def _on_solved(self, job: SolveJob, field: VertexField, _seconds: float) -> None:
        result, stored = self.bench.document.result, self.bench.document.stored
        if job.purpose != _UNTUGGED or result is None or stored is None:
            return
        if len(field.state) == stored.world.vertex_count:
            self._untugged, self._made = (result, padded_field(field, result.world.vertex_count)), ()
            self._follow()

    def _on_made(self, inspection: SurfaceField, wanted: tuple[object, ...]) -> None:
        # What they were made of is kept with them: its identity must not become that of something else.
        self._kept = [*self._kept[1 - _KEPT :], (_keyed(wanted), inspection)]
        self._sources = [*self._sources[1 - _KEPT :], wanted]
        self.bench.document.set_inspection(inspection)

    def _on_failed(self, error: ObscuraError) -> None:
        self.bench.banner.show_message(logging.ERROR, str(error))


def _keyed(wanted: tuple[object, ...]) -> tuple[object, ...]:
    """By identity where comparing by value would compare arrays."""
    return (id(wanted[0]), id(wanted[1]), *wanted[2:])
