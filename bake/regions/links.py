"""Which boxes meet, and where: pairs by a sweep, and the rectangle in which each pair's boundary must lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.types import Float64Array, Int32Array, Int64Array

TOLERANCE = 0.5
"""Metres between boxes that may still meet: rooms end at a wall, and a doorway leads through its thickness."""

_HELD = 0.9  # a box of which this share lies in another is held by it


@dataclass(frozen=True, slots=True)
class Sections:
    """Rectangles across which regions may meet; a pair may have several.

    Attributes:
        pair: Shape (s,), int64: number of the pair that each belongs to.
        minimum, maximum: Shape (s, 3): equal along the axis across which the rectangle lies.
        axis: Shape (s,), int64: that axis.
        gap: Shape (s,): how far the boxes lie apart along it, metres; 0 where they touch or overlap.
    """

    pair: Int64Array
    minimum: Float64Array
    maximum: Float64Array
    axis: Int64Array
    gap: Float64Array

    def __len__(self) -> int:
        return len(self.pair)


def meeting_pairs(minimum: Float64Array, maximum: Float64Array, *, tolerance: float = TOLERANCE) -> Int32Array:
    """Pairs a < b of boxes that overlap, touch, or lie at most `tolerance` apart, shape (p, 2), sorted.

    Boxes that meet at no more than an edge or a corner are no pair. A sweep along x: boxes are sorted by their lower
    end, and each is compared with those that begin before it ends.

    Args:
        minimum, maximum: Shape (r, 3).
        tolerance: Metres.
    """
    order = np.argsort(minimum[:, 0], kind="stable")
    low, high = minimum[order], maximum[order]
    last = np.searchsorted(low[:, 0], high[:, 0] + tolerance, side="right")
    number = np.arange(len(order))
    count = np.maximum(last - number - 1, 0)
    a = np.repeat(number, count)
    b = a + 1 + np.arange(len(a)) - np.repeat(np.cumsum(count) - count, count)
    shared = np.minimum(high[a], high[b]) - np.maximum(low[a], low[b])
    # One axis may fall short by the tolerance; along the other two the boxes share something.
    meets = (shared >= -tolerance).all(axis=1) & ((shared > 0.0).sum(axis=1) >= 2)
    pairs = np.sort(np.stack([order[a[meets]], order[b[meets]]], axis=1), axis=1)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].astype(np.int32)


def boundary_sections(minimum: Float64Array, maximum: Float64Array, pairs: Int32Array) -> Sections:
    """Where the boundary of each pair may lie.

    Boxes that overlap in part, touch or leave a gap: the middle of what they share, across its thinnest axis. A box
    that another holds: those of its sides that lie in the other.

    Args:
        minimum, maximum: Shape (r, 3).
        pairs: Shape (p, 2), as from `meeting_pairs`.
    """
    a, b = pairs[:, 0], pairs[:, 1]
    low, high = np.maximum(minimum[a], minimum[b]), np.minimum(maximum[a], maximum[b])
    shared = high - low
    volume = np.prod(np.maximum(shared, 0.0), axis=1)
    own = [np.prod(maximum[side] - minimum[side], axis=1) for side in (a, b)]
    held = volume >= _HELD * np.minimum(own[0], own[1])
    smaller = np.where(own[0] <= own[1], a, b)
    larger = np.where(own[0] <= own[1], b, a)

    simple = np.flatnonzero(~held)
    across = shared[simple].argmin(axis=1)
    found = [_across(low, high, simple, across, 0.5)]
    for axis in range(3):
        for side in (minimum, maximum):
            # On the side of the smaller box, if the larger goes on behind it.
            at = side[smaller, axis]
            inner = (minimum[larger, axis] < at) & (at < maximum[larger, axis])
            chosen = np.flatnonzero(held & inner)
            first, last = low[chosen].copy(), high[chosen].copy()
            first[:, axis] = last[:, axis] = at[chosen]
            found.append(Sections(chosen, first, last, np.full(len(chosen), axis), np.zeros(len(chosen))))
    return _together(found)


def other_sections(minimum: Float64Array, maximum: Float64Array, pairs: Int32Array) -> Sections:
    """More rectangles for pairs that overlap: across each axis in the middle, and at a quarter and three quarters.

    The boundary may be anywhere in what two boxes share, and its very middle may lie in a wall or in the ground.
    """
    a, b = pairs[:, 0], pairs[:, 1]
    low, high = np.maximum(minimum[a], minimum[b]), np.minimum(maximum[a], maximum[b])
    chosen = np.flatnonzero((high > low).all(axis=1))
    return _together(
        [_across(low, high, chosen, np.full(len(chosen), axis), at) for axis in range(3) for at in (0.5, 0.25, 0.75)]
    )


def _across(low: Float64Array, high: Float64Array, chosen: Int64Array, axis: Int64Array, at: float) -> Sections:
    """Sections of shared boxes across one axis each, at a share of the way."""
    row = np.arange(len(chosen))
    place = (1.0 - at) * low[chosen, axis] + at * high[chosen, axis]
    first, last = low[chosen].copy(), high[chosen].copy()
    first[row, axis] = last[row, axis] = place
    return Sections(chosen, first, last, axis, np.maximum(low[chosen, axis] - high[chosen, axis], 0.0))


def _together(found: list[Sections]) -> Sections:
    return Sections(
        np.concatenate([s.pair for s in found]),
        np.concatenate([s.minimum for s in found]),
        np.concatenate([s.maximum for s in found]),
        np.concatenate([s.axis for s in found]),
        np.concatenate([s.gap for s in found]),
    )
