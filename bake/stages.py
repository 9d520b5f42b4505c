"""The stage report: what ran, what was skipped and why, how long it took and how much memory it needed."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Generator
from dataclasses import replace
from typing import Any, Generic, TypeVar

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

    def beside(self, name: str, what: str, seconds: float) -> None:
        """Adds to the row of a stage what it did beside other stages: its seconds are its own, not the bake's."""
        for number, row in enumerate(self.rows):
            if row.name == name and row.status == "ran":
                why = f"{row.why}; {what} beside other stages: {seconds:.2f} s"
                self.rows[number] = replace(row, why=why, seconds=row.seconds + seconds)

    def skipped(self, name: str, why: str) -> None:
        """Adds a row for a stage that the scene or the settings do not need."""
        self.rows.append(StageReport(name, "skipped", why))

    @property
    def seconds(self) -> float:
        """Seconds since the bake began."""
        return time.perf_counter() - self.started


class Running(Generic[_T]):
    """Work that cannot be divided, on a thread of its own, beside whatever else goes on.

    Args:
        stage: Its name where it is waited for.
        work: What to do.
    """

    def __init__(self, stage: str, work: Callable[[], _T]) -> None:
        self._stage, self._work = stage, work
        self._value: list[_T] = []
        self._failure: list[BaseException] = []
        self._begin = time.perf_counter()
        self._seconds = 0.0
        self._thread = threading.Thread(target=self._run, name=f"stage {stage}", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            self._value.append(self._work())
        except BaseException as error:  # noqa: BLE001  # raised again where it is waited for
            self._failure.append(error)
        self._seconds = time.perf_counter() - self._begin

    def ended(self) -> Generator[Progress, None, tuple[_T, float]]:
        """Waits for its end, yielding a sign of life now and then; returns its value and its own seconds.

        Whoever drives the bake can thus stop it in the middle: the generator is closed and the work is left to end
        unheard. What the work raised is raised here.
        """
        while self._thread.is_alive():
            self._thread.join(_POLL_S)
            yield Progress(self._stage, 0, 0, time.perf_counter() - self._begin)
        if self._failure:
            raise self._failure[0]
        return self._value[0], self._seconds


def patiently(stage: str, work: Callable[[], _T]) -> Generator[Progress, None, tuple[_T, float]]:
    """Runs work that cannot be divided to its end; see `Running.ended`."""
    running = Running(stage, work)
    yield Progress(stage, 0, 0)
    return (yield from running.ended())


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
