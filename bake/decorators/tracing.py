"""What the stages here need of a tracer, so that they need not know one."""

from __future__ import annotations

from types import TracebackType
from typing import Protocol, Self

from bake.types import Float32Array, SampleSet, Tally, UInt16Array, UInt32Array


class SphereCounts(Protocol):
    """What the rays around some points found; `bake.trace.SphereTally` fits.

    Attributes:
        sh: Shape (n, 9, k), float32: (4π/N) Σ ρ Y over N directions.
        hits, back_faces: Shape (n,), uint16, as in `Tally`.
    """

    @property
    def sh(self) -> Float32Array: ...  # noqa: D102
    @property
    def hits(self) -> UInt16Array: ...  # noqa: D102
    @property
    def back_faces(self) -> UInt16Array: ...  # noqa: D102


class SphereTracer(Protocol):
    """Sends rays in all directions from points."""

    def gather_sphere(self, points: Float32Array, seeds: UInt32Array, directions: int) -> SphereCounts:
        """Points, shape (n, 3), are relative to `World.origin`; each seed, shape (n,), scrambles its directions."""
        ...


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
