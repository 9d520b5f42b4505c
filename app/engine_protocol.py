"""What the window and its engine process say to each other over their pipe.

Plain frozen records, pickled by `multiprocessing` between two processes of this program. Nothing large is among them:
results travel as the committed result folder, re-solved values in shared memory that the window owns; what a task
returns, and what a rebake changes, is a few megabytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bake.errors import ObscuraError
from bake.types import Float32Array, Int32Array, Int64Array, Progress, SolveReport

if TYPE_CHECKING:
    from bake.rebake.types import RebakeReport


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
class RebakeJob:
    """Bring a stored result up to date with its scene; a later one replaces an earlier one that waits.

    Attributes:
        id: Number of the job.
        scene: The scene's file.
        result: The result's folder; it is replaced.
        options: Settings by long option name that are wanted now.
        objects: Paths of the objects whose values may change; None for all.
        faces: Triangles, numbered within their objects, shape (f,) int32, by path: values at these may change as well,
            and if `objects` is None, at no others. None for all.
        camera: Four rows that take a point, metres from the world's origin, to the picture's homogeneous
            coordinates: what lies in the picture comes first. None for no preference.
        bound: Most AO that may be skipped for a sample.
        prepare: Only build what every rebake of the result needs; the next rebake then waits for it.
        purpose: Always the same.
    """

    id: int
    scene: str
    result: str
    options: Mapping[str, Any]
    objects: tuple[str, ...] | None = None
    faces: Mapping[str, Int32Array] | None = None
    camera: tuple[float, ...] | None = None
    bound: float = 1.0 / 512.0
    prepare: bool = False
    purpose: str = "rebake"


@dataclass(frozen=True, slots=True)
class Stop:
    """End the process."""


Job = BakeJob | SolveJob | TaskJob | RebakeJob


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
class RebakeLayout:
    """How the vertices of the values that follow are numbered: those of each object, shape (o + 1,).

    `moments` are those at which the engine began with the job and had read the scene, by `time.monotonic`.
    """

    id: int
    paths: tuple[str, ...]
    first_vertex: Int64Array
    moments: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class RebakeValues:
    """Values of a rebake under way: vertices, shape (n,) int32, and their AO, shape (n, columns) float32.

    `moment` is when they were sent, by `time.monotonic`.
    """

    id: int
    vertices: Int32Array
    ao: Float32Array
    rays_done: int
    rays_total: int
    final: bool
    moment: float = 0.0


@dataclass(frozen=True, slots=True)
class RebakeDone:
    """The result is committed; seconds until the values were final and stored. No report: it was only prepared for."""

    id: int
    report: RebakeReport | None
    seconds: tuple[float, float]


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


Reply = (
    Ready
    | Report
    | BakeDone
    | SolveDone
    | TaskDone
    | RebakeLayout
    | RebakeValues
    | RebakeDone
    | JobFailed
    | JobStopped
    | LogLine
)
