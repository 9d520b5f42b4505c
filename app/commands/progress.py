"""Drives a bake on the command line: progress with ETA on stderr, and Ctrl+C."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType
from typing import TextIO, TypeVar

from bake.errors import Cancelled
from bake.types import Progress

_T = TypeVar("_T")
_LINE_SECONDS = 1.0  # plain lines; a terminal is redrawn more often
_REDRAW_SECONDS = 0.1
_COMMIT_STAGE = "store"


class ProgressLine:
    """One line that is redrawn on a terminal; elsewhere a plain line at most every second."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = sys.stderr if stream is None else stream
        self._is_terminal = self._stream.isatty()
        # What fails within the first second says so in one line, without progress before it.
        self._last = time.monotonic()
        self._drawn = False

    def show(self, progress: Progress) -> None:
        """Shows where the bake stands, if it is time to."""
        now = time.monotonic()
        if now - self._last < (_REDRAW_SECONDS if self._is_terminal else _LINE_SECONDS):
            return
        self._last = now
        text = describe(progress)
        self._stream.write(f"\r\x1b[K{text}" if self._is_terminal else f"{text}\n")
        self._stream.flush()
        self._drawn = self._is_terminal

    def clear(self) -> None:
        """Takes the line away."""
        if self._drawn:
            self._stream.write("\r\x1b[K")
            self._stream.flush()
            self._drawn = False


def describe(progress: Progress) -> str:
    """A progress report as one line, e.g. `trace 45 %, 3.1 Mrays/s, 12 s left`."""
    parts = [progress.stage]
    if progress.total:
        parts[0] += f" {100 * progress.done // progress.total} %"
    if progress.rays_per_s:
        parts.append(f"{progress.rays_per_s / 1e6:.1f} Mrays/s")
    if progress.seconds and 0 < progress.done < progress.total:
        parts.append(f"{duration(progress.seconds * (progress.total - progress.done) / progress.done)} left")
    return ", ".join(parts) if progress.total else f"{parts[0]} …"


def duration(seconds: float) -> str:
    """A time as people read it: `0.4 s`, `12 s`, `3 min 5 s` or `2 h 4 min`."""
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def drive(steps: Generator[Progress, None, _T], line: ProgressLine | None = None) -> _T:
    """Runs a bake to its end and returns what came of it.

    Ctrl+C closes the generator at its next sign of life, when nothing of it is at work; once the result is being
    stored the work is done, and it is let finish. A second Ctrl+C ends the process on the spot, which no stored result
    minds.

    Raises:
        Cancelled: on Ctrl+C.
        ObscuraError: as the bake says.
    """
    line = ProgressLine() if line is None else line
    interrupt = _Interrupt()
    try:
        with interrupt.caught():
            while True:
                progress = next(steps)
                if interrupt.is_asked and progress.stage != _COMMIT_STAGE:
                    raise Cancelled()
                line.show(progress)
    except StopIteration as end:
        return end.value
    finally:
        steps.close()
        line.clear()


class _Interrupt:
    """Ctrl+C as a wish, not as an exception: that would strike in the midst of native code and be lost, or worse."""

    def __init__(self) -> None:
        self.is_asked = False

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        if self.is_asked:
            os._exit(Cancelled.exit_code)
        self.is_asked = True

    @contextmanager
    def caught(self) -> Generator[None]:
        """Listens while the block runs; only the main thread can."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = signal.signal(signal.SIGINT, self._on_signal)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)
