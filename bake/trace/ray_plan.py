"""What one more ray is worth: the rules by which adaptive rays end.

More rays lower the error of vertex values in two ways. They lower the noise of what is averaged: with
V(n) = V(4) (4/n)^(3/2), as scrambled nets behave at silhouettes (Mitchell 1996), twice the rays of a sample of
importance w (bake/solve/importance.py) take 0.65 c w V(n) off the mean square error; c is 1 for weighted averages and
what the fit passes on of a sample's noise for least squares. And they settle whether the sample is kept at all: as long
as it is valid with probability p, keeping or dropping it is as good as noise of variance D² p (1 - p), D being what AO
differs by between a place and what the vertex has without it. On real levels that second part is most of the error. A
sample goes on as long as either, together, is worth its price:

    w (0.65 c p V(n) + D² p (1 - p) / 2) > λ n.

λ is set so that the estimated error falls to the bound asked for, each doubling settling half of the doubt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from bake.types import BoolArray, Float64Array, Int64Array

PILOT = 4
"""Rays that every sample sends."""

NEIGHBOURS = 16
"""Samples on either side, in the order of the scene's faces, that a sample's estimates come from."""

_LEAST_VARIANCE = 0.02  # of the scene's mean: thirty-two neighbours may have missed what the sample sees
_RATE = 1.5
_NOISE_GAIN = 1.0 - 2.0**-_RATE
_DOUBT_GAIN = 0.5
_APART = 0.3  # D²
_PRIOR_RAYS = 0.5  # how many rays of its own the back faces around a sample count for
_EVEN = 0.3  # the share of back faces is surer than by chance by hits^-0.3, measured: its rays are spread evenly
_BURIED = 3.0  # standard deviations over the back-face threshold
_CLEAR = 0.02  # share of back faces around a sample that says nothing

_OCTAVE, _STEPS = 64, 64 * 200  # prices are told apart by the 64th part of an octave, down to 2^-200

FIT_GAIN = 3.2
"""How much more noise variance a least squares fit passes to the vertices than a weighted average does: 2.8 to 3.8,
measured on patches of four levels."""

Rows = Int64Array | slice
_ALL = slice(None)


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


class RayWorth:
    """What more rays of each sample are worth, from the first rays of its neighbours.

    Never from its own: stopping where one's own rays agree would make the mean wrong (a sample with a hit in thirty
    would mostly end at 1). Only the back-face rule looks at a sample's own rays.

    Attributes:
        variance: Shape (n,), float64: of the mean of `PILOT` rays as mapped, mean of all distances, by the neighbours'.
        unreachable: Shape (n,), bool: all rays of the neighbours went free.
    """

    def __init__(self, pilot: Pilot, threshold: float, passed_on: float = 1.0) -> None:
        """From the pilot.

        Args:
            pilot: Of samples in the order of the scene's faces.
            threshold: Share of back faces above which a sample is dropped.
            passed_on: What the mapping makes of the samples' noise, as variance: 1 for weighted averages.
        """
        self._threshold = threshold
        around = of_neighbours(np.column_stack([pilot.variance, pilot.hits, pilot.back_faces]))
        hits, backs = around[:, -2], around[:, -1]
        self.unreachable: BoolArray = hits == 0.0
        self._prior = _PRIOR_RAYS * np.minimum(hits / PILOT, 1.0)
        self._share = backs / np.maximum(hits, 1e-9)
        sure = self.chance_valid(pilot.hits, pilot.back_faces)
        mean = np.maximum(sure @ pilot.variance / max(float(sure.sum()), 1e-9), 1e-12)
        variance = passed_on * (around[:, :-2] + _LEAST_VARIANCE * mean).mean(axis=1)
        self.variance: Float64Array = np.where(self.unreachable, 0.0, variance)

    def chance_valid(self, hits: Float64Array, backs: Float64Array, rows: Rows = _ALL) -> Float64Array:
        """How likely some samples are to be valid in the end, shape (m,), given the rays that they sent so far."""
        limit = self._threshold
        if limit >= 1.0:
            return np.ones(len(hits))
        prior, around = self._prior[rows], self._share[rows]
        seen = hits + prior
        share = (backs + prior * around) / np.maximum(seen, 1e-9)
        chance = np.sqrt(max(limit * (1.0 - limit), 1e-4) / np.maximum(seen, 1e-9))
        valid = ndtr((limit - share) / (chance * (np.maximum(seen, 1.0) ** -_EVEN)))
        # No back face so far, and none around: the prior alone says nothing.
        return np.where((backs == 0.0) & (around < _CLEAR), 1.0, valid)

    def noise(self, rays: float | Float64Array, rows: Rows = _ALL) -> Float64Array:
        """Variance of the mean of so many rays of some samples as mapped, mean of all distances, shape (m,)."""
        return self.variance[rows] * (rays / PILOT) ** -_RATE

    @staticmethod
    def doubt(valid: Float64Array) -> Float64Array:
        """The same for the doubt whether the sample is valid, shape (n,)."""
        return _APART * valid * (1.0 - valid)

    def gain(
        self, valid: Float64Array, rays: float | Float64Array, rows: Rows = _ALL
    ) -> tuple[Float64Array, Float64Array]:
        """What doubling so many rays takes off noise and doubt of some samples, shape (m,) each."""
        return _NOISE_GAIN * valid * self.noise(rays, rows), _DOUBT_GAIN * self.doubt(valid)

    def errors(
        self, weight: Float64Array, valid: Float64Array, rays: Float64Array | float, rows: Rows = _ALL
    ) -> tuple[float, float]:
        """Estimated root mean square errors of values over the surface, all distances together: by noise, by doubt.

        Args:
            weight: Shape (m,): importance of some samples.
            valid: Shape (m,): chances.
            rays: Shape (m,): sent so far.
            rows: Which samples.
        """
        return float(np.sqrt(weight @ (valid * self.noise(rays, rows)))), float(np.sqrt(weight @ self.doubt(valid)))

    def price_for(self, weight: Float64Array, valid: Float64Array, bound: float, most: int, rows: Rows = _ALL) -> float:
        """The price of a ray, λ, at which the estimated error falls to `bound`, within 1 %; 0 if it never does.

        The doubt that would be left if every sample sent all of its rays is no part of it.

        Args:
            weight: Shape (m,): importance of the samples that may go on.
            valid: Shape (m,): chances.
            bound: Root mean square error of values over the surface.
            most: Most rays of a sample.
            rows: Which samples.
        """
        by_noise, by_doubt = self.errors(weight, valid, float(PILOT), rows)
        settled = 1.0 - _DOUBT_GAIN ** np.log2(most / PILOT)
        excess = by_noise**2 + by_doubt**2 * settled - bound**2
        if excess <= 0.0:
            return np.inf
        noise, doubt = (weight * part for part in self.gain(valid, PILOT, rows))
        reached = np.zeros(_STEPS)
        for doublings in range(round(np.log2(most / PILOT))):
            gain = noise * 2.0 ** (-_RATE * doublings) + doubt * _DOUBT_GAIN**doublings
            price = gain / (PILOT * 2**doublings)
            step = np.clip(-_OCTAVE * np.log2(np.maximum(price, 1e-300)), 0, _STEPS - 1).astype(np.int64)
            reached += np.bincount(step, gain, _STEPS)
        needed = int(np.count_nonzero(np.cumsum(reached) < excess))
        return float(2.0 ** (-(needed + 1) / _OCTAVE)) if needed < _STEPS else 0.0


def buried(hits: Float64Array, backs: Float64Array, threshold: float) -> BoolArray:
    """Samples that are behind faces beyond doubt, by their own rays alone, shape (n,)."""
    return backs - threshold * hits > _BURIED * np.sqrt(threshold * (1.0 - threshold) * hits)


def of_neighbours(values: Float64Array) -> Float64Array:
    """Means over the samples before and behind each in the list, itself left out, shape (n, c); 0 for a lone one."""
    count = len(values)
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    begin = np.maximum(np.arange(count) - NEIGHBOURS, 0)
    end = np.minimum(np.arange(count) + NEIGHBOURS + 1, count)
    means = (sums[end] - sums[begin] - values) / np.maximum(end - begin - 1, 1)[:, None]
    return np.where(means < 1e-9, 0.0, means)
