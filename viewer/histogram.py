"""How the values of a surface are distributed, by area, for the range control."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.types import Float32Array, Float64Array, Int32Array

_BLOCK = 1 << 15


@dataclass(frozen=True, slots=True)
class Histogram:
    """Shares of the surface by value.

    Attributes:
        shares: Shape (bins,), float64: share of the counted area in each bin; sums to 1 or, if empty, 0.
        low, high: Values at the two ends.
        mean: Area-weighted mean; NaN if empty.
        minimum, maximum: Extremes of the values; NaN if empty.
    """

    shares: Float64Array
    low: float
    high: float
    mean: float
    minimum: float
    maximum: float

    @property
    def is_empty(self) -> bool:
        """Whether there was no value at all."""
        return bool(np.isnan(self.mean))


def vertex_areas(positions: Float64Array, faces: Int32Array) -> Float64Array:
    """A third of the area of every face at each vertex, shape (n,), float64, m²; 0 at unreferenced vertices."""
    a, b, c = (positions[faces[:, corner]] for corner in range(3))
    third = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    areas = np.zeros(len(positions))
    for corner in range(3):
        areas += np.bincount(faces[:, corner], weights=third, minlength=len(positions))
    return areas


def histogram_of(
    values: Float32Array, weights: Float64Array | None, low: float, high: float, bins: int = 128
) -> Histogram:
    """The distribution of finite values.

    Args:
        values: Shape (n,); NaN is left out; what lies outside is counted in the end bins.
        weights: Shape (n,), e.g. vertex areas; None counts each value once, which is much quicker.
        low, high: Values at the two ends of the bins.
        bins: Number of bins.
    """
    if weights is None:
        return _counted(np.asarray(values, np.float32), low, high, bins)
    known = np.isfinite(values) & (weights > 0.0)
    counted, weights = values[known].astype(np.float64), weights[known]
    total = weights.sum()
    if not total > 0.0:
        return Histogram(np.zeros(bins), low, high, np.nan, np.nan, np.nan)
    index = np.clip((counted - low) / max(high - low, 1e-12) * bins, 0, bins - 1).astype(np.int64)
    shares = np.bincount(index, weights=weights, minlength=bins) / total
    mean = float((counted * weights).sum() / total)
    return Histogram(shares, low, high, mean, float(counted.min()), float(counted.max()))


def _counted(values: Float32Array, low: float, high: float, bins: int) -> Histogram:
    counts, total, number = np.zeros(bins, np.int64), 0.0, 0
    least, most = np.float32(np.inf), np.float32(-np.inf)
    scale = np.float32(bins / max(high - low, 1e-12))
    for begin in range(0, len(values), _BLOCK):  # a block stays in the processor's cache from step to step
        part = values[begin : begin + _BLOCK]
        known = np.isfinite(part)
        if not known.all():
            part = part[known]
        if not len(part):
            continue
        number += len(part)
        total += float(part.sum(dtype=np.float64))
        least, most = min(least, part.min()), max(most, part.max())
        index = (part - np.float32(low)) * scale
        np.clip(index, 0.0, bins - 1.0, out=index)
        counts += np.bincount(index.astype(np.int32), minlength=bins)
    if not number:
        return Histogram(np.zeros(bins), low, high, np.nan, np.nan, np.nan)
    return Histogram(counts / number, low, high, total / number, float(least), float(most))


def clipped_shares(values: Float32Array, weights: Float64Array | None, low: float, high: float) -> tuple[float, float]:
    """Shares of the area, or without weights of the values, that lie below `low` and above `high`."""
    if weights is None:
        finite = np.isfinite(values)
        count = max(int(np.count_nonzero(finite)), 1)
        outside = (np.count_nonzero(finite & side) for side in (values < low, values > high))
        below, above = (number / count for number in outside)
        return below, above
    known = np.isfinite(values)
    total = float(weights[known].sum())
    if not total > 0.0:
        return 0.0, 0.0
    below = float(weights[known & (values < low)].sum()) / total
    above = float(weights[known & (values > high)].sum()) / total
    return below, above


def robust_range(values: Float32Array, weights: Float64Array, drop: float = 0.001) -> tuple[float, float]:
    """The range that leaves out a share `drop` of the area at each end; (0, 1) without any value.

    A range of no width is widened by a thousandth, so that it can always be drawn.
    """
    known = np.isfinite(values) & (weights > 0.0)
    if not known.any():
        return 0.0, 1.0
    order = np.argsort(values[known], kind="stable")
    ordered = values[known][order].astype(np.float64)
    position = np.cumsum(weights[known][order])
    position /= position[-1]
    last = len(ordered) - 1
    low = float(ordered[min(int(np.searchsorted(position, drop, side="right")), last)])
    high = float(ordered[min(int(np.searchsorted(position, 1.0 - drop, side="left")), last)])
    return (low, high) if high - low >= 1e-3 else (low - 5e-4, high + 5e-4)
