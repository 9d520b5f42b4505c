"""How long pictures take: what VTK draws, and what it takes to put the whole window together, told apart from our work.

Without a GPU nearly all of a picture is drawn by the CPU, which says nothing about the window itself.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from PyQt6.QtCore import QObject, pyqtSignal

from app.gl_view import GLView


class DrawingClock(QObject):
    """Adds up the time spent on drawing in the window's thread, and tells when a picture is on screen.

    From its making to `stop` it steps between `GLView` and its `paintGL` and `initializeGL`; `follow` adds the time
    from when Qt begins to put the window's parts together to when the picture was handed to the screen.

    Attributes:
        seconds: Since it was made.
        pictures: How many there were.
    """

    shown = pyqtSignal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.seconds = 0.0
        self.pictures = 0
        self._composing = 0.0
        self._replaced: dict[str, Any] = {name: GLView.__dict__.get(name) for name in ("paintGL", "initializeGL")}
        for name in self._replaced:
            setattr(GLView, name, self._timed(getattr(GLView, name)))

    def follow(self, view: GLView) -> None:
        """Times the pictures of the window that this view belongs to; one view of it is enough."""
        view.aboutToCompose.connect(self._on_compose)
        view.frameSwapped.connect(self._on_swapped)

    def stop(self) -> None:
        """Leaves `GLView` as it was."""
        for name, own in self._replaced.items():
            if own is None:
                delattr(GLView, name)
            else:
                setattr(GLView, name, own)

    def _timed(self, draw: Callable[[GLView], None]) -> Callable[[GLView], None]:
        def timed(view: GLView) -> None:
            begin = time.perf_counter()
            try:
                draw(view)
            finally:
                self.seconds += time.perf_counter() - begin

        return timed

    def _on_compose(self) -> None:
        self._composing = time.perf_counter()

    def _on_swapped(self) -> None:
        if self._composing:
            self.seconds += time.perf_counter() - self._composing
            self._composing = 0.0
        self.pictures += 1
        self.shown.emit()
