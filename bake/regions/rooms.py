"""Merges cells of floor into rectangles as large as rooms: greedily, the roomiest place first.

A rectangle grows from its middle in all four directions, a row of cells at a time. It stops at walls and doorways, for
there most cells of the next row are missing; it passes furniture and follows diagonal walls, for there most are not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import label as connected_label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bake.regions.walkable import Walkable
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array

HEAD = 2.5
"""Metres above the floor up to which objects are lit by regions; or up to the ceiling."""

_FREE_SHARE = 0.6  # of a new row that must be floor
_FRESH_SHARE = 0.5  # of that floor that no other rectangle has yet
_COLLAR = 0.6  # metres that a rectangle reaches beyond, into doorways
_RISE = 0.25  # of the longest edge: how much a rectangle's floor may rise
_SMALLEST = 1 / 144  # of the longest edge squared: floor that is nobody else's
_FAILURES = 64  # starts in vain after which small remnants are sorted out


@dataclass(frozen=True, slots=True)
class Rooms:
    """Boxes in (u, v, height).

    Attributes:
        low, high: Shape (r, 3), metres.
        seed: Shape (r, 3): in the air over the cell from which each grew.
        fresh: Shape (r,): cells of floor that each was the first to cover.
        covered: Shape (n,), bool: cells in the part of a box that is joined to its first cell.
    """

    low: Float64Array
    high: Float64Array
    seed: Float64Array
    fresh: Int64Array
    covered: BoolArray


def merge_cells(space: Walkable, longest: float) -> Rooms:
    """Covers the air over a level's floor with boxes.

    Args:
        space: Which cells.
        longest: Longest edge of a box in plan, metres.
    """
    floors = space.floors
    most = max(2, int(longest / floors.plan.cell))
    distance = _distance_to_wall(space, most // 2)
    tile = 0.5 + np.abs(floors.column // floors.plan.shape[1] % most - most // 2)
    tile += np.abs(floors.column % floors.plan.shape[1] % most - most // 2)
    order = np.flatnonzero(space.air)
    order = order[np.lexsort((tile[order], -distance[order]))]
    growing = _Growing(space, most, max(2.0, _RISE * longest))
    smallest = max(1, round(_SMALLEST * (longest / floors.plan.cell) ** 2))
    low: list[Float64Array] = []
    high: list[Float64Array] = []
    seed: list[Float64Array] = []
    fresh: list[int] = []
    bodies = floors.bodies(1.2)
    failures = 0
    for start in order.tolist():
        if growing.tried[start]:
            continue
        box = growing.grow(start)
        count = growing.cover(start, smallest)
        failures += count == 0
        if failures >= _FAILURES:
            growing.give_up_remnants(smallest)
            failures = 0
        if count:
            low.append(box[0])
            high.append(box[1])
            seed.append(bodies[start])
            fresh.append(count)
    shape = (-1, 3)
    return Rooms(
        np.array(low).reshape(shape),
        np.array(high).reshape(shape),
        np.array(seed).reshape(shape),
        np.array(fresh, np.int64),
        growing.covered,
    )


class _Growing:
    """The state that rectangles share, and the one that is growing.

    Attributes:
        tried: Shape (n,), bool: cells from which no other rectangle need start.
        covered: Shape (n,), bool.
    """

    def __init__(self, space: Walkable, most: int, rise: float) -> None:
        self.tried = np.zeros(len(space.floors), np.bool_)
        self.covered = np.zeros(len(space.floors), np.bool_)
        self._space = space
        self._most, self._rise = most, rise
        self._collar = max(1, round(_COLLAR / space.floors.plan.cell))
        self._cells = np.zeros((0, 0), np.int64)

    def grow(self, start: int) -> tuple[Float64Array, Float64Array]:
        """Grows a rectangle around a cell; returns its box."""
        for reach in (self._most // 4, self._most):  # most are small: the large raster is seldom needed
            window = _Window(self._space, start, reach + self._collar, self._rise, self.covered)
            window.grow(self._most)
            if max(window.last[axis] - window.first[axis] for axis in (0, 1)) < reach:
                break
        window.reach_out(self._collar)
        self._cells = window.joined()
        floors = self._space.floors
        floor = floors.floor[self._cells]
        top = np.minimum(floor + HEAD, floors.ceiling[self._cells])
        plan = floors.plan
        corner = np.array([window.i + window.first[0], window.j + window.first[1]])
        size = np.array([window.last[0] - window.first[0] + 1, window.last[1] - window.first[1] + 1])
        # Half a cell more: free space goes on up to the wall, and neighbours shall overlap.
        low, high = plan.low + (corner - 0.5) * plan.cell, plan.low + (corner + size + 0.5) * plan.cell
        return np.append(low, floor.min()), np.append(high, top.max())

    def give_up_remnants(self, smallest: int) -> None:
        """Marks connected floor of nobody's as tried where there is too little of it."""
        floors = self._space.floors
        left = np.flatnonzero(self._space.air & ~self.covered & ~self.tried)
        number = np.full(len(floors), -1, np.int64)
        number[left] = np.arange(len(left))
        ends: list[Int64Array] = []
        for side in (0, 2):
            other = floors.beside[left, side]
            other = np.where(other >= 0, number[other], -1)
            ends.append(np.stack([np.flatnonzero(other >= 0), other[other >= 0]]))
        a, b = np.concatenate(ends, axis=1)
        graph = coo_array((np.ones(len(a), np.int8), (a, b)), shape=(len(left), len(left)))
        label: Int32Array = connected_components(graph, directed=False)[1]
        self.tried[left[np.bincount(label)[label] < smallest]] = True

    def cover(self, start: int, smallest: int) -> int:
        """Keeps the rectangle, unless it has too little floor of its own; returns how many cells that is."""
        fresh = self._cells[~self.covered[self._cells]]
        self.tried[fresh] = True
        self.tried[start] = True
        if len(fresh) < smallest:
            return 0
        self.covered[fresh] = True
        return len(fresh)


