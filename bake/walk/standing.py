"""Where a character can stand in each region, and between which of these places it can walk straight.

Every column of a region's valid grid points has a place on each floor below them, at walking height. Neighbouring
columns are joined where nothing lies between their places.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.region_types import GRID, PointState, Regions
from bake.regions.floor_below import Floor
from bake.regions.free_space import FreeSpace
from bake.regions.upright import Upright
from bake.types import Float64Array, Int32Array, Int64Array

SHOULDER = 0.1
"""Metres beside each way that must be free as well."""

_SAME_FLOOR = 0.2  # metres: places of one column that are closer stand on the same floor
_STEEPEST = 1.5  # rise over run beyond which nobody walks


@dataclass(frozen=True, slots=True)
class Standing:
    """Places, and ways between them.

    Attributes:
        first: Shape (r + 1,), int64: region i owns places `first[i]:first[i + 1]`.
        place: Shape (s, 3), float64, metres relative to `World.origin`.
        way: Shape (w, 2), int64: places of the same region that see each other.
    """

    first: Int64Array
    place: Float64Array
    way: Int64Array


def find_standing(regions: Regions, floor: Floor, free: FreeSpace) -> Standing:
    """Finds places and ways in all regions.

    Args:
        regions: Boxes and valid points.
        floor: Finds floors.
        free: What blocks.
    """
    graph, up = regions.graph, floor.up
    point = np.flatnonzero(regions.points.state == PointState.VALID)
    region = (point // GRID**3).astype(np.int64)
    position = regions.points.position[point].astype(np.float64)
    size = graph.maximum - graph.minimum
    lowered = floor.lowered(position, reach=float(np.linalg.norm(size, axis=1).max(initial=1.0)))
    # A region that ends above the floor holds its places too.
    inset = 0.02 * size[region]
    lowered = np.clip(lowered, graph.minimum[region] + inset, graph.maximum[region] - inset)
    column = _column(point, up)
    level = np.round(up.turned(lowered)[:, 2] / _SAME_FLOOR).astype(np.int64)
    order = np.lexsort((up.turned(position)[:, 2], level, column, region))
    keys = np.stack([region, column, level], axis=1)[order]
    kept = order[np.append(True, (np.diff(keys, axis=0) != 0).any(axis=1))[: len(order)]]
    region, column, place = region[kept], column[kept], lowered[kept]
    first = np.concatenate([[0], np.cumsum(np.bincount(region, minlength=len(graph)))]).astype(np.int64)
    pairs = _neighbours(region, column)
    turned = up.turned(place)
    run = np.linalg.norm(turned[pairs[:, 0], :2] - turned[pairs[:, 1], :2], axis=1)
    rise = np.abs(turned[pairs[:, 0], 2] - turned[pairs[:, 1], 2])
    pairs = pairs[rise <= _STEEPEST * run]
    seen = free.clear(place[pairs[:, 0]], place[pairs[:, 1]], width=SHOULDER)
    return Standing(first, place, pairs[seen])


def _column(point: Int64Array, up: Upright) -> Int64Array:
    """Which of GRID² columns each grid point is in."""
    place = np.stack(np.unravel_index(point % GRID**3, (GRID, GRID, GRID)), axis=1)
    across = [axis for axis in range(3) if axis != up.axis]
    return (place[:, across[0]] * GRID + place[:, across[1]]).astype(np.int64)


def _neighbours(region: Int64Array, column: Int64Array) -> Int64Array:
    """Pairs of places in neighbouring columns of the same region, shape (p, 2); places come sorted by these."""
    key = region * GRID * GRID + column
    pairs: list[Int64Array] = []
    u, v = column // GRID, column % GRID
    for du, dv in ((0, 1), (1, -1), (1, 0), (1, 1)):
        fits = (u + du < GRID) & (v + dv >= 0) & (v + dv < GRID)
        mine = np.flatnonzero(fits)
        wanted = key[mine] + du * GRID + dv
        begin, end = np.searchsorted(key, wanted, side="left"), np.searchsorted(key, wanted, side="right")
        count = end - begin
        a = np.repeat(mine, count)
        b = np.repeat(begin, count) + np.arange(len(a)) - np.repeat(np.cumsum(count) - count, count)
        pairs.append(np.stack([a, b], axis=1))
    return np.concatenate(pairs)


def seen_from(standing: Standing, region: Int32Array, point: Float64Array, free: FreeSpace, *, most: int) -> Int64Array:
    """Pairs of points and of the places of their region that can be seen from them, shape (p, 2).

    Args:
        standing: All places.
        region: Shape (n,): whose places count for each point.
        point: Shape (n, 3).
        free: What blocks.
        most: Places tried for each point, the nearest first.
    """
    pairs: list[Int64Array] = []
    for number in range(len(point)):
        begin, end = int(standing.first[region[number]]), int(standing.first[region[number] + 1])
        away = np.linalg.norm(standing.place[begin:end] - point[number], axis=1)
        near = begin + np.argsort(away, kind="stable")[:most]
        pairs.append(np.stack([np.full(len(near), number), near], axis=1))
    tried = np.concatenate(pairs) if pairs else np.empty((0, 2), np.int64)
    seen = free.clear(point[tried[:, 0]], standing.place[tried[:, 1]], width=SHOULDER)
    return tried[seen]
