"""Keeps the models of regions in step with sliders and brush, off the window's thread and without tracing."""

from __future__ import annotations

import logging
from collections.abc import Callable

from PyQt6.QtCore import QObject, pyqtSignal

from app.jobs import Jobs
from app.latest_job import LatestJob
from app.region_models import Refit, refit
from app.region_state import RegionState
from bake.types import BoolArray

_Made = tuple[BoolArray | None, bool, Refit]  # bits, optimised centres, what came of them


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
        self._state = state
        self._known: _Made | None = None
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

    def _prepare(self) -> Callable[[], _Made] | None:
        state = self._state
        baked, settings, bits, result = state.baked, state.settings, state.bits, state.document.result
        if baked is None or settings is None:
            return None
        if not state.is_edited and result is not None and settings == result.settings:
            if state.is_preview:
                state.set_regions(baked, state.energies[:0])
            return None
        known = self._known
        usable = known is not None and known[0] is bits and known[1] == settings.optimise_centre
        earlier = known[2] if known is not None and usable else None
        edited = bits if state.is_edited else None
        return lambda: (bits, settings.optimise_centre, refit(baked, settings, edited, earlier))

    def _on_made(self, made: _Made) -> None:
        regions = made[2].regions
        if self._state.baked is not None and regions.graph is self._state.baked.graph:
            self._known = made
            self._state.set_regions(regions, made[2].energies)

    def _on_opened(self) -> None:
        self._known = None