class _Window:
    """The plan around a cell, as a raster of the cells nearest to its height.

    Attributes:
        i, j: Column of the raster's corner.
        first, last: Corners of the rectangle in the raster, both in it.
    """

    def __init__(self, space: Walkable, start: int, reach: int, rise: float, covered: BoolArray) -> None:
        floors = space.floors
        plan = floors.plan
        own = int(floors.column[start])
        at = (own // plan.shape[1], own % plan.shape[1])
        self.i, self.j = max(at[0] - reach, 0), max(at[1] - reach, 0)
        end_i, end_j = min(at[0] + reach + 1, plan.shape[0]), min(at[1] + reach + 1, plan.shape[1])
        column = np.arange(self.i, end_i)[:, None] * plan.shape[1] + np.arange(self.j, end_j)
        height = floors.floor[start]
        self._cell = np.full(column.shape, -1, np.int64)
        closest = np.full(column.shape, rise)
        candidate, end = floors.first[column], floors.first[column + 1]
        for k in range(int((end - candidate).max())):
            here = np.where(candidate + k < end, candidate + k, start)
            away = np.abs(floors.floor[here] - height)
            nearer = (candidate + k < end) & (away < closest) & space.air[here]
            self._cell[nearer], closest[nearer] = here[nearer], away[nearer]
        self._start = (at[0] - self.i, at[1] - self.j)
        free = self._cell >= 0
        self._floor = np.where(free, floors.floor[np.maximum(self._cell, 0)], height)
        self._free = free
        self._fresh = free & ~covered[np.maximum(self._cell, 0)]
        self._free_sum, self._fresh_sum = _integral(free), _integral(self._fresh)
        self._rise = rise
        self.first, self.last = list(self._start), list(self._start)

    def grow(self, most: int) -> None:
        """Adds rows on all four sides in turn, as long as they are floor that nobody else has."""
        low = high = float(self._floor[self._start])
        open_sides = [(0, -1), (0, 1), (1, -1), (1, 1)]
        while open_sides:
            for side in tuple(open_sides):
                row = self._row(*side)
                axis = side[0]
                fits = row is not None and self.last[axis] - self.first[axis] + 1 < most
                if fits and row is not None:
                    free = _count(self._free_sum, row)
                    size = (row[2] - row[0] + 1) * (row[3] - row[1] + 1)
                    fits = free >= _FREE_SHARE * size and _count(self._fresh_sum, row) >= _FRESH_SHARE * free
                if fits and row is not None:
                    floor = self._floor[row[0] : row[2] + 1, row[1] : row[3] + 1]
                    lowest, highest = min(low, float(floor.min())), max(high, float(floor.max()))
                    fits = highest - lowest <= self._rise
                    if fits:
                        low, high = lowest, highest
                        self._take(*side)
                if not fits:
                    open_sides.remove(side)

    def reach_out(self, collar: int) -> None:
        """Adds up to `collar` rows a side that have any floor of nobody's: thresholds of doors, remnants at walls."""
        for side in ((0, -1), (0, 1), (1, -1), (1, 1)):
            for _ in range(collar):
                row = self._row(*side)
                if row is None or _count(self._fresh_sum, row) == 0:
                    break
                self._take(*side)

    def joined(self) -> Int64Array:
        """Cells of the rectangle that are joined to the first one inside it."""
        part = (slice(self.first[0], self.last[0] + 1), slice(self.first[1], self.last[1] + 1))
        labels = connected_label(self._free[part])[0]
        own = labels[self._start[0] - self.first[0], self._start[1] - self.first[1]]
        return self._cell[part][labels == own]

    def _row(self, axis: int, step: int) -> tuple[int, int, int, int] | None:
        """The row next to a side, as its corners; None at the end of the raster."""
        at = self.last[axis] + 1 if step > 0 else self.first[axis] - 1
        if not 0 <= at < self._free.shape[axis]:
            return None
        if axis == 0:
            return at, self.first[1], at, self.last[1]
        return self.first[0], at, self.last[0], at

    def _take(self, axis: int, step: int) -> None:
        if step > 0:
            self.last[axis] += 1
        else:
            self.first[axis] -= 1


def _integral(values: BoolArray) -> Int64Array:
    """Sums over all rectangles at a corner (Crow 1984), with a border of zeros."""
    result = np.zeros((values.shape[0] + 1, values.shape[1] + 1), np.int64)
    result[1:, 1:] = values.cumsum(axis=0).cumsum(axis=1)
    return result


def _count(integral: Int64Array, corners: tuple[int, int, int, int]) -> int:
    """How many are set in a rectangle, its corners included."""
    a, b, c, d = corners
    return int(integral[c + 1, d + 1] - integral[a, d + 1] - integral[c + 1, b] + integral[a, b])


def _distance_to_wall(space: Walkable, most: int) -> Int64Array:
    """Steps from each cell of air to the nearest that lacks a neighbour, at most `most`, shape (n,)."""
    beside = space.floors.beside
    inner = space.air & (beside >= 0).all(axis=1)
    for side in range(4):
        inner &= space.air[beside[:, side]]
    distance = np.where(inner, most, 0).astype(np.int64)
    front = np.flatnonzero(space.air & ~inner)
    for steps in range(1, most):
        around = beside[front].ravel()
        around = around[around >= 0]
        front = np.unique(around[inner[around] & (distance[around] > steps)])
        if len(front) == 0:
            break
        distance[front] = steps
    return distance
