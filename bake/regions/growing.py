"""Grows one rectangle over a raster of floor."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import label as connected_label

from bake.regions.floors import LEDGE
from bake.regions.rectangles import Rectangles
from bake.regions.walkable import Walkable
from bake.types import BoolArray, Float64Array, Int64Array

_FREE_SHARE = 0.6  # of a new row that must be floor
_FRESH_SHARE = 0.5  # of that floor that no other rectangle has yet


class Window:
    """The plan around a cell, as a raster of the cells nearest to its height.

    Attributes:
        i, j: Column of the raster's corner.
        first, last: Corners of the rectangle in the raster, both in it.
    """

    def __init__(self, space: Walkable, start: int, reach: int, rectangles: Rectangles) -> None:
        floors = space.floors
        plan = floors.plan
        own = int(floors.column[start])
        at = (own // plan.shape[1], own % plan.shape[1])
        self.i, self.j = max(at[0] - reach, 0), max(at[1] - reach, 0)
        end_i, end_j = min(at[0] + reach + 1, plan.shape[0]), min(at[1] + reach + 1, plan.shape[1])
        column = np.arange(self.i, end_i)[:, None] * plan.shape[1] + np.arange(self.j, end_j)
        height = floors.floor[start]
        self._cell = np.full(column.shape, -1, np.int64)
        cell, closest = self._cell.ravel(), np.full(column.size, rectangles.rise)
        candidate, end = floors.first[column].ravel(), floors.first[column + 1].ravel()
        place = np.arange(column.size)
        while len(place := place[more := candidate < end]):
            candidate, end = candidate[more], end[more]
            away = np.abs(floors.floor[candidate] - height)
            nearer = (away < closest[place]) & space.air[candidate]
            cell[place[nearer]], closest[place[nearer]] = candidate[nearer], away[nearer]
            candidate = candidate + 1
        self._start = (at[0] - self.i, at[1] - self.j)
        self._floor = np.where(self._cell >= 0, floors.floor[np.maximum(self._cell, 0)], height)
        free = _joined(self._cell >= 0, self._floor, self._start)
        self._floor[~free] = height
        self._free = free
        self._fresh = free & (rectangles.owner[np.maximum(self._cell, 0)] < 0)
        self._free_sum, self._fresh_sum = _integral(free), _integral(self._fresh)
        self._rise = rectangles.rise
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
                    floor = self._floor[row[0] : row[2] + 1, row[1] : row[3] + 1].ravel().tolist()  # few: no array pays
                    lowest, highest = min(low, *floor), max(high, *floor)
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
        start = (self._start[0] - self.first[0], self._start[1] - self.first[1])
        return self._cell[part][_joined(self._free[part], self._floor[part], start)]

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


def _joined(free: BoolArray, floor: Float64Array, start: tuple[int, int]) -> BoolArray:
    """Cells that are joined to a first one over sides where the floor rises by no more than a ledge."""
    # Between any two cells lies another one that is set where they are joined.
    woven = np.zeros((2 * free.shape[0] - 1, 2 * free.shape[1] - 1), np.bool_)
    woven[::2, ::2] = free
    woven[1::2, ::2] = free[1:] & free[:-1] & (np.abs(np.diff(floor, axis=0)) <= LEDGE)
    woven[::2, 1::2] = free[:, 1:] & free[:, :-1] & (np.abs(np.diff(floor, axis=1)) <= LEDGE)
    labels = connected_label(woven)[0]
    return labels[::2, ::2] == labels[2 * start[0], 2 * start[1]]


def _integral(values: BoolArray) -> Int64Array:
    """Sums over all rectangles at a corner (Crow 1984), with a border of zeros."""
    result = np.zeros((values.shape[0] + 1, values.shape[1] + 1), np.int64)
    result[1:, 1:] = values.cumsum(axis=0).cumsum(axis=1)
    return result


def _count(integral: Int64Array, corners: tuple[int, int, int, int]) -> int:
    """How many are set in a rectangle, its corners included."""
    a, b, c, d = corners
    return int(integral[c + 1, d + 1] - integral[a, d + 1] - integral[c + 1, b] + integral[a, b])
