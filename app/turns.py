"""Work for the window's thread that is too long for one event: step by step, so that it can answer in between."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from PyQt6.QtCore import QObject, QTimer


class Turns(QObject):
    """Runs steps in the order in which they came, one a turn of the event loop.

    Pictures, clicks and keys come in between, so every step leaves the window in a state that makes sense.
    """

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._steps: deque[Callable[[], object]] = deque()
        self._timer = QTimer(self)
        self._timer.setInterval(0)
        self._timer.timeout.connect(self._next)

    def add(self, *steps: Callable[[], object]) -> None:
        """Does these steps after all others; the first of them now, if there are none."""
        idle = not self._steps and not self._timer.isActive()
        self._steps.extend(steps)
        if idle:
            self._timer.start()
            self._next()

    def close(self) -> None:
        """Leaves out what is still to come."""
        self._steps.clear()
        self._timer.stop()

    @property
    def is_busy(self) -> bool:
        """Whether steps are still to come."""
        return bool(self._steps)

    def _next(self) -> None:
        try:
            if self._steps:
                self._steps.popleft()()
        finally:
            if not self._steps:
                self._timer.stop()
