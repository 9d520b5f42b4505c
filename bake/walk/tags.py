"""Which region the character is tagged with on each frame (Sloan et al. 2013, section 3).

It stays in its region while that one holds it, so that overlapping boxes don't take turns. A region holds a point of
its box if it reaches the free space there: one at least of the eight grid points around is connected to its seed.
Then comes a linked neighbour that holds it. Where none does, as in the thickness of a doorway, the last region counts
as long as its box is near. After that, or after a teleport, any region that holds the point will do, then any box
around it, then the nearest box. Of several that do equally the one comes first in which the point lies deepest, and of
those the first of all.
"""

from __future__ import annotations

import numpy as np

from bake.region_types import RegionGraph
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array
from bake.walk.boxes import Boxes

NEAR = 1.0
"""Metres from its box within which a region still counts where no linked neighbour holds the character."""

_FRAMES_AT_ONCE = 256


def tag_regions(
    graph: RegionGraph, boxes: Boxes, position: Float64Array, teleported: BoolArray
) -> tuple[Int32Array, BoolArray]:
    """Tags every frame.

    Args:
        graph: The regions, one at least.
        boxes: Theirs.
        position: Shape (n, 3), metres relative to `World.origin`.
        teleported: Shape (n,): frames on which the last region no longer counts.

    Returns:
        The region of each frame, shape (n,), int32, and whether any box holds it, shape (n,), bool.
    """
    neighbours = _neighbours(graph)
    region, inside = np.empty(len(position), np.int32), np.empty(len(position), np.bool_)
    frame, current = 0, -1
    while frame < len(position):
        last = -1 if teleported[frame] else current
        current, inside[frame] = _next(boxes, neighbours, position[frame], last)
        region[frame] = current
        frame += 1
        while frame < len(position):  # as long as it stays, many frames at once
            part = slice(frame, frame + _FRAMES_AT_ONCE)
            stays = _holds(boxes, current, position[part]) & ~teleported[part]
            count = int(len(stays) if stays.all() else stays.argmin())
            region[frame : frame + count], inside[frame : frame + count] = current, True
            frame += count
            if count < len(stays):
                break
    return region, inside


def _holds(boxes: Boxes, region: int, points: Float64Array) -> BoolArray:
    held = boxes.held(region, points)
    numbers = np.full(len(points), region, np.int32)
    held[held] = boxes.open_share(numbers[held], points[held]) > 0.0
    return held


def _next(boxes: Boxes, neighbours: list[set[int]], point: Float64Array, last: int) -> tuple[int, bool]:
    around = boxes.holding(point)
    holding = around[boxes.open_share(around, np.broadcast_to(point, (len(around), 3))) > 0.0]
    distance = boxes.distance(point)
    if last >= 0:
        linked = holding[[number in neighbours[last] for number in holding.tolist()]]
        if len(linked):
            return _deepest(boxes, linked, point), True
        if distance[last] <= (NEAR if len(around) else distance.min()):
            return last, bool(len(around))
    for candidates in (holding, around):
        if len(candidates):
            return _deepest(boxes, candidates, point), True
    return int(distance.argmin()), False


def _deepest(boxes: Boxes, regions: Int64Array, point: Float64Array) -> int:
    return int(regions[boxes.depth(regions, point).argmax()])


def _neighbours(graph: RegionGraph) -> list[set[int]]:
    neighbours = [set[int]() for _ in range(len(graph))]
    a: int
    b: int
    for a, b in graph.link.tolist():
        neighbours[a].add(b)
        neighbours[b].add(a)
    return neighbours
