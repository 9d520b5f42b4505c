"""Short work off the GUI thread: reading files, hashing, copying. The only place where threads meet Qt."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable
from typing import Any

from PyQt6.QtCore import QObject, QRunnable, QThreadPool, pyqtSignal

from bake.errors import ObscuraError

logger = logging.getLogger(__name__)

HOLD_S = 0.0005
"""For how long a thread may keep the interpreter from the window's, which asks for it at every cell of a table."""


def favour_window() -> None:
    """Lets no other thread of the process make the window's wait for long; Python's own 5 ms add up."""
    sys.setswitchinterval(min(HOLD_S, sys.getswitchinterval()))


class Jobs(QObject):
    """Runs functions in a small thread pool; what they return arrives in the thread that owns this object.

    A job supersedes an earlier one of the same name, whose outcome is then dropped.
    """

    _ended = pyqtSignal(str, int, object, object)  # name, number, value, error

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._pool = QThreadPool(self)
        self._pool.setMaxThreadCount(2)
        self._count = 0
        self._closed = False
        self._current: dict[str, tuple[int, Callable[[Any], object], Callable[[ObscuraError], object]]] = {}
        self._ended.connect(self._on_ended)

    def run(
        self,
        name: str,
        work: Callable[[], Any],
        done: Callable[[Any], object],
        failed: Callable[[ObscuraError], object],
    ) -> None:
        """Runs `work`, then calls `done` with its value or `failed` with its error; nothing after `close`."""
        if self._closed:
            return
        self._count += 1
        self._current[name] = (self._count, done, failed)
        self._pool.start(_Runnable(name, self._count, work, self._ended))

    def drop(self, name: str) -> None:
        """Forgets the job of that name; its outcome is not delivered."""
        self._current.pop(name, None)

    @property
    def is_busy(self) -> bool:
        """Whether an outcome is still to come."""
        return bool(self._current)

    def close(self) -> None:
        """Waits for what runs and delivers nothing more."""
        self._closed = True
        self._current.clear()
        self._pool.clear()
        self._pool.waitForDone(10_000)

    def _on_ended(self, name: str, number: int, value: object, error: ObscuraError | None) -> None:
        current = self._current.get(name)
        if current is None or current[0] != number:
            return
        del self._current[name]
        _, done, failed = current
        if error is None:
            done(value)
        else:
            failed(error)


class _Runnable(QRunnable):
    def __init__(self, name: str, number: int, work: Callable[[], Any], ended: Any) -> None:
        super().__init__()
        self._name, self._number, self._work, self._ended = name, number, work, ended

    def run(self) -> None:
        """Called by the pool in one of its threads."""
        value, error = None, None
        try:
            value = self._work()
        except ObscuraError as caught:
            error = caught
        except Exception as caught:
            logger.exception("defect in %s", self._name)
            error = ObscuraError(f"defect in {self._name}: {type(caught).__name__}: {caught}", remedy="see the log")
        try:
            self._ended.emit(self._name, self._number, value, error)
        except (RuntimeError, AttributeError):  # Qt's side of the sender is gone
            logger.debug("%s ended after the window was gone", self._name)
