"""Very small regions use the model of a neighbour instead of one of their own (Sloan et al. 2013, section 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.arrays import Float64Array, Int32Array
from bake.region_types import RegionGraph
from bake.regions.fit import GroupedPoints
from bake.regions.moments import Moments


@dataclass(frozen=True, slots=True)
class Absorption:
    """Who uses whose model.

    Attributes:
        owner: Shape (r,), int32: the region whose model each one uses.
        absorbed: Regions with another's model, in the order in which they were absorbed.
        kept: Regions that are small, but have no neighbour.
    """

    owner: Int32Array
    absorbed: tuple[int, ...]
    kept: tuple[int, ...]


def absorb(moments: Moments, graph: RegionGraph, smallest: float) -> Absorption:
    """Gives regions of too little volume to the linked neighbours that suit them best, the smallest first.

    A region and what it has absorbed count as one, of their added volume. Of its neighbours that one takes it up whose
    model, fitted anew to the points of both, adds least to the squared error that the two have apart, integrated over
    their space (Ward 1963); among equals, the one with which it shares most boundary.

    Args:
        moments: Sums over the points of each region.
        graph: The regions and their links.
        smallest: Volume in m³ from which on a region keeps its own model.
    """
    count = len(graph)
    owner = np.arange(count, dtype=np.int32)
    volume: list[float] = np.prod(graph.maximum - graph.minimum, axis=1).tolist()
    members: dict[int, list[int]] = {i: [i] for i in range(count)}
    shared: list[dict[int, float]] = [{} for _ in range(count)]
    pairs: list[list[int]] = graph.link.tolist()
    areas: list[float] = graph.link_area.tolist()
    for (a, b), area in zip(pairs, areas, strict=True):
        shared[a][b] = shared[b][a] = area
    order: list[int] = []
    kept: list[int] = []
    small = {i for i in range(count) if volume[i] < smallest}
    while small:
        least = min(small, key=lambda i: (volume[i], i))
        small.discard(least)
        neighbours = sorted(shared[least], key=lambda j: (-shared[least][j], j))
        if not neighbours:
            kept.append(least)
            continue
        cost = _added_error(moments, graph, members[least], [members[j] for j in neighbours])
        taker = neighbours[int(np.argmin(np.round(cost, 12)))]
        order.append(least)
        members[taker] += members.pop(least)
        volume[taker] += volume[least]
        if volume[taker] >= smallest:
            small.discard(taker)
        for other, area in shared[least].items():
            del shared[other][least]
            if other != taker:
                shared[taker][other] = shared[other][taker] = shared[taker].get(other, 0.0) + area
    for number, group in members.items():
        owner[group] = number
    return Absorption(owner, tuple(order), tuple(kept))


def _added_error(moments: Moments, graph: RegionGraph, own: list[int], others: list[list[int]]) -> Float64Array:
    """What joining a group to each of some others adds to the squared error of both, shape (others,)."""
    candidates = [own, *others, *(own + other for other in others)]
    error = _group_errors(moments, graph, candidates)
    apart, joined = error[1 : 1 + len(others)] + error[0], error[1 + len(others) :]
    return joined - apart


def _group_errors(moments: Moments, graph: RegionGraph, groups: list[list[int]]) -> Float64Array:
    """Squared error of the better model of each group, summed over the distances and integrated over its points."""
    rows = np.concatenate([np.array(group, np.int64) for group in groups])
    firsts = np.cumsum([0, *(len(group) for group in groups[:-1])])
    owner = np.repeat(firsts, [len(group) for group in groups]).astype(np.int32)
    grouped = GroupedPoints(moments.of(rows), graph.minimum[rows], graph.maximum[rows], owner)
    errors = [grouped.fit(centre).error.sum(axis=1) for centre in (grouped.middle, grouped.centre_of_mass())]
    return (np.minimum(*errors) * grouped.mass)[firsts]
