"""Adaptive rays: a few of every sample first, then more where they lower the error of the values at vertices most.

Every sample sends its first 8 rays, in two halves. Half the difference of the halves, squared, estimates the variance
of their mean; smoothed over neighbouring samples it decides how many more of its `rays` each sends, in blocks that
double what it has: prefixes of its own scrambled Sobol sequence, each as well spread as the whole.

A sample's number of rays depends on what its neighbours found, never on what it found itself: stopping where one's own
rays agree would make the mean wrong (a sample with a hit in thirty would mostly end at 1). Only the back-face rule
looks at a sample's own rays: what lies behind a wall beyond doubt is invalid however many rays follow, and where the
share of back faces is near the threshold rays go on until it is not, because a sample wrongly kept or thrown away costs
more than all noise.

With V_s(n) = V_s(8) (8/n)^(3/2), as scrambled nets behave at silhouettes (Mitchell 1996), and w_s the importance of a
sample (bake/solve/importance.py), the fewest rays for a mean square error Σ w_s V_s(n_s) are n_s ∝ (w_s V_s)^(2/5).
"""

from __future__ import annotations

import time
from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from bake.settings import BakeSettings
from bake.trace.base import Tracer
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array, Progress, SampleSet, Tally

PILOT = 8
"""Rays that every sample sends."""

NEIGHBOURS = 16
"""Samples on either side, in the order of the scene's faces, that a sample's estimate comes from."""

_LEAST_VARIANCE = 0.1  # of the scene's mean: sixteen neighbours may have missed what the sample sees
_RATE = 1.5
_BURIED = 3.0  # standard deviations over the back-face threshold
_UNDECIDED = 2.0  # standard deviations within which a sample may be valid or not
_EXPOSED = 0.05  # share of back faces among neighbours' hits
_HALVINGS = 16


@dataclass(frozen=True, slots=True)
class Pilot:
    """What the first rays of all samples found.

    Attributes:
        variance: Shape (n, k), float64: of the mean of a sample's first rays, from its own halves.
        hits, back_faces: Shape (n,), float64.
    """

    variance: Float64Array
    hits: Float64Array
    back_faces: Float64Array


@dataclass(frozen=True, slots=True)
class RayPlan:
    """How many rays each sample sends.

    Attributes:
        rays: Shape (n,), int64: the pilot's, doubled some times.
        buried: Samples behind faces beyond doubt; they send no more.
        unreachable: Samples whose neighbours' rays all went free; neither do they.
        exposed: Samples whose neighbours see backs of faces.
        error: Shape (k,), float64: estimated root mean square error of values over the surface.
    """

    rays: Int64Array
    buried: BoolArray
    unreachable: BoolArray
    exposed: BoolArray
    error: Float64Array


def plan_rays(pilot: Pilot, importance: Float64Array, settings: BakeSettings) -> RayPlan:
    """The fewest rays by which the estimated error of every distance falls to `settings.adaptive_error`, or all.

    Args:
        pilot: Of n samples, in the order of their faces.
        importance: Shape (n,), float64.
        settings: `adaptive_error` is a number.
    """
    bound = settings.adaptive_error
    assert bound is not None, "rays are to be adapted"
    hits, backs, threshold = pilot.hits, pilot.back_faces, settings.back_face_threshold
    buried = backs - threshold * hits > _BURIED * np.sqrt(threshold * (1.0 - threshold) * hits)
    around = _of_neighbours(np.column_stack([pilot.variance, hits, backs]))
    variance, unreachable = around[:, :-2], around[:, -2] == 0.0
    exposed = around[:, -1] > _EXPOSED * around[:, -2]
    mean = np.maximum(pilot.variance[~buried].mean(axis=0), 1e-12) if (~buried).any() else np.ones(variance.shape[1])
    variance = np.where(unreachable[:, None], 0.0, variance + _LEAST_VARIANCE * mean)
    weight = np.where(buried, 0.0, importance)
    wanted = (variance / mean).mean(axis=1) * weight
    doublings = np.log2(np.maximum(wanted, 1e-300)) / (1.0 + _RATE)
    most = np.log2(settings.rays / PILOT)

    def plan(more: float) -> tuple[Float64Array, Float64Array]:
        steps: Float64Array = np.clip(np.rint(doublings + more), 0.0, most)
        return steps, np.sqrt((weight * np.exp2(-_RATE * steps)) @ variance)

    high = most - float(doublings[wanted > 0.0].min(initial=0.0))
    low = -float(doublings.max(initial=0.0))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if (plan(middle)[1] <= bound).all() else (middle, high)
    steps, error = plan(high)
    return RayPlan((PILOT * np.exp2(steps)).astype(np.int64), buried, unreachable & ~buried, exposed, error)


def trace_adaptively(
    tracer: Tracer, samples: SampleSet, importance: Float64Array, settings: BakeSettings
) -> Generator[Progress, None, tuple[Tally, RayPlan]]:
    """Traces every sample with as many rays as it needs; see above. `Tally.rays` tells how many that are.

    A sample that sends all of its rays gets what a bake without adaptive rays gives it, but for rounding in the sum.
    """
    runner = RayPasses(tracer, samples, settings)
    every = np.arange(len(samples))
    yield from runner.run(every, 0, PILOT // 2)
    first = runner.mean(PILOT // 2)
    yield from runner.run(every, PILOT // 2, PILOT // 2)
    pilot = Pilot(
        (runner.mean(PILOT).astype(np.float64) - first) ** 2,
        runner.hits.astype(np.float64),
        runner.back_faces.astype(np.float64),
    )
    del first
    plan = plan_rays(pilot, importance, settings)
    runner.total = int(plan.rays.sum())
    sent = PILOT
    while sent < settings.rays:
        going = plan.rays > sent
        going |= (plan.rays == sent) & _undecided(
            runner.hits, runner.back_faces, plan.exposed, settings.back_face_threshold
        )
        plan.rays[going] = np.maximum(plan.rays[going], 2 * sent)
        yield from runner.run(np.flatnonzero(going), sent, sent)
        sent *= 2
    ao = np.clip(runner.ao / plan.rays[:, None].astype(np.float32), 0.0, 1.0)
    counts = [values.astype(np.uint16) for values in (plan.rays, runner.hits, runner.back_faces)]
    return Tally(ao, *counts), plan


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

    def mean(self, rays: int) -> Float32Array:
        """Means where every sample has sent so many rays."""
        return self.ao / np.float32(rays)


def _undecided(hits: Int32Array, back_faces: Int32Array, exposed: BoolArray, threshold: float) -> BoolArray:
    """Samples that more rays may yet find valid or invalid, shape (n,)."""
    doubt = _UNDECIDED * np.sqrt(threshold * (1.0 - threshold) * np.maximum(hits, 1))
    return ((back_faces > 0) | exposed) & (threshold < 1.0) & (np.abs(back_faces - threshold * hits) < doubt)


def _of_neighbours(values: Float64Array) -> Float64Array:
    """Means over the samples before and behind each in the list, itself left out, shape (n, c); 0 for a lone one."""
    count = len(values)
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    begin = np.maximum(np.arange(count) - NEIGHBOURS, 0)
    end = np.minimum(np.arange(count) + NEIGHBOURS + 1, count)
    means = (sums[end] - sums[begin] - values) / np.maximum(end - begin - 1, 1)[:, None]
    return np.where(means < 1e-9, 0.0, means)
