"""Spreads what a seed reaches over lines of sight, where the grid's own neighbours did not get there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.regions.free_space import FreeSpace
from bake.types import BoolArray, Float64Array, Int64Array

HELPERS = (0, 512)
"""Points strewn into a box besides its grid, in one attempt after the other."""

_TRIES = 8  # partners that an unreached point tries in a round
_CANDIDATES = 48  # reached points among which it looks for near ones
_SPEAKERS = 24  # points of a part that try for all of it
_ROUNDS = 8


@dataclass(slots=True)
class _Search:
    """One region's search.

    Attributes:
        region: Its number.
        points: Shape (n, 3): grid points, then helpers.
        label: Shape (n,): points of one label are known to be joined.
        reached: Shape (n,).
        fresh: Shape (n,): reached in the round before.
        wanted: Shape (n,): worth reaching; a point inside geometry is not.
    """

    region: int
    points: Float64Array
    label: Int64Array
    reached: BoolArray
    fresh: BoolArray
    wanted: BoolArray
    width: float

    def strew(self, minimum: Float64Array, maximum: Float64Array, grid: int, count: int) -> None:
        """Adds helpers, and looks at everything afresh.

        References:
            Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences": the sequence R3.
        """
        step = np.array([0.8191725133961645, 0.6710436067037893, 0.5497004779019703])
        share = (
            0.5 + step * np.arange(1 + len(self.points) - grid, 1 + len(self.points) - grid + count)[:, None]
        ) % 1.0
        self.points = np.concatenate([self.points, minimum + share * (maximum - minimum)])
        self.label = np.concatenate([self.label, self.label.max() + 1 + np.arange(count)])
        self.reached = np.concatenate([self.reached, np.zeros(count, np.bool_)])
        self.wanted = np.concatenate([self.wanted, np.ones(count, np.bool_)])
        self.fresh = self.reached.copy()

    def pairs(self, turn: int) -> tuple[Int64Array, Int64Array]:
        """Unreached points and the reached ones that they try: near ones and arbitrary ones, fresh ones if possible."""
        seekers = self._speakers(np.flatnonzero(self.wanted & ~self.reached), turn)
        known = np.flatnonzero(self.fresh)
        if len(seekers) == 0 or len(known) == 0:
            return np.zeros(0, np.int64), np.zeros(0, np.int64)
        some = known[np.linspace(0, len(known) - 1, min(len(known), _CANDIDATES)).astype(np.int64)]
        tries = min(_TRIES // 2, len(some))
        away = np.zeros((len(seekers), len(some)))
        for axis in range(3):  # an array less than over all axes at once
            away += (self.points[seekers, axis, None] - self.points[some, axis]) ** 2
        near = some[np.argpartition(away, tries - 1, axis=1)[:, :tries]]
        order = np.arange(len(seekers))[:, None] * 7919 + np.arange(_TRIES - tries) * 104729 + turn * 15485863
        partners = np.concatenate([near, known[order % len(known)]], axis=1)
        return np.repeat(seekers, partners.shape[1]), partners.ravel()

    def _speakers(self, points: Int64Array, turn: int) -> Int64Array:
        """Of points of the same part, a few, others in each round."""
        order = np.argsort(self.label[points], kind="stable")
        label = self.label[points[order]]
        first = np.searchsorted(label, label)
        size = np.searchsorted(label, label, side="right") - first
        place = (np.arange(len(label)) - first + turn) * _SPEAKERS
        return points[order[place % np.maximum(size, 1) < np.minimum(_SPEAKERS, size)]]

    def join(self, found: Int64Array) -> None:
        """Marks points, and all that share their labels, as reached."""
        labels = np.zeros(self.label.max() + 1, np.bool_)
        labels[self.label[found]] = True
        self.fresh = labels[self.label] & ~self.reached
        self.reached |= self.fresh


def spread(
    points: Float64Array,
    label: Int64Array,
    reached: BoolArray,
    wanted: BoolArray,
    minimum: Float64Array,
    maximum: Float64Array,
    free: FreeSpace,
    *,
    width: Float64Array,
) -> BoolArray:
    """Grid points reached by lines of sight, besides those reached already.

    Args:
        points: Shape (r, g, 3).
        label: Shape (r, g), small whole numbers: points of a region that share one are joined.
        reached, wanted: Shape (r, g).
        minimum, maximum: Shape (r, 3), the boxes.
        free: What blocks.
        width: Shape (r,), metres: how wide a line of sight must be.

    Returns:
        Shape (r, g).
    """
    grid = points.shape[1]
    reached = reached.copy()
    searches = [
        _Search(r, points[r], label[r], reached[r].copy(), reached[r].copy(), wanted[r], float(width[r]))
        for r in np.flatnonzero((wanted & ~reached).any(axis=1) & reached.any(axis=1)).tolist()
    ]
    for helpers in HELPERS:
        searches = [search for search in searches if (search.wanted & ~search.reached)[:grid].any()]
        if helpers:
            for search in searches:
                search.strew(minimum[search.region], maximum[search.region], grid, helpers)
        active = searches
        for turn in range(_ROUNDS):
            active = _round(active, turn, grid, free)
            if not active:
                break
        for search in searches:
            reached[search.region] = search.reached[:grid]
    return reached


def _round(searches: list[_Search], turn: int, grid: int, free: FreeSpace) -> list[_Search]:
    """Traces one round of all searches at once; returns those that found something and miss something still."""
    pairs = [search.pairs(turn) for search in searches]
    if not pairs:
        return []
    start = np.concatenate([search.points[a] for search, (a, _) in zip(searches, pairs, strict=True)])
    end = np.concatenate([search.points[b] for search, (_, b) in zip(searches, pairs, strict=True)])
    width = np.repeat([search.width for search in searches], [len(a) for a, _ in pairs])
    clear = free.clear(start, end, width=width)
    going: list[_Search] = []
    begin = 0
    for search, (seekers, _) in zip(searches, pairs, strict=True):
        search.join(seekers[clear[begin : begin + len(seekers)]])
        begin += len(seekers)
        if search.fresh.any() and (search.wanted & ~search.reached)[:grid].any():
            going.append(search)
    return going
