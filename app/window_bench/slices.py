"""How long the window's thread is held up: every event is timed, less what of it was drawing."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from PyQt6.QtCore import QEvent, QObject
from PyQt6.QtWidgets import QApplication


@dataclass(frozen=True, slots=True)
class Slice:
    """One event.

    Attributes:
        seconds: Of our own work.
        drawing: Seconds of drawing besides.
        what: Event and receiver.
    """

    seconds: float
    drawing: float
    what: str


class TimedApplication(QApplication):
    """An application that times what it delivers, in the window's thread, events inside of events left out.

    Attributes:
        slices: The longest events since `begin`, the longest first.
        drawn: Tells the seconds of drawing so far.
    """

    KEPT = 5

    def __init__(self) -> None:
        super().__init__(["obscura"])
        self.slices: list[Slice] = []
        self.drawn: Callable[[], float] = lambda: 0.0
        self._own = threading.get_ident()
        self._depth = 0

    def begin(self) -> None:
        """Forgets what was."""
        self.slices = []

    def rest(self) -> None:
        """Times nothing any more: at the end of the process no Python may run inside of an event."""
        self._depth = 1

    def notify(self, receiver: QObject, event: QEvent) -> bool:
        """Delivers an event."""
        if self._depth or threading.get_ident() != self._own:
            return super().notify(receiver, event)
        what = (type(receiver).__name__, receiver.objectName(), event.type().name)  # neither may outlive the event
        self._depth, drawn, begin = 1, self.drawn(), time.perf_counter()
        try:
            return super().notify(receiver, event)
        finally:
            self._depth = 0
            drawing = self.drawn() - drawn
            self._keep(Slice(time.perf_counter() - begin - drawing, drawing, " ".join(part for part in what if part)))

    def _keep(self, found: Slice) -> None:
        if len(self.slices) < self.KEPT or found.seconds > self.slices[-1].seconds:
            self.slices = sorted([*self.slices, found], key=lambda item: -item.seconds)[: self.KEPT]
