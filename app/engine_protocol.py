"""What the window and its engine process say to each other over their pipe.

Plain frozen records, pickled by `multiprocessing` between two processes of this program. Nothing large is among them:
results travel as the committed result folder, re-solved values in shared memory that the window owns; what a task
returns is a few megabytes at most.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bake.errors import ObscuraError
from bake.types import Progress, SolveReport


@dataclass(frozen=True, slots=True)
class BakeJob:
    """Bake a scene into a result folder; `options` are settings by long option name."""

    id: int
    scene: str
    result: str
    options: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class SolveJob:
    """Map the stored samples of a result to its vertices again, without tracing.

    The values go to the shared memory `memory`: AO of shape (vertices, columns) float32, then states of shape
    (vertices,) uint8. Of jobs that wait, a later one replaces an earlier one of the same `purpose`.
    """

    id: int
    purpose: str
    result: str
    options: Mapping[str, Any]
    memory: str
    vertices: int
    columns: int


@dataclass(frozen=True, slots=True)
class TaskJob:
    """Run one of `app.engine_tasks.TASKS`, named by `purpose`, on a stored result.

    Of jobs that wait, a later one replaces an earlier one of the same `purpose`.
    """

    id: int
    purpose: str
    result: str
    arguments: Any


@dataclass(frozen=True, slots=True)
class Stop:
    """End the process."""


Job = BakeJob | SolveJob | TaskJob


@dataclass(frozen=True, slots=True)
class Ready:
    """The process has started and waits for jobs."""

    pid: int


@dataclass(frozen=True, slots=True)
class Report:
    """How far a bake is, and how much memory its process holds now."""

    id: int
    progress: Progress
    memory_mb: float


@dataclass(frozen=True, slots=True)
class BakeDone:
    """The result is committed at `result`; `unchanged` if nothing had to be traced."""

    id: int
    result: str
    unchanged: bool
    seconds: float


@dataclass(frozen=True, slots=True)
class SolveDone:
    """The values are in the shared memory of the job."""

    id: int
    report: SolveReport
    seconds: float


@dataclass(frozen=True, slots=True)
class TaskDone:
    """What a task returned."""

    id: int
    value: Any
    seconds: float


@dataclass(frozen=True, slots=True)
class JobFailed:
    """The job ended with an error; nothing stored was changed."""

    id: int
    error: ObscuraError


@dataclass(frozen=True, slots=True)
class JobStopped:
    """The job was cancelled; nothing stored was changed."""

    id: int


@dataclass(frozen=True, slots=True)
class LogLine:
    """A log record of the engine process."""

    level: int
    logger: str
    text: str


Reply = Ready | Report | BakeDone | SolveDone | TaskDone | JobFailed | JobStopped | LogLine
