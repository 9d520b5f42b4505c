"""Keeps the models of regions in step with sliders and brush, off the window's thread and without tracing."""

from __future__ import annotations

import logging
from collections.abc import Callable

from PyQt6.QtCore import QObject, pyqtSignal

from app.jobs import Jobs
from app.latest_job import LatestJob
from app.region_models import Fit, Refit, Sums, refit, summed
from app.region_state import RegionState
from bake.errors import ObscuraError
from bake.region_types import Regions


class RegionLive(QObject):
    """Makes models again when other settings or other points are asked for.

    Args:
        state: What is asked for, and where the models go.
        jobs: Where the work runs.
        parent: Qt parent.
    """

    failed = pyqtSignal(int, str)  # logging level, text

    def __init__(self, state: RegionState, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._state, self._jobs = state, jobs
        self._known: Refit | None = None
        self._sums: Sums | None = None
        self._job = LatestJob(
            jobs,
            "region models",
            self._prepare,
            self._on_made,
            lambda error: self.failed.emit(logging.ERROR, str(error)),
        )
        state.settings_changed.connect(self._job.request)
        state.bits_changed.connect(self._job.request)
        state.opened.connect(self._on_opened)

    @property
    def is_busy(self) -> bool:
        """Whether models are under way."""
        return self._job.is_busy

    def get_ready(self) -> None:
        """Sums up the points in view, so that the first move of a slider is answered as quickly as the next."""
        baked = self._state.baked
        if baked is not None and self._sums is None and not self._job.is_busy:
            self._jobs.run("region sums", lambda: (baked, summed(baked.points, baked.graph)), self._on_sums, _ignore)

    def _on_sums(self, found: tuple[Regions, Sums]) -> None:
        if found[0] is self._state.baked and self._sums is None:
            self._sums = found[1]

    def _prepare(self) -> Callable[[], Refit] | None:
        state = self._state
        baked, settings, bits, result = state.baked, state.settings, state.bits, state.document.result
        if baked is None or settings is None:
            return None
        if not state.is_edited and result is not None and settings == result.settings:
            if state.is_preview:
                state.set_regions(baked, state.energies[:0])
            return None
        edited = bits if state.is_edited else None
        stored = result is not None and settings.optimise_centre == result.settings.optimise_centre
        fit = Fit(edited, settings.optimise_centre, is_new=edited is not None or not stored)
        known = self._known if self._known is not None and self._known.fit.is_same(fit) else None
        sums = self._sums
        return lambda: refit(baked, settings, fit, known, sums)

    def _on_made(self, made: Refit) -> None:
        regions = made.regions
        if self._state.baked is not None and regions.graph is self._state.baked.graph:
            self._known, self._sums = made, made.sums
            self._state.set_regions(regions, made.energies)

    def _on_opened(self) -> None:
        self._known = self._sums = None


def _ignore(_error: ObscuraError) -> None:
    """The slider will meet the same error and say so."""
