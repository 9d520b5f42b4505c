"""Plays a walk by the clock."""

from __future__ import annotations

import time

from PyQt6.QtCore import QObject, QTimer

from app.walk_state import WalkState
from viewer.walk_curves import frame_at

_TICK_MS = 15


class WalkPlayer(QObject):
    """Moves the state's frame while it plays; pictures that come too late are left out, the walk keeps its time."""

    def __init__(self, state: WalkState, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._state = state
        self._timer = QTimer(self)
        self._timer.setInterval(_TICK_MS)
        self._timer.timeout.connect(self._tick)
        self._moment = self._ticked = 0.0
        self._shown = -1
        state.playing_changed.connect(self._on_playing)

    def stop(self) -> None:
        """Ends the clock."""
        self._timer.stop()

    def _on_playing(self) -> None:
        if self._state.is_playing:
            self._moment, self._ticked, self._shown = self._state.time, time.monotonic(), self._state.frame
            self._timer.start()
        else:
            self._timer.stop()

    def _tick(self) -> None:
        state, now = self._state, time.monotonic()
        walk = state.walk
        if walk is None:
            state.set_playing(False)
            return
        if state.frame != self._shown:
            self._moment = state.time  # someone scrubbed meanwhile
        self._moment += (now - self._ticked) * state.view.rate
        self._ticked = now
        state.set_frame(frame_at(walk, self._moment))
        self._shown = state.frame
        if self._moment >= float(walk.time[-1]):
            state.set_playing(False)
