"""Where a character can stand, and from where to where it can walk: cells of floor and their neighbours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bake.geometry import sphere_direction
from bake.regions.columns import Plan, Solids
from bake.regions.rays import Nearest
from bake.regions.upright import Upright
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array

HEAD_ROOM = 1.8
"""Metres that a character needs above the floor."""

STEP = 0.5
"""Metres that it can step up or down."""

LEDGE = 1.2
"""Metres up to which neighbouring floors share their air: a table stands in a room."""

_LOOKS = 16
_UNDER = 0.75  # share of the upward rays that meet backs where one is below ground or inside something
_BLOCK = 1.0  # metres, but four cells at least: a block shares one answer to that


@dataclass(frozen=True, slots=True)
class Floors:
    """Cells of floor, sorted by column and height.

    Attributes:
        plan: The columns.
        column: Shape (n,), int64.
        floor, ceiling: Shape (n,), metres of height; `ceiling` is inf under the open sky.
        beside: Shape (n, 4), int32: the cell that shares its air toward +u, -u, +v, -v; -1 for none.
        first: Shape (columns + 1,), int64: where each column's cells begin.
        falls: Shape (n,), uint8: sides on which there is lower ground but no cell beside.
        edges: Shape (n,), uint8: sides on which there is nothing at all.
        below: Shape (n,), bool: there is free space under this floor.
    """

    plan: Plan
    column: Int64Array
    floor: Float64Array
    ceiling: Float64Array
    beside: Int32Array
    first: Int64Array
    falls: np.ndarray
    edges: np.ndarray
    below: BoolArray

    def __len__(self) -> int:
        return len(self.column)

    def bodies(self, height: float) -> Float64Array:
        """Points above the middle of each cell, (u, v, height), at most half-way to the ceiling, shape (n, 3)."""
        room = np.minimum(height, 0.5 * (self.ceiling - self.floor))
        return np.concatenate([self.plan.centre(self.column), (self.floor + room)[:, None]], axis=1)

    def parts(self, cells: Int64Array, *, climb: float = LEDGE) -> Int32Array:
        """Numbers of the parts into which chosen cells fall, shape (chosen,), from 0.

        Args:
            cells: Shape (chosen,), ascending.
            climb: Metres of height that neighbours may differ by.
        """
        number = np.full(len(self), -1, np.int64)
        number[cells] = np.arange(len(cells))
        ends: list[Int64Array] = []
        for side in (0, 2):
            beside = self.beside[cells, side]
            joined = (beside >= 0) & (np.abs(self.floor[beside] - self.floor[cells]) <= climb)
            other = np.where(joined, number[beside], -1)
            ends.append(np.stack([np.flatnonzero(other >= 0), other[other >= 0]]))
        a, b = np.concatenate(ends, axis=1)
        graph = coo_array((np.ones(len(a), np.int8), (a, b)), shape=(len(cells), len(cells)))
        return connected_components(graph, directed=False)[1]


def find_floors(solids: Solids, plan: Plan, up: Upright, nearest: Nearest, two_sided: BoolArray) -> tuple[Floors, int]:
    """Gaps between solids in which a character can stand, and the number of rays that were needed.

    A gap whose ceiling is the back of a one-sided face may lie below the ground or inside a hollow body: it is left
    out where three of four upward rays meet backs. A single-sided canopy does not cover that much.
    """
    last_of_column = np.append(np.diff(solids.column) != 0, True) if len(solids.column) else np.zeros(0, np.bool_)
    following = np.minimum(np.arange(len(solids.column)) + 1, max(len(solids.column) - 1, 0))
    ceiling: Float64Array = np.where(last_of_column, np.inf, plan.bottom + plan.step * solids.low[following])
    floor: Float64Array = (plan.bottom + plan.step * solids.high).astype(np.float64)
    room = ceiling - floor >= HEAD_ROOM
    doubtful = np.flatnonzero(room & ~last_of_column & solids.hollow[following])
    body: Float64Array = floor[doubtful] + 0.5 * HEAD_ROOM
    points = np.concatenate([plan.centre(solids.column[doubtful]), body[:, None]], axis=1)
    under, rays = _under_something(points, plan, up, nearest, two_sided)
    room[doubtful[under]] = False
    gap = np.flatnonzero(room)
    stand = solids.floor[gap]
    below = np.zeros(len(gap), np.bool_)
    below[1:] = solids.column[gap[1:]] == solids.column[gap[:-1]]
    return _joined(plan, solids, gap, floor, ceiling, stand, below), rays


def _joined(
    plan: Plan,
    solids: Solids,
    gap: Int64Array,
    floor: Float64Array,
    ceiling: Float64Array,
    stand: BoolArray,
    below: BoolArray,
) -> Floors:
    """Finds the neighbours of gaps, and keeps those with a floor."""
    column, floor, ceiling = solids.column[gap], floor[gap], ceiling[gap]
    start = np.searchsorted(column, np.arange(plan.count + 1)).astype(np.int64)
    anything = np.zeros(plan.count, np.bool_)
    anything[solids.column] = True
    cell = np.flatnonzero(stand)
    beside = np.full((len(cell), 4), -1, np.int32)
    falls, edges = np.zeros(len(cell), np.uint8), np.zeros(len(cell), np.uint8)
    number = np.full(len(column), -1, np.int32)
    number[cell] = np.arange(len(cell))
    i, j = column[cell] // plan.shape[1], column[cell] % plan.shape[1]
    for side, (di, dj) in enumerate(((1, 0), (-1, 0), (0, 1), (0, -1))):
        here = np.flatnonzero((i + di >= 0) & (i + di < plan.shape[0]) & (j + dj >= 0) & (j + dj < plan.shape[1]))
        other = column[cell[here]] + di * plan.shape[1] + dj
        alone = np.ones(len(cell), np.bool_)
        alone[here] = ~anything[other]
        closest = np.full(len(cell), np.inf)
        lower = np.zeros(len(cell), np.bool_)
        candidate, end = start[other], start[other + 1]
        while len(here := here[more := candidate < end]):
            candidate, end = candidate[more], end[more]
            own = cell[here]
            rise = floor[candidate] - floor[own]
            away = np.abs(rise)
            common = np.minimum(ceiling[candidate], ceiling[own]) - np.maximum(floor[candidate], floor[own])
            fits = (away <= LEDGE) & (common >= HEAD_ROOM - STEP) & stand[candidate] & (away < closest[here])
            beside[here[fits], side] = number[candidate[fits]]
            closest[here[fits]] = away[fits]
            lower[here[(rise < -STEP) & (ceiling[candidate] >= floor[own] + 1.0)]] = True
            candidate = candidate + 1
        falls += (beside[:, side] < 0) & lower
        edges += (beside[:, side] < 0) & alone
    return Floors(
        plan,
        column[cell],
        floor[cell],
        ceiling[cell],
        beside,
        np.searchsorted(column[cell], np.arange(plan.count + 1)).astype(np.int64),
        falls,
        edges,
        below[cell],
    )


def _under_something(
    points: Float64Array, plan: Plan, up: Upright, nearest: Nearest, two_sided: BoolArray
) -> tuple[BoolArray, int]:
    """Whether points, shape (n, 3) as (u, v, height), see mostly backs above them; one point of a block is asked."""
    if len(points) == 0:
        return np.zeros(0, np.bool_), 0
    block = np.floor((points - [*plan.low, plan.bottom]) / max(_BLOCK, 4.0 * plan.cell)).astype(np.int64)
    width = block.max(axis=0) + 1
    key = (block[:, 0] * width[1] + block[:, 1]) * width[2] + block[:, 2]
    _, chosen, group = np.unique(key, return_index=True, return_inverse=True)
    origins = np.repeat(up.world(points[chosen]), _LOOKS, axis=0).astype(np.float32)
    number = np.arange(_LOOKS, dtype=np.float64) + 0.5
    spiral = sphere_direction(0.5 * number / _LOOKS, 0.61803398875 * number % 1.0)  # heights from 1 down to 0
    directions: Float32Array = np.tile(up.world(spiral), (len(chosen), 1)).astype(np.float32)
    backs = np.zeros(len(origins), np.bool_)
    for begin in range(0, len(origins), 1 << 20):
        part = slice(begin, begin + (1 << 20))
        hits = nearest(origins[part], directions[part], 1e30)
        backs[part] = (hits.face >= 0) & (hits.cosine > 0.0) & ~two_sided[np.maximum(hits.face, 0)]
    under = backs.reshape(-1, _LOOKS).mean(axis=1) >= _UNDER
    return under[group], len(origins)
