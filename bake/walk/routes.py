"""Ways through regions: from link to link, and to the middle of each region, along places where one can stand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from bake.region_types import GRID, PointState
from bake.regions.floor_below import Floor
from bake.regions.free_space import FreeSpace
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array, Regions
from bake.walk.standing import Standing, find_standing, seen_from

_TRIED = 24  # places that a link's passage looks for, on either side
_MOST_PASSAGES = 48  # in one region: of more, not every two look for each other
_IN_THE_AIR = 4.0  # how much longer a way up or down through a level boundary counts
_ALONG_THE_EDGE = 4.0  # how much longer one from passage to passage does, that may run between two regions all along


@dataclass(frozen=True, slots=True)
class _Inside:
    """Shortest ways between the stops of one region: its middle, then its passages.

    Attributes:
        stops: Stop numbers, shape (m,).
        node: Where each stop is among the region's nodes, shape (m,).
        before: Shape (m, n): the node before each node on the way from each stop; negative for none.
        position: Shape (n, 3).
    """

    stops: Int64Array
    node: Int64Array
    before: Int32Array
    position: Float64Array


class Routes:
    """All ways through the regions. A stop is the middle of a region, or, numbered after those, the passage of a link.

    Attributes:
        length: Stops by stops, sparse: metres between those that share a region.
        reachable: Shape (r,), bool: regions in which one can stand, and that are not mostly inside something.

    Args:
        regions: Boxes, links and valid points.
        floor: Finds floors.
        free: What blocks.
    """

    def __init__(self, regions: Regions, floor: Floor, free: FreeSpace) -> None:
        graph = regions.graph
        self._count = len(graph)
        standing = find_standing(regions, floor, free)
        self._passage = floor.lowered_centres(graph.link, graph.link_centre, graph.minimum, graph.maximum)
        self._weight = np.where(_is_level(regions, floor), _IN_THE_AIR, 1.0)
        seen = [seen_from(standing, graph.link[:, side], self._passage, free, most=_TRIED) for side in (0, 1)]
        links = [np.flatnonzero((graph.link == number).any(axis=1)) for number in range(self._count)]
        facing = _facing(links, self._passage, free)
        self.reachable = (np.diff(standing.first) > 0) & _in_the_open(regions)
        self._inside: dict[int, _Inside] = {}
        self._ends: dict[tuple[int, int], int] = {}
        rows: list[tuple[int, int, float]] = []
        by_region = _by_region(standing, seen, graph.link)
        for number in np.flatnonzero(self.reachable).tolist():
            inside, lengths = self._route(number, standing, links[number], by_region[number], facing[number])
            self._inside[number] = inside
            for i, j in zip(*np.nonzero(np.isfinite(lengths)), strict=True):
                if i != j:
                    a, b = int(inside.stops[i]), int(inside.stops[j])
                    known = self._ends.get((a, b))
                    rows.append((a, b, float(lengths[i, j])))
                    if known is None:
                        self._ends[a, b] = number
        stops = self._count + len(graph.link)
        entries = np.array(rows, np.float64).reshape(-1, 3)
        a, b = entries[:, 0].astype(np.int64), entries[:, 1].astype(np.int64)
        _, firsts = np.unique(a * stops + b, return_index=True)  # two links may join the same two regions
        self.length = csr_array((entries[firsts, 2], (a[firsts], b[firsts])), shape=(stops, stops))

    def way(self, start: int, end: int) -> Float64Array:
        """Points from one stop to another of the same region, both included, shape (p, 3)."""
        inside = self._inside[self._ends[start, end]]
        row = int(np.flatnonzero(inside.stops == start)[0])
        node = int(inside.node[np.flatnonzero(inside.stops == end)[0]])
        points = [inside.position[node]]
        while (node := int(inside.before[row, node])) >= 0:
            points.append(inside.position[node])
        return np.array(points[::-1])

    def _route(
        self,
        number: int,
        standing: Standing,
        links: Int64Array,
        edges: tuple[Int64Array, Int64Array],
        facing: Int64Array,
    ) -> tuple[_Inside, Float64Array]:
        begin, end = int(standing.first[number]), int(standing.first[number + 1])
        places = standing.place[begin:end]
        count = len(places)
        position = np.concatenate([places, self._passage[links]])
        local = np.full(len(self._passage), -1, np.int64)
        local[links] = count + np.arange(len(links))
        ways, sights = edges
        pairs = np.concatenate(
            [
                ways - begin,
                np.stack([local[sights[:, 0]], sights[:, 1] - begin], axis=1),
                local[facing],
            ]
        )
        weight = np.concatenate([np.ones(count), self._weight[links]])
        metres = np.linalg.norm(position[pairs[:, 0]] - position[pairs[:, 1]], axis=1) + 1e-9
        metres *= np.maximum(weight[pairs[:, 0]], weight[pairs[:, 1]])
        metres[len(metres) - len(facing) :] *= _ALONG_THE_EDGE
        near = coo_array((metres, (pairs[:, 0], pairs[:, 1])), shape=(len(position), len(position))).tocsr()
        middle = int(np.linalg.norm(places - places.mean(axis=0), axis=1).argmin())
        node = np.concatenate([[middle], count + np.arange(len(links))]).astype(np.int64)
        lengths, before = dijkstra(near, directed=False, indices=node, return_predecessors=True)
        stops = np.concatenate([[number], self._count + links]).astype(np.int64)
        return _Inside(stops, node, before.astype(np.int32), position), lengths[:, node]


def _in_the_open(regions: Regions) -> BoolArray:
    """Regions most of whose traced points are valid, shape (r,): others are mostly inside something."""
    state = regions.points.state.reshape(-1, GRID**3)
    return (state == PointState.VALID).sum(axis=1) > (state == PointState.BACK_FACES).sum(axis=1)


def _is_level(regions: Regions, floor: Floor) -> np.ndarray:
    """Which links lead up or down: what their regions share is thinnest along the vertical."""
    graph = regions.graph
    a, b = graph.link.reshape(-1, 2).T
    shared = np.minimum(graph.maximum[a], graph.maximum[b]) - np.maximum(graph.minimum[a], graph.minimum[b])
    return shared.argmin(axis=1) == floor.up.axis


def _facing(links: list[Int64Array], passage: Float64Array, free: FreeSpace) -> list[Int64Array]:
    """Pairs of links of each region whose passages see each other, shape (p, 2) each."""
    pairs: list[Int64Array] = []
    for own in links:
        a, b = np.triu_indices(min(len(own), _MOST_PASSAGES), 1)
        pairs.append(np.stack([own[a], own[b]], axis=1))
    flat = np.concatenate(pairs) if pairs else np.empty((0, 2), np.int64)
    seen = free.clear(passage[flat[:, 0]], passage[flat[:, 1]], width=0.1)
    ends = np.cumsum([len(own) for own in pairs])
    return [own[mask] for own, mask in zip(pairs, np.split(seen, ends[:-1]), strict=True)]


def _by_region(standing: Standing, seen: list[Int64Array], link: Int32Array) -> list[tuple[Int64Array, Int64Array]]:
    """Of each region its ways, and the sights from passages (as link numbers) to its places."""
    count = len(standing.first) - 1
    region_of = np.repeat(np.arange(count), np.diff(standing.first))
    ways = standing.way[np.argsort(region_of[standing.way[:, 0]], kind="stable")]
    cut = np.searchsorted(region_of[ways[:, 0]], np.arange(1, count))
    sights = np.concatenate(seen)
    sights = sights[np.argsort(region_of[sights[:, 1]], kind="stable")]
    other = np.searchsorted(region_of[sights[:, 1]], np.arange(1, count))
    return list(zip(np.split(ways, cut), np.split(sights, other), strict=True))
