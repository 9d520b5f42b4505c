"""Python's cyclic garbage collector, kept from going through the whole program while the window is to answer.

A full collection looks at every object that there is, whichever thread it began in, and nothing else runs meanwhile: a
sixth of a second with all that the window has imported. What is there for good is set aside, so that collections look
at what came since.
"""

from __future__ import annotations

import gc
from collections.abc import Callable

from PyQt6.QtCore import QObject, QTimer

from app.document import Document

REST_MS = 3000
"""So long after the first result came into view, at the least, what its panels have imported is set aside too."""

_THRESHOLDS = (2000, 10, 10)
_MOST = 2  # what is set aside is never freed, so it must not be done for every window or result
_done = 0


def set_aside() -> None:
    """Sets aside what there is now; after the second time in a process, does nothing."""
    global _done
    if _done < _MOST:
        _done += 1
        gc.collect(1)
        gc.freeze()
        gc.set_threshold(*_THRESHOLDS)


class SettingAside(QObject):
    """Sets aside a window that has just been made, and then what its first result brought along.

    Args:
        document: What is open in the window.
        is_busy: Whether anything is under way.
        parent: The window.
    """

    def __init__(self, document: Document, is_busy: Callable[[], bool], parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._document, self._is_busy = document, is_busy
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(REST_MS)
        self._timer.timeout.connect(self._on_rest)
        document.result_changed.connect(self._on_result)
        set_aside()

    def _on_result(self) -> None:
        if self._document.result is not None:
            self._document.result_changed.disconnect(self._on_result)
            self._timer.start()

    def _on_rest(self) -> None:
        if self._is_busy():
            self._timer.start()
        else:
            set_aside()
