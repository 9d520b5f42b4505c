"""Densities of fog where boxes overlap: lowered, so that boxes in one place darken as one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bake.arrays import Float32Array, Float64Array, Int64Array

_PAIRS = 1 << 21  # pairs of boxes at a time


def without_overlap(minimum: Float32Array, maximum: Float32Array, density: Float32Array) -> Float32Array:
    """Densities divided by the number of boxes that share a box's space, on average over its volume.

    σᵢ' = σᵢ / (1 + Σⱼ vol(i ∩ j) / vol(i)), over all other boxes j that hold fog. n coincident boxes of one density
    thus darken exactly as one of them, and a box that touches no other keeps its density. This follows the idea of
    Sloan et al. 2013, section 2.1, who give no formula. Volumes multiply axis by axis as shares of the box's edge; an
    edge of length 0 counts as shared where the other box holds its coordinate.

    Args:
        minimum, maximum: Shape (n, 3), metres.
        density: Shape (n,), 1/m; boxes of density 0 lower no other.

    Returns:
        Shape (n,), 1/m, at most `density`.
    """
    holds = np.flatnonzero(density > 0.0)
    low, high = minimum[holds].astype(np.float64), maximum[holds].astype(np.float64)
    # Coincident boxes are common (a shrub of several meshes) and would make a quadratic number of pairs.
    boxes, of, counts = np.unique(np.concatenate([low, high], axis=1), axis=0, return_inverse=True, return_counts=True)
    low, high, of = boxes[:, :3], boxes[:, 3:], of.ravel()
    shared = (counts - 1).astype(np.float64)
    for first, second in _candidates(low, high):
        for i, j in ((first, second), (second, first)):
            shared += np.bincount(i, _shared(low, high, i, j) * counts[j], minlength=len(shared))
    lowered = density.copy()
    lowered[holds] = density[holds] / (1.0 + shared[of])
    return lowered


def _shared(low: Float64Array, high: Float64Array, i: Int64Array, j: Int64Array) -> Float64Array:
    """Share of box i's volume inside box j, shape (pairs,), in [0, 1]."""
    edge = high[i] - low[i]
    overlap = np.minimum(high[i], high[j]) - np.maximum(low[i], low[j])
    flat = edge == 0.0
    share = np.where(flat, overlap >= 0.0, np.maximum(overlap, 0.0) / np.where(flat, 1.0, edge))
    return share.prod(axis=1)


def _candidates(low: Float64Array, high: Float64Array) -> Iterator[tuple[Int64Array, Int64Array]]:
    """Every pair of boxes whose intervals meet on the axis where fewest do, each pair once; a sweep, in parts."""
    if len(low) < 2:
        return
    orders = [np.argsort(low[:, axis], kind="stable") for axis in range(3)]
    ends: list[Int64Array] = [
        np.searchsorted(low[order, axis], high[order, axis], side="right")
        for axis, order in zip(range(3), orders, strict=True)
    ]
    following: list[Int64Array] = [end - np.arange(1, len(low) + 1) for end in ends]
    axis = int(np.argmin([count.sum() for count in following]))
    order, count = orders[axis], np.maximum(following[axis], 0)
    before = np.concatenate([[0], np.cumsum(count)])
    begin = 0
    while begin < len(order):
        end = max(begin + 1, int(np.searchsorted(before, before[begin] + _PAIRS, side="right")) - 1)
        here = count[begin:end]
        first = np.repeat(np.arange(begin, end), here)
        second = first + 1 + np.arange(len(first)) - np.repeat(before[begin:end] - before[begin], here)
        yield order[first], order[second]
        begin = end
