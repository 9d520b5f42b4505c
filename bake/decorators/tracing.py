"""What the stages here need of a tracer, so that they need not know one."""

from __future__ import annotations

from types import TracebackType
from typing import Protocol, Self

from bake.sphere_rays import SphereTracer
from bake.types import SampleSet, Tally


class SurfaceTracer(Protocol):
    """Sends rays from surface samples; see `bake.trace.Tracer`."""

    @property
    def batch_size(self) -> int: ...  # noqa: D102
    def accumulate(self, samples: SampleSet, batch: slice, tally: Tally) -> None: ...  # noqa: D102


class TreeTracer(SphereTracer, SurfaceTracer, Protocol):
    """Both, to be closed after use."""

    def __enter__(self) -> Self: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


def trace_samples(tracer: SurfaceTracer, samples: SampleSet, distance_count: int) -> Tally:
    """Traces all samples of a small set at once."""
    tally = Tally.empty(len(samples), distance_count)
    for batch in samples.batches(tracer.batch_size):
        tracer.accumulate(samples, batch, tally)
    return tally
