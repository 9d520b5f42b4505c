"""Adaptive rays: a few of every sample first, then more where they lower the error of the values at vertices most.

Every sample sends its first 4 rays, in two halves. Half the difference of the halves, squared, estimates the variance
of their mean; smoothed over neighbouring samples it decides how many more of its `rays` each sends, in blocks that
double what it has: prefixes of its own scrambled Sobol sequence, each as well spread as the whole. After each block it
is asked again who goes on (bake/trace/ray_plan.py): what is invalid beyond doubt ends, and its share of the vertices'
weight falls to the others; where validity is open rays go on until it is not worth them any more.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace

import numpy as np

from bake.settings import BakeSettings, MappingKind
from bake.trace.base import Tracer
from bake.trace.ray_plan import FIT_GAIN, PILOT, Pilot, RayWorth, buried
from bake.types import BoolArray, Float32Array, Float64Array, Int64Array, Progress, SampleSet, Tally

__all__ = ["PILOT", "Importance", "RayPasses", "RayPlan", "trace_adaptively"]

Importance = Callable[[Float64Array, Int64Array], Float64Array]
"""Tells what some samples weigh in the vertices, shape (m,), from the chance of each of all to be valid, shape (n,)."""


@dataclass(frozen=True, slots=True)
class RayPlan:
    """How many rays each sample sent, and why no more.

    Attributes:
        rays: Shape (n,), int64: the pilot's, doubled some times.
        buried: Samples behind faces beyond doubt, found by the pilot; they sent no more.
        unreachable: Samples whose neighbours' rays all went free, and that sent no more either.
        settling: Rays sent only because validity was open.
        noise: Estimated root mean square error of values over the surface by noise, all distances together.
        doubt: The same by samples that may be wrongly kept or dropped.
    """

    rays: Int64Array
    buried: BoolArray
    unreachable: BoolArray
    settling: int
    noise: float
    doubt: float


def trace_adaptively(
    tracer: Tracer, samples: SampleSet, importance: Importance, settings: BakeSettings
) -> Generator[Progress, None, tuple[Tally, RayPlan]]:
    """Traces every sample with as many rays as it is worth; see above. `Tally.rays` tells how many that are.

    A sample that sends all of its rays gets what a bake without adaptive rays gives it, but for rounding in the sum.

    Args:
        tracer: Over the samples' world.
        samples: Of n samples, in the order of their faces.
        importance: See there.
        settings: `adaptive_error` is a number.
    """
    bound = settings.adaptive_error
    assert bound is not None, "rays are to be adapted"
    runner = RayPasses(tracer, samples, settings)
    every = np.arange(len(samples))
    yield from runner.run(every, 0, PILOT // 2)
    first = runner.mean(PILOT // 2)
    yield from runner.run(every, PILOT // 2, PILOT // 2)
    variance = (runner.mean(PILOT).astype(np.float64) - first) ** 2
    hits, backs = runner.found(every)
    passed_on = FIT_GAIN if settings.mapping is MappingKind.LEAST_SQUARES else 1.0
    worth = RayWorth(Pilot(variance, hits, backs), settings.back_face_threshold, passed_on)
    del first, variance
    valid = worth.chance_valid(hits, backs)
    inside = buried(hits, backs, settings.back_face_threshold)
    going = np.flatnonzero(~inside)
    weight = importance(valid, going)
    price = worth.price_for(weight, valid[going], bound, settings.rays, going)

    rays = np.full(len(samples), PILOT, np.int64)
    sent, settling = PILOT, 0
    while sent < settings.rays:
        noise, doubt = worth.gain(valid[going], sent, going)
        on = weight * (noise + doubt) > price * sent
        if not on.any():
            break
        settling += sent * int(np.count_nonzero(on & (weight * noise <= price * sent)))
        going = going[on]
        rays[going] = 2 * sent
        runner.total = int(rays.sum())
        yield from runner.run(going, sent, sent)
        sent *= 2
        valid[going] = worth.chance_valid(*runner.found(going), going)
        weight = importance(valid, going)
    ao = np.clip(runner.ao / rays[:, None].astype(np.float32), 0.0, 1.0)
    counts = [values.astype(np.uint16) for values in (rays, runner.hits, runner.back_faces)]
    ended = rays == PILOT
    kept = np.flatnonzero(~inside)
    errors = worth.errors(importance(valid, kept), valid[kept], rays[kept].astype(np.float64), kept)
    return Tally(ao, *counts), RayPlan(rays, inside, worth.unreachable & ~inside & ended, settling, *errors)


class RayPasses:
    """Traces blocks of the samples' rays and adds up what they find.

    Attributes:
        ao: Shape (n, k), float32: sums over rays.
        hits, back_faces: Shape (n,), int32.
        total: Rays that will be traced, as far as known.
    """

    def __init__(self, tracer: Tracer, samples: SampleSet, settings: BakeSettings) -> None:
        self._tracer, self._samples, self._settings = tracer, samples, settings
        self.ao: Float32Array = np.zeros((len(samples), settings.distance_count), np.float32)
        self.hits, self.back_faces = np.zeros(len(samples), np.int32), np.zeros(len(samples), np.int32)
        self.total, self._done, self._begin = len(samples) * settings.rays, 0, time.perf_counter()

    def run(self, rows: Int64Array, first: int, count: int) -> Generator[Progress]:
        """Sends rays `first` to `first + count` of some samples; `first` is a multiple of `count`."""
        if not len(rows):
            return
        some = self._samples.only(rows)
        # Blocks of `count` rays are numbered through each sample's block of all of its rays.
        index = some.index.astype(np.int64) * (self._settings.rays // count) + first // count
        some = replace(some, index=index.astype(np.int32))
        tally = Tally.empty(len(rows), self._settings.distance_count)
        for batch in some.batches(self._tracer.batch_size * max(1, self._settings.rays // count)):
            self._tracer.accumulate(some, batch, tally, rays=count)
            self._done += (batch.stop - batch.start) * count
            seconds = time.perf_counter() - self._begin
            yield Progress("trace", self._done, self.total, seconds, self._done / max(seconds, 1e-9))
        self.ao[rows] += tally.ao * np.float32(count)
        self.hits[rows] += tally.hits
        self.back_faces[rows] += tally.back_faces

    def found(self, rows: Int64Array) -> tuple[Float64Array, Float64Array]:
        """Hits and back faces of some samples so far, shape (m,) each."""
        return self.hits[rows].astype(np.float64), self.back_faces[rows].astype(np.float64)

    def mean(self, rays: int) -> Float32Array:
        """Means where every sample has sent so many rays."""
        return self.ao / np.float32(rays)
