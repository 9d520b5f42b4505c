"""Weights that grow until steps and slopes keep their bounds: iteratively reweighted least squares."""

from __future__ import annotations

import numpy as np

from bake.arrays import BoolArray, Float64Array

_REACHED = 1.05  # of the largest step: no more than this counts as reached
_HARDER, _SOFTER = 8.0, 0.5  # most by which a weight changes
_LEAST, _MOST = 1e-3, 1e4  # weights that steps begin and end with


class BoundWeights:
    """Weights of one distance, of places and of derivatives, that grow where a bound is not kept.

    Attributes:
        places: Shape (l, p).
        slopes: Shape (r, 6).

    Args:
        gentle: Shape (l, p): those of places that steps have at least.
        counts: Shape (l, p), bool: which rows are places.
        free: Shape (r, 6), bool: derivatives that may change, of regions that are linked.
    """

    def __init__(self, gentle: Float64Array, counts: BoolArray, free: BoolArray) -> None:
        self.places, self.slopes = gentle, np.zeros(free.shape)
        self._gentle, self._counts, self._free = gentle, counts, free

    def grow(self, steps: Float64Array, slopes: Float64Array, largest_step: float, largest_slope: float) -> bool:
        """By the square of how far each is beyond its bound, or back; returns whether any was."""
        steps, slopes = np.where(self._counts, steps, 0.0), np.where(self._free, slopes, 0.0)
        if steps.max() <= _REACHED * largest_step and slopes.max() <= _REACHED * largest_slope:
            return False
        self.places = np.maximum(_grown(self.places, steps / largest_step), self._gentle)
        self.slopes = _grown(self.slopes, slopes / largest_slope)
        return True


def _grown(weights: Float64Array, ratio: Float64Array) -> Float64Array:
    grown = np.minimum(np.maximum(weights, _LEAST) * np.clip(ratio**2, _SOFTER, _HARDER), _MOST)
    return np.where(grown > _LEAST, grown, 0.0)
