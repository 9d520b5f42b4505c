"""The stage report of a bake: what ran, what was skipped and why, after Table 1 of Sloan et al. 2013."""

from __future__ import annotations

from PyQt6.QtWidgets import QVBoxLayout, QWidget

from app.elided_label import ElidedLabel
from app.tables import Cell, RowsView
from bake.types import BakeResult, StageReport

_SKIPPED = "#8a8f98"


class StageTable(QWidget):
    """A row a stage, with totals above."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._summary = ElidedLabel("Nothing baked yet.")
        self.view = RowsView(("Stage", "Status", "Seconds", "Rays", "Mrays/s", "Peak MB", "What"), stretch=6)
        self.view.setSortingEnabled(False)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.addWidget(self._summary)
        layout.addWidget(self.view, 1)

    def set_result(self, result: BakeResult | None) -> None:
        """Shows a result's report; None empties it."""
        if result is None:
            self._summary.setText("Nothing baked yet.")
            self.view.set_rows([])
            return
        self.view.set_rows([_row(stage) for stage in result.stages])
        seconds = sum(stage.seconds for stage in result.stages)
        rays = sum(stage.rays for stage in result.stages)
        report = result.field.report
        self._summary.setText(
            f"{result.world.face_count:,} faces  ·  {len(result.samples):,} samples"
            f"  ·  {rays:,} rays  ·  {seconds:.1f} s in stages"
            f"  ·  {result.tracer} on {result.device}  ·  seed {result.settings.seed}"
            f"  ·  solve: {report.unknowns:,} unknowns, {report.iterations} iterations"
        )


def _row(stage: StageReport) -> tuple[Cell, ...]:
    color = _SKIPPED if stage.status == "skipped" else None
    rate = stage.rays / stage.seconds / 1e6 if stage.rays and stage.seconds > 0 else 0.0
    return (
        Cell(stage.name, color=color),
        Cell(stage.status, color=color),
        Cell(f"{stage.seconds:.2f}" if stage.seconds else "", stage.seconds, color),
        Cell(f"{stage.rays:,}" if stage.rays else "", stage.rays, color),
        Cell(f"{rate:.2f}" if rate else "", rate, color),
        Cell(f"{stage.peak_memory_mb:,.0f}" if stage.peak_memory_mb else "", stage.peak_memory_mb, color),
        Cell(stage.why, color=color),
    )
