"""Asks the engine for explanations, counterfactuals and previews, and hands on what is still wanted."""

from __future__ import annotations

from typing import Any

from PyQt6.QtCore import QObject, pyqtSignal

from app.document import Document
from app.engine import Engine
from app.engine_protocol import TaskJob
from app.explain_task import ExplainedSpot, PreviewRequest, SpotRequest, WithoutRequest
from bake.errors import ObscuraError
from bake.explain.cause_types import Remedy
from bake.explain.types import Spot, SpotWithout, SurfaceWithout
from viewer.picking import Pick

EXPLAIN, WITHOUT, SURFACE, PREVIEW = "explain", "without", "surface-without", "preview"


class ExplainLive(QObject):
    """Only the latest request of each purpose is answered.

    Args:
        document: Whose result is asked about.
        engine: Does the work.
        parent: Qt parent.
    """

    explained = pyqtSignal(object)  # ExplainedSpot
    spot_without = pyqtSignal(object)  # SpotWithout
    surface_without = pyqtSignal(object)  # SurfaceWithout
    previewed = pyqtSignal(object)  # Preview
    failed = pyqtSignal(str, str)  # purpose, what is wrong
    ended = pyqtSignal(str)  # purpose, in any case

    def __init__(self, document: Document, engine: Engine, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._document, self._engine = document, engine
        self._asked: dict[str, int] = {}
        engine.task_finished.connect(self._on_finished)
        engine.failed.connect(self._on_failed)
        engine.cancelled.connect(self._ends)

    def explain(self, pick: Pick, distance: float) -> None:
        """Why the surface has its value at a point."""
        self._ask(EXPLAIN, SpotRequest(pick.face, pick.barycentric, distance))

    def without(self, spot: Spot, owner: int, *, surface: bool = False) -> None:
        """What if an object did not cast; the whole surface takes long and gives way to whatever is asked next."""
        if SURFACE in self._asked:
            self._engine.cancel_task(SURFACE)
        self._ask(SURFACE if surface else WITHOUT, WithoutRequest(spot, owner, surface))

    def preview(self, spot: Spot, remedy: Remedy) -> None:
        """What if a remedy were applied."""
        self._ask(PREVIEW, PreviewRequest(spot, remedy))

    def is_asked(self, purpose: str) -> bool:
        """Whether an answer is waited for."""
        return purpose in self._asked

    def forget(self) -> None:
        """Wants no answer any more."""
        self._asked.clear()

    def _ask(self, purpose: str, request: Any) -> None:
        folder = self._document.result_path
        if folder is not None and self._document.result is not None:
            # One under way is left to end, its outcome dropped: what it warms up serves the next one.
            self._asked[purpose] = self._engine.task(purpose, folder, request)

    def _on_finished(self, job: object, value: object) -> None:
        if not self._ends(job):
            return
        if isinstance(value, ExplainedSpot):
            self.explained.emit(value)
        elif isinstance(value, SpotWithout):
            self.spot_without.emit(value)
        elif isinstance(value, SurfaceWithout):
            self.surface_without.emit(value)
        elif isinstance(job, TaskJob) and job.purpose == PREVIEW:
            self.previewed.emit(value)

    def _on_failed(self, job: object, error: ObscuraError) -> None:
        if self._ends(job) and isinstance(job, TaskJob):
            self.failed.emit(job.purpose, str(error))

    def _ends(self, job: object) -> bool:
        """Whether this ends the request that is waited for."""
        if not isinstance(job, TaskJob) or self._asked.get(job.purpose) != job.id:
            return False
        del self._asked[job.purpose]
        self.ended.emit(job.purpose)
        return True
