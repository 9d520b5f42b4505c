"""Keeps the models of regions in step with sliders and brush, off the window's thread and without tracing."""

from __future__ import annotations

import logging

from PyQt6.QtCore import QObject, pyqtSignal

from app.jobs import Jobs
from app.region_models import Refit, refit
from app.region_state import RegionState
from bake.errors import ObscuraError
from bake.types import BoolArray

_JOB = "region models"


class RegionLive(QObject):
    """One refit at a time; what changes meanwhile is asked for when it is done, so that sliders never queue up work.

    Args:
        state: What is asked for, and where the models go.
        jobs: Where the work runs.
        parent: Qt parent.
    """

    busy = pyqtSignal(bool)
    failed = pyqtSignal(int, str)  # logging level, text

    def __init__(self, state: RegionState, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._state, self._jobs = state, jobs
        self._known: tuple[BoolArray | None, bool, Refit] | None = None  # bits, optimised centres, what came of them
        self._running = self._wanted = False
        state.settings_changed.connect(self.request)
        state.bits_changed.connect(self.request)
        state.opened.connect(self._on_opened)

    @property
    def is_busy(self) -> bool:
        """Whether models are under way."""
        return self._running

    def request(self) -> None:
        """Makes the models again with the state's settings and points."""
        if self._running:
            self._wanted = True
            return
        state = self._state
        baked, settings, bits = state.baked, state.settings, state.bits
        if baked is None or settings is None:
            return
        if not state.is_edited and state.document.result is not None and settings == state.document.result.settings:
            if state.is_preview:
                state.set_regions(baked, state.energies[:0])
            return
        known = self._known
        usable = known is not None and known[0] is bits and known[1] == settings.optimise_centre
        earlier = known[2] if known is not None and usable else None
        edited = bits if state.is_edited else None
        self._running = True
        self.busy.emit(True)
        self._jobs.run(
            _JOB,
            lambda: refit(baked, settings, edited, earlier),
            lambda made: self._on_made(made, bits, settings.optimise_centre),
            self._on_failed,
        )

    def _on_made(self, made: Refit, bits: BoolArray | None, optimised: bool) -> None:
        self._running = False
        state = self._state
        if state.baked is not None and made.regions.graph is state.baked.graph:
            self._known = (bits, optimised, made)
            state.set_regions(made.regions, made.energies)
        self._go_on()

    def _on_failed(self, error: ObscuraError) -> None:
        self._running = False
        self.failed.emit(logging.ERROR, str(error))
        self._go_on()

    def _go_on(self) -> None:
        if self._wanted:
            self._wanted = False
            self.request()
        if not self._running:
            self.busy.emit(False)

    def _on_opened(self) -> None:
        self._known = None
        if not self._running:
            self._wanted = False
