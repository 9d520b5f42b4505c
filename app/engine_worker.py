"""The engine process: takes jobs from a pipe, bakes, reports, and stops when told to.

This module runs in a spawned interpreter without Qt. Warp and Embree live and die here, so that a fault of theirs
takes neither the window nor its data along.
"""

from __future__ import annotations

import functools
import logging
import os
import signal
import sys
import time
from collections.abc import Callable, Generator
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from app.engine_protocol import (
    BakeDone,
    BakeJob,
    Job,
    JobFailed,
    JobStopped,
    LogLine,
    Ready,
    RebakeDone,
    RebakeJob,
    Report,
    SolveDone,
    SolveJob,
    Stop,
    TaskDone,
    TaskJob,
)
from app.rebake_worker import RebakeKeeper
from app.solve_worker import SolveKeeper
from bake.errors import Cancelled, ObscuraError
from bake.settings import BakeSettings
from bake.types import BakeResult, Progress, VertexField

REPORT_SECONDS = 0.1
"""Shortest time between two progress reports of the same stage."""

logger = logging.getLogger(__name__)


class Outcome(Protocol):
    """What the window needs of `bake.pipeline.BakeOutcome`."""

    @property
    def unchanged(self) -> bool:
        """Whether nothing had to be traced."""
        ...

    @property
    def seconds(self) -> float:
        """Wall time of the bake."""
        ...


Bake = Callable[[BakeJob], Generator[Progress, None, Outcome]]
"""Runs a bake job; what the process is started with, so that tests can start it with a slow or a crashing one."""


def bake_job(job: BakeJob) -> Generator[Progress, None, Outcome]:
    """Bakes with the pipeline."""
    from bake.pipeline import BakeRequest, run_bake

    request = BakeRequest(scene_path=Path(job.scene), result_path=Path(job.result), options=job.options)
    return run_bake(request)


def run_worker(connection: Connection, cancelled_id: Any, bake: Bake = bake_job) -> None:
    """Serves jobs until told to stop or the window's end of the pipe closes.

    Args:
        connection: The process's end of the pipe.
        cancelled_id: Shared integer without a lock; jobs up to this number are to stop. (A lock could be left held
            by a killed process.)
        bake: Runs a bake job.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl+C in the terminal is the window's to handle
    root = logging.getLogger()
    root.addHandler(_PipeHandler(connection))
    root.setLevel(logging.INFO)
    keepers = (RebakeKeeper(), SolveKeeper())
    try:
        connection.send(Ready(os.getpid()))
        while not isinstance(job := connection.recv(), Stop):
            _serve(connection, cancelled_id, bake, keepers, job)
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return  # the window is gone


def _serve(
    connection: Connection, cancelled_id: Any, bake: Bake, keepers: tuple[RebakeKeeper, SolveKeeper], job: Job
) -> None:
    try:
        if isinstance(job, BakeJob):
            outcome = _driven(connection, cancelled_id, job, bake(job))
            connection.send(BakeDone(job.id, job.result, outcome.unchanged, outcome.seconds))
        elif isinstance(job, RebakeJob):
            done = _driven(connection, cancelled_id, job, keepers[0].run(job))
            connection.send(RebakeDone(job.id, done.report, done.seconds))
        elif isinstance(job, TaskJob):
            connection.send(_task(connection, cancelled_id, job))
        else:
            connection.send(_solve(job, *keepers))
    except Cancelled:
        connection.send(JobStopped(job.id))
    except ObscuraError as error:
        connection.send(JobFailed(job.id, error))
    except MemoryError:
        connection.send(JobFailed(job.id, ObscuraError("out of memory", remedy="use fewer samples or rays")))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        raise
    except Exception as error:
        logger.exception("defect in the engine")
        text = f"defect in the engine: {type(error).__name__}: {error}"
        connection.send(JobFailed(job.id, ObscuraError(text, remedy="see the log; please report it")))


def _driven(connection: Connection, cancelled_id: Any, job: Job, steps: Generator[Any, None, Any]) -> Any:
    """Runs a job to its end, reporting on the way; returns what it returns.

    Raises:
        Cancelled: it was to stop.
    """
    stage, last = "", 0.0
    try:
        while True:
            if cancelled_id.value >= job.id:
                raise Cancelled("the job was cancelled")
            try:
                progress = next(steps)
            except StopIteration as end:
                return end.value
            if not isinstance(progress, Progress):
                connection.send(progress)
                continue
            now = time.monotonic()
            if progress.stage != stage or now - last >= REPORT_SECONDS:
                stage, last = progress.stage, now
                connection.send(Report(job.id, progress, resident_memory_mb()))
    finally:
        steps.close()


def _task(connection: Connection, cancelled_id: Any, job: TaskJob) -> TaskDone:
    from app.engine_tasks import TASKS

    started = time.monotonic()
    result = _loaded(job.result, os.stat(Path(job.result) / "manifest.json").st_mtime_ns)
    value = _driven(connection, cancelled_id, job, TASKS[job.purpose](result, job.arguments))
    return TaskDone(job.id, value, time.monotonic() - started)


def _solve(job: SolveJob, rebaked: RebakeKeeper, keeper: SolveKeeper) -> SolveDone:
    started = time.monotonic()
    kept, begin = rebaked.kept(job.result) or (None, None)
    result = kept or _loaded(job.result, os.stat(Path(job.result) / "manifest.json").st_mtime_ns)
    field = keeper.solve(result, BakeSettings.from_options(job.options), begin)
    memory = SharedMemory(job.memory)
    try:
        ao, state = field_views(memory, job.vertices, job.columns)
        ao[:] = field.ao
        state[:] = field.state
        del ao, state  # views must go before the memory can be closed
    finally:
        memory.close()
    return SolveDone(job.id, field.report, time.monotonic() - started)


@functools.lru_cache(maxsize=1)
def _loaded(folder: str, _modified: int) -> BakeResult:
    """The result at a folder, memory-mapped; kept while it is the one in use and unchanged."""
    from bake.results import load_result

    return load_result(Path(folder))


def field_bytes(vertices: int, columns: int) -> int:
    """Bytes of shared memory that the values of a `SolveJob` take."""
    return max(1, vertices * (4 * columns + 1))


def field_views(memory: SharedMemory, vertices: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """AO, shape (vertices, columns) float32, and state, shape (vertices,) uint8, inside shared memory."""
    ao = np.ndarray((vertices, columns), np.float32, memory.buf)
    return ao, np.ndarray((vertices,), np.uint8, memory.buf, offset=ao.nbytes)


def copied_field(memory: SharedMemory, job: SolveJob, done: SolveDone) -> VertexField:
    """The values of a finished `SolveJob`, copied out of shared memory."""
    ao, state = field_views(memory, job.vertices, job.columns)
    return VertexField(ao.copy(), state.copy(), done.report)


def resident_memory_mb() -> float:
    """Memory that this process holds now, in MB; its peak where the system does not tell; 0 if unknown."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
    except (OSError, ValueError, IndexError):
        pass
    try:
        import resource
    except ImportError:
        return 0.0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 1e6 if sys.platform == "darwin" else peak / 1e3


class _PipeHandler(logging.Handler):
    """Sends log records to the window."""

    def __init__(self, connection: Connection) -> None:
        super().__init__(logging.INFO)
        self._connection = connection

    def emit(self, record: logging.LogRecord) -> None:
        """Sends one record; without a window there is nobody to tell."""
        try:
            text = self.format(record)
            self._connection.send(LogLine(record.levelno, record.name, text))
        except (OSError, ValueError):
            pass
