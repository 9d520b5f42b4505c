"""The stage report: what ran, what was skipped and why, how long it took and how much memory it needed."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Generator
from typing import Any, TypeVar

from bake.types import Progress, StageReport

_T = TypeVar("_T")
_POLL_S = 0.05


class StageClock:
    """Collects the rows of the report as the bake goes.

    Attributes:
        rows: One a stage, in order.
        started: `time.perf_counter` at the beginning of the bake.
    """

    def __init__(self) -> None:
        self.rows: list[StageReport] = []
        self.started = time.perf_counter()

    def ran(self, name: str, why: str, seconds: float, rays: int = 0) -> None:
        """Adds a row for a stage that ran; `why` counts what it did."""
        self.rows.append(StageReport(name, "ran", why, seconds, rays, peak_memory_mb()))

    def skipped(self, name: str, why: str) -> None:
        """Adds a row for a stage that the scene or the settings do not need."""
        self.rows.append(StageReport(name, "skipped", why))

    @property
    def seconds(self) -> float:
        """Seconds since the bake began."""
        return time.perf_counter() - self.started


def patiently(stage: str, work: Callable[[], _T]) -> Generator[Progress, None, tuple[_T, float]]:
    """Runs work that cannot be divided, yielding a sign of life now and then; returns its value and its seconds.

    Whoever drives the bake can thus stop it in the middle: the generator is closed and the work is left to end unheard.
    """
    begin = time.perf_counter()
    value: list[_T] = []
    failure: list[BaseException] = []

    def run() -> None:
        try:
            value.append(work())
        except BaseException as error:  # noqa: BLE001  # raised again below, in the caller's thread
            failure.append(error)

    thread = threading.Thread(target=run, name=f"stage {stage}", daemon=True)
    thread.start()
    yield Progress(stage, 0, 0)
    while thread.is_alive():
        thread.join(_POLL_S)
        yield Progress(stage, 0, 0, time.perf_counter() - begin)
    if failure:
        raise failure[0]
    return value[0], time.perf_counter() - begin


def drained(steps: Generator[Any, None, _T]) -> _T:
    """Runs work to its end and returns its value; nobody is told of its progress."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def peak_memory_mb() -> float:
    """Largest resident memory of this process so far, in MB; 0 where the platform does not tell."""
    try:
        import resource
    except ImportError:
        return 0.0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (2**20 if sys.platform == "darwin" else 2**10)
