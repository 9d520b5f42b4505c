"""Drives one window as a user does, and times from what the user does to the picture that answers it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pyvistaqt  # noqa: F401 - sets the OpenGL format of the process before any window
from PyQt6.QtCore import QCoreApplication, QEvent, QEventLoop, QPointF, QSettings, Qt, QTimer
from PyQt6.QtGui import QMouseEvent
from PyQt6.QtWidgets import QApplication

from app.window import Window
from app.window_bench.drawing import DrawingClock
from app.window_bench.slices import Slice, TimedApplication
from bake.errors import ObscuraError

PATIENCE_S = 120.0
_QUIET_S = 0.3
_SIZE = (1280, 800)


@dataclass(frozen=True, slots=True)
class Answer:
    """One answer of the window.

    Attributes:
        seconds: From the input to the picture that shows the answer, without drawing.
        drawing: Seconds of drawing in between.
    """

    seconds: float
    drawing: float


class Driver:
    """A window on a result, with habits of its own.

    Args:
        app: Times its events.
        result: A result folder.
        folder: For habits and cache.

    Attributes:
        window: The window.
        phases: The longest slices of our own work in the window's thread, by what the user did.
    """

    def __init__(self, app: TimedApplication, result: Path, folder: Path) -> None:
        self._app = app
        self._clock = DrawingClock()
        app.drawn = lambda: self._clock.seconds
        self.phases: dict[str, list[Slice]] = {}
        self.window = Window(folder / "cache", QSettings(str(folder / "habits.ini"), QSettings.Format.IniFormat))
        self._clock.follow(self.window.area.main.view)
        self.window.resize(*_SIZE)
        self.phase("opening", lambda: self._open(result))

    def close(self) -> None:
        """Closes the window and waits until nothing of it is left."""
        self.window.close()
        self.window.deleteLater()
        for _ in range(3):
            QApplication.processEvents()
            QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)
        self._clock.stop()
        self._app.rest()

    def drawn(self) -> float:
        """Seconds of drawing so far."""
        return self._clock.seconds

    def phase(self, name: str, work: Callable[[], object]) -> None:
        """Does something, and keeps its longest slices under a name."""
        self._app.begin()
        work()
        self.settle()
        self.phases[name] = list(self._app.slices)

    def ask(self, act: Callable[[], object], answered: Callable[[], bool]) -> Answer:
        """Acts from within the event loop and waits for the first picture after which `answered` holds.

        Raises:
            ObscuraError: it never did.
        """
        loop = QEventLoop()
        ends: list[tuple[float, float]] = []

        def on_picture() -> None:
            if not ends and answered():
                ends.append((time.perf_counter(), self._clock.seconds))
                loop.quit()

        self._clock.shown.connect(on_picture)
        guard = QTimer()
        guard.setSingleShot(True)
        guard.timeout.connect(loop.quit)
        guard.start(int(1000 * PATIENCE_S))
        begin, drawn = time.perf_counter(), self._clock.seconds
        QTimer.singleShot(0, act)
        loop.exec()
        self._clock.shown.disconnect(on_picture)
        if not ends:
            raise ObscuraError("the window did not answer", where="bench window", remedy="run it on an idle machine")
        drawing = ends[0][1] - drawn
        return Answer(ends[0][0] - begin - drawing, drawing)

    def settle(self) -> None:
        """Waits until nothing is under way in the window."""
        bench, begin, quiet = self.window.bench, time.perf_counter(), time.perf_counter()
        while time.perf_counter() - quiet < _QUIET_S and time.perf_counter() - begin < PATIENCE_S:
            self.wait(20)
            if bench.jobs.is_busy or not bench.controller.is_idle or bench.picker.is_busy:
                quiet = time.perf_counter()

    def wait(self, milliseconds: int) -> None:
        """Lets the window go on."""
        loop = QEventLoop()
        QTimer.singleShot(milliseconds, loop.quit)
        loop.exec()

    def move_to(self, place: QPointF) -> None:
        """Moves the mouse within the view."""
        self._mouse(QEvent.Type.MouseMove, place, Qt.MouseButton.NoButton)

    def click(self, place: QPointF) -> None:
        """Clicks in the view."""
        self._mouse(QEvent.Type.MouseButtonPress, place, Qt.MouseButton.LeftButton)
        self._mouse(QEvent.Type.MouseButtonRelease, place, Qt.MouseButton.LeftButton)

    def _mouse(self, kind: QEvent.Type, place: QPointF, button: Qt.MouseButton) -> None:
        view = self.window.area.main.view
        held = button if kind is QEvent.Type.MouseButtonPress else Qt.MouseButton.NoButton
        at = view.mapToGlobal(place)
        QApplication.sendEvent(view, QMouseEvent(kind, place, at, button, held, Qt.KeyboardModifier.NoModifier))

    def _open(self, result: Path) -> None:
        document = self.window.document
        self.window.show()
        self.ask(lambda: self.window.controller.open(result), lambda: document.shown() is not None)
