"""Merges cells of floor into rectangles as large as rooms: greedily, the roomiest place first.

A rectangle grows from its middle in all four directions, a row of cells at a time. It stops at walls and doorways, for
there most cells of the next row are missing; it passes furniture and follows diagonal walls, for there most are not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.regions.floors import Floors
from bake.regions.growing import Window
from bake.regions.rectangles import Rectangles
from bake.regions.remnants import attach_remnants
from bake.regions.walkable import Walkable
from bake.types import Float64Array, Int32Array, Int64Array

HEAD = 2.5
"""Metres above the floor up to which objects are lit by regions; or up to the ceiling."""

_COLLAR = 0.6  # metres that a rectangle reaches beyond, into doorways
_RISE = 0.4  # of the longest edge: how much a rectangle's floor may rise
_SMALLEST = (6 / 144, 2 / 144)  # of the longest edge squared: fewest floor of its own, in a first and a second round
_FAILURES = 64  # starts in vain after which small remnants are sorted out


@dataclass(frozen=True, slots=True)
class Rooms:
    """Boxes in (u, v, height).

    Attributes:
        low, high: Shape (r, 3), metres.
        seed: Shape (r, 3): in the air over the cell from which each grew.
        fresh: Shape (r,): cells of floor that each was the first to cover.
        owner: Shape (n,), int32: the first box in which each cell can be reached; -1 for none.
    """

    low: Float64Array
    high: Float64Array
    seed: Float64Array
    fresh: Int64Array
    owner: Int32Array

    def __len__(self) -> int:
        return len(self.low)


def merge_cells(space: Walkable, longest: float) -> Rooms:
    """Covers the air over a level's floor with boxes.

    First rectangles of good size; what is left over enlarges them where that wastes little; then smaller ones.

    Args:
        space: Which cells.
        longest: Longest edge of a box in plan, metres; a few exceed it by a quarter.
    """
    floors = space.floors
    most = max(2, int(longest / floors.plan.cell))
    distance = _distance_to_wall(space, most // 2)
    # Where there is room on all sides, places are taken in a pattern of tiles.
    tile = np.abs(floors.column // floors.plan.shape[1] % most - most // 2)
    tile += np.abs(floors.column % floors.plan.shape[1] % most - most // 2)
    order = np.flatnonzero(space.air)
    order = order[np.lexsort((tile[order], -distance[order]))]
    rectangles = Rectangles(len(floors), most, max(2.0, _RISE * longest))
    for share in _SMALLEST:
        _fill(space, order, rectangles, max(1, round(share * most**2)))
        attach_remnants(floors, space.air, rectangles)
    return _boxes(floors, rectangles)


def _fill(space: Walkable, order: Int64Array, rectangles: Rectangles, smallest: int) -> None:
    """Adds rectangles that cover at least `smallest` cells of nobody's."""
    tried = rectangles.owner >= 0
    failures = 0
    for start in order.tolist():
        if tried[start]:
            continue
        corners, cells = _grow(space, start, rectangles)
        fresh = cells[rectangles.owner[cells] < 0]
        tried[fresh] = True
        tried[start] = True
        if len(fresh) >= smallest:
            floor = space.floors.floor[cells]
            rectangles.give(rectangles.add(start, corners, float(floor.min()), float(floor.max())), fresh)
            continue
        failures += 1
        if failures % _FAILURES == 0:  # remnants too small are sorted out together
            left = np.flatnonzero(space.air & ~tried)
            part = space.floors.parts(left)
            tried[left[np.bincount(part)[part] < smallest]] = True


def _grow(space: Walkable, start: int, rectangles: Rectangles) -> tuple[Int64Array, Int64Array]:
    """Grows a rectangle around a cell: its corners (i, j, i, j), and the cells that can be reached in it."""
    collar = max(1, round(_COLLAR / space.floors.plan.cell))
    reach = rectangles.most // 4  # most are small: the large raster is seldom needed
    window = Window(space, start, reach + collar, rectangles)
    window.grow(rectangles.most)
    if max(window.last[axis] - window.first[axis] for axis in (0, 1)) >= reach:
        window = Window(space, start, rectangles.most + collar, rectangles)
        window.grow(rectangles.most)
    window.reach_out(collar)
    corners = np.array([*window.first, *window.last]) + np.array([window.i, window.j] * 2)
    return corners, window.joined()


def _boxes(floors: Floors, rectangles: Rectangles) -> Rooms:
    """Boxes from the lowest floor to above a head, half a cell wider on all sides.

    Free space goes on up to the wall, and neighbours shall overlap.
    """
    plan = floors.plan
    owned = np.flatnonzero(rectangles.owner >= 0)
    top = np.full(len(rectangles), -np.inf)
    heads = np.minimum(floors.floor[owned] + HEAD, floors.ceiling[owned])
    np.maximum.at(top, rectangles.owner[owned], heads)
    low = np.concatenate([plan.low + (rectangles.corners[:, :2] - 0.5) * plan.cell, rectangles.floor[:, :1]], axis=1)
    high = np.concatenate([plan.low + (rectangles.corners[:, 2:] + 1.5) * plan.cell, top[:, None]], axis=1)
    seed = floors.bodies(1.2)[np.array(rectangles.first_cell, np.int64)]
    return Rooms(low, high, seed, np.array(rectangles.fresh, np.int64), rectangles.owner)


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
