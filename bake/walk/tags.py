"""Which region the character is tagged with on each frame (Sloan et al. 2013, section 3).

It stays in its region while that one holds it, until a linked neighbour holds it better by a margin: so overlapping
boxes don't take turns, and the change comes near the middle of what they share, where the regularisation makes models
agree. A region holds a point of its box if it reaches the free space there: one at least of the eight grid points
around is connected to its seed. It holds it the better the deeper inside the box the point is, up to a metre; of boxes
inside each other the smaller holds it better.

Once its region no longer holds it, the linked neighbour that holds it best comes next. Where none does, as in the
thickness of a doorway, the last region counts as long as its box is near. After that, or after a teleport, it is the
region that holds the point best, else the box around it that would, else the nearest box.
"""

from __future__ import annotations

import numpy as np

from bake.region_types import RegionGraph
from bake.regions.boxes import Boxes
from bake.regions.crossings import MARGIN
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array

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
            points = position[part]
            own = _score(boxes, np.array([current]), points)[:, 0]
            better = _score(boxes, neighbours[current], points) > own[:, None] + MARGIN
            stays = np.isfinite(own) & ~better.any(axis=1) & ~teleported[part]
            count = int(len(stays) if stays.all() else stays.argmin())
            region[frame : frame + count], inside[frame : frame + count] = current, True
            frame += count
            if count < len(stays):
                break
    return region, inside


def _score(boxes: Boxes, regions: Int64Array, points: Float64Array) -> Float64Array:
    """How well regions hold points, shape (n, 3) → (n, regions), metres; -inf where they do not."""
    score = boxes.held_depth(regions, points[:, None])
    point, number = np.nonzero(np.isfinite(score))
    reached = boxes.open_share(regions[number], points[point]) > 0.0
    score[point[~reached], number[~reached]] = -np.inf
    return score


def _next(boxes: Boxes, neighbours: list[Int64Array], point: Float64Array, last: int) -> tuple[int, bool]:
    around = boxes.holding(point)
    score = _score(boxes, around, point[None])[0]
    if last >= 0:
        reached = np.isfinite(score)
        own = score[around == last].max(initial=-np.inf)
        linked = np.flatnonzero(reached & np.isin(around, neighbours[last]) & (score > own + MARGIN))
        if len(linked):
            return int(around[linked[score[linked].argmax()]]), True
        distance = boxes.distance(point)
        if np.isfinite(own) or distance[last] <= (NEAR if len(around) else distance.min()):
            return last, bool(len(around))
    if not len(around):
        return int(boxes.distance(point).argmin()), False
    if not np.isfinite(score).any():
        score = boxes.held_depth(around, point)
    return int(around[score.argmax()]), True


def _neighbours(graph: RegionGraph) -> list[Int64Array]:
    """The regions linked with each, ascending."""
    here = np.concatenate([graph.link[:, 0], graph.link[:, 1]]).astype(np.int64)
    there = np.concatenate([graph.link[:, 1], graph.link[:, 0]]).astype(np.int64)
    order = np.lexsort((there, here))
    return np.split(there[order], np.cumsum(np.bincount(here, minlength=len(graph)))[:-1])
