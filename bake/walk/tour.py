"""A tour of the link graph: a path at walking height that visits every region it can get to."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from bake.errors import InputError
from bake.regions.boxes import Boxes
from bake.regions.floor_below import HEIGHT, Floor
from bake.regions.free_space import FreeSpace
from bake.regions.obstacles import CUT_OUT
from bake.regions.rays import Nearest
from bake.regions.upright import Upright
from bake.types import BoolArray, Float64Array, Regions, World
from bake.walk.path import path_through, places
from bake.walk.routes import Routes
from bake.walk.standing import SHOULDER
from bake.walk.types import WalkPath

_SPACING = 0.25
_SMOOTHED = 3  # neighbours on either side that heights are averaged over
_FARTHEST_FLOOR = 2.0  # a floor farther below the way than this is no floor of this way


@dataclass(frozen=True, slots=True)
class Tour:
    """A tour.

    Attributes:
        path: Where it leads.
        visited: Shape (r,), bool: regions whose middle it passes; the others are not connected with them on foot.
    """

    path: WalkPath
    visited: BoolArray


def tour(regions: Regions, world: World, nearest: Nearest, up: Upright) -> Tour:
    """Walks through the largest part of the link graph that hangs together on foot, depth first, nearest region first.

    From region to region it takes the shortest way along places where one can stand, through the centres of links.
    The way follows the floor at walking height. It begins in the first region of the part.

    Args:
        regions: Boxes, links and valid points.
        world: The baked scene.
        nearest: A tracer's closest hits.
        up: Which way is up.

    Raises:
        InputError: nobody can stand in any region.
    """
    stops = world.face_casts & (world.face_openness < CUT_OUT)
    floor, free = Floor(nearest, up, stops), FreeSpace(world, nearest, stops)
    routes = Routes(regions, floor, free)
    order = _order(routes, len(regions.graph))
    points = _joined(routes, order)
    if len(points) < 2:
        raise InputError(
            "no two regions are connected by a way on which one can walk",
            where="walk",
            remedy="give a path with --path",
        )
    visited = np.zeros(len(regions.graph), np.bool_)
    visited[order] = True
    return Tour(path_through(_on_floor(points, floor, free, Boxes(regions.graph, regions.points))), visited)


def _order(routes: Routes, count: int) -> list[int]:
    """Regions in the order of a depth-first search, the nearest neighbour first, over the largest connected part."""
    _, part = connected_components(routes.length, directed=False)
    sizes = np.bincount(part[:count][routes.reachable], minlength=int(part.max(initial=0)) + 1)
    if not sizes.any():
        return []
    start = int(np.flatnonzero((part[:count] == sizes.argmax()) & routes.reachable)[0])
    seen = {start}
    order, stack = [start], [_neighbours(routes.length, start, count)]
    while stack:
        following = next((region for region in stack[-1] if region not in seen), None)
        if following is None:
            stack.pop()
            continue
        seen.add(following)
        order.append(following)
        stack.append(_neighbours(routes.length, following, count))
    return order


def _neighbours(length: csr_array, region: int, count: int) -> list[int]:
    """Regions one passage away, the nearest first."""
    found: dict[int, float] = {}
    for passage, there in _row(length, region):
        for other, back in _row(length, passage):
            if other < count and other != region:
                found[other] = min(found.get(other, np.inf), there + back)
    return sorted(found, key=lambda other: (found[other], other))


def _row(length: csr_array, stop: int) -> list[tuple[int, float]]:
    part = slice(int(length.indptr[stop]), int(length.indptr[stop + 1]))
    return list(zip(length.indices[part].tolist(), length.data[part].tolist(), strict=True))


def _joined(routes: Routes, order: list[int]) -> Float64Array:
    """The points of the way from middle to middle, shape (n, 3)."""
    parts: list[Float64Array] = []
    for start, end in itertools.pairwise(order):
        before = dijkstra(routes.length, directed=False, indices=[start], return_predecessors=True)[1][0]
        stops = [end]
        while stops[-1] != start:
            stops.append(int(before[stops[-1]]))
        parts += [routes.way(a, b) for a, b in itertools.pairwise(stops[::-1])]
    return np.concatenate(parts) if parts else np.empty((0, 3))


def _on_floor(points: Float64Array, floor: Floor, free: FreeSpace, boxes: Boxes) -> Float64Array:
    """The way at short intervals, at walking height over the floor.

    Where that would lead into something, or out of the regions, as down a pit beside a bridge, it stays as it was.
    """
    path = path_through(points)
    count = max(2, math.ceil(path.length / _SPACING) + 1)
    distance = np.linspace(0.0, path.length, count)
    straight = places(path, distance, np.zeros(count, np.int32))
    drop = floor.height_above(straight, reach=HEIGHT + _FARTHEST_FLOOR) - HEIGHT
    drop[~np.isfinite(drop)] = 0.0
    height = floor.up.turned(straight)[:, 2]
    drop = height - _averaged(height - drop)  # steps of the floor become slopes
    lowered = straight + drop[:, None] * floor.up.down
    blocked = np.flatnonzero(~free.clear(lowered[:-1], lowered[1:], width=SHOULDER))
    blocked = np.union1d(blocked, np.flatnonzero(boxes.holds_any(straight) & ~boxes.holds_any(lowered)))
    around = np.unique((blocked[:, None] + np.arange(-_SMOOTHED, _SMOOTHED + 2)).clip(0, count - 1))
    # Back to the straight way gradually, lest the height jump.
    kept = np.ones(count)
    kept[around] = 0.0
    kept = np.minimum(_averaged(kept), kept)
    return straight + (kept * drop)[:, None] * floor.up.down


def _averaged(values: Float64Array) -> Float64Array:
    """Means over the neighbours on either side."""
    width = 2 * _SMOOTHED + 1
    return np.convolve(np.pad(values, _SMOOTHED, mode="edge"), np.ones(width) / width, mode="valid")
