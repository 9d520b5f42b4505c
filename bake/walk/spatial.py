"""Blending in space: how much each region around a point counts there, without a memory of the way.

A region weighs smoothstep(d / m) at the distance d inside its box, with a margin m of half a metre or a fifth of the
box's edge, whichever is less. Where linked boxes only touch, or overlap by less than the margin, that would be 0 for
both: around what they share each is grown by m, and weighs smoothstep((d + m) / 2m). Elsewhere boxes stay as they are,
so that nothing leaks through walls. Between linked boxes that a gap divides, such as the two sides of a doorway, the
margin is no less than the gap. What a region cannot reach from its seed weighs next to nothing. Weights are normalised,
and continuous wherever a character can go from one box to the next through a link.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.region_types import RegionGraph
from bake.regions.boxes import Boxes
from bake.types import Float64Array, Int32Array, Int64Array

LARGEST_MARGIN = 0.5
MARGIN_SHARE = 0.2
_UNREACHABLE = 1e-3  # what counts of a place that the region does not reach: more than 0, lest all weights vanish
_PAIRS_AT_ONCE = 1 << 20


@dataclass(frozen=True, slots=True)
class Weights:
    """How much regions count, a row for each that counts at a point.

    Attributes:
        first: Shape (n + 1,), int64: point i owns the rows `first[i]:first[i + 1]`, one at least.
        region: Shape (w,), int32.
        weight: Shape (w,), float64; sums to 1 over each point's rows.
    """

    first: Int64Array
    region: Int32Array
    weight: Float64Array


class SpatialBlend:
    """Finds weights for the regions of one graph.

    Args:
        graph: Regions and links.
        boxes: Theirs.
    """

    def __init__(self, graph: RegionGraph, boxes: Boxes) -> None:
        self._boxes = boxes
        self._first_gate, self._gate_low, self._gate_high = self._gates(graph)
        self._margin = np.maximum(np.minimum(LARGEST_MARGIN, MARGIN_SHARE * boxes.size), 1.02 * _gaps(graph))

    def weights(self, points: Float64Array, nearest: Float64Array, tagged: Int32Array) -> Weights:
        """Weights of the regions around points.

        Args:
            points: Shape (n, 3), metres relative to `World.origin`.
            nearest: Shape (n, 3): a place in some box, for points around which no region counts.
            tagged: Shape (n,): the region that counts where no other does even there.
        """
        point, region, value = self._counting(points)
        outside = np.flatnonzero(np.bincount(point, value, len(points)) <= 0.0)
        more, around, counts = self._counting(nearest[outside])
        point, region = np.concatenate([point, outside[more]]), np.concatenate([region, around])
        value = np.concatenate([value, counts])
        lost = np.flatnonzero(np.bincount(point, value, len(points)) <= 0.0)
        point, region = np.concatenate([point, lost]), np.concatenate([region, tagged[lost]])
        value = np.concatenate([value, np.ones(len(lost))])
        kept = np.flatnonzero(value > 0.0)
        kept = kept[np.lexsort((region[kept], point[kept]))]
        point, value = point[kept], value[kept]
        counts = np.bincount(point, minlength=len(points))
        total = np.bincount(point, value, len(points))
        first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
        return Weights(first, region[kept].astype(np.int32), value / total[point])

    def _counting(self, points: Float64Array) -> tuple[Int64Array, Int64Array, Float64Array]:
        """Pairs of points and regions, and what the regions count there before all is normalised."""
        point, region = self._near(points)
        return point, region, self._value(point, region, points)

    def _near(self, points: Float64Array) -> tuple[Int64Array, Int64Array]:
        """Pairs of points and regions whose grown boxes hold them."""
        low, high = self._boxes.minimum - self._margin, self._boxes.maximum + self._margin
        size = max(1, _PAIRS_AT_ONCE // len(low))
        found: list[Int64Array] = []
        for begin in range(0, len(points), size):
            part = points[begin : begin + size]
            held = np.ones((len(part), len(low)), np.bool_)
            for axis in range(3):
                held &= (part[:, axis, None] > low[:, axis]) & (part[:, axis, None] < high[:, axis])
            pairs = np.argwhere(held)
            pairs[:, 0] += begin
            found.append(pairs)
        pairs = np.concatenate(found) if found else np.empty((0, 2), np.int64)
        return pairs[:, 0], pairs[:, 1]

    def _value(self, point: Int64Array, region: Int64Array, points: Float64Array) -> Float64Array:
        place, margin = points[point], self._margin[region]
        inner = np.minimum(place - self._boxes.minimum[region], self._boxes.maximum[region] - place) / margin
        depth = inner.min(axis=1)
        grown = smoothstep(0.5 * (depth + 1.0)) * self._at_gates(region, place)
        clamped = self._boxes.clamped(region.astype(np.int32), place)
        reached = np.maximum(self._boxes.open_share(region, clamped), _UNREACHABLE)
        return np.maximum(smoothstep(depth), grown) * reached

    def _at_gates(self, region: Int64Array, place: Float64Array) -> Float64Array:
        """1 near what a region shares with a neighbour, falling to 0 away from it, shape (n,)."""
        count = np.diff(self._first_gate)[region]
        near = np.zeros(len(region))
        rows = np.flatnonzero(count)
        if not len(rows):
            return near
        begin = np.concatenate([[0], np.cumsum(count[rows])[:-1]])
        row = np.repeat(rows, count[rows])
        gate = self._first_gate[region[row]] + np.arange(len(row)) - np.repeat(begin, count[rows])
        margin, p = self._margin[region[row]], place[row]
        inside = np.minimum(p - self._gate_low[gate], self._gate_high[gate] - p) / margin
        near[rows] = np.maximum.reduceat(smoothstep(inside.min(axis=1) + 2.0), begin)
        return near

    def _gates(self, graph: RegionGraph) -> tuple[Int64Array, Float64Array, Float64Array]:
        """What each region shares with its neighbours, sorted by region: firsts, shape (r + 1,), and boxes."""
        a, b = graph.link.reshape(-1, 2).T
        low = np.maximum(graph.minimum[a], graph.minimum[b])
        high = np.minimum(graph.maximum[a], graph.maximum[b])
        low, high = np.minimum(low, high), np.maximum(low, high)  # a gap between the boxes is shared like an overlap
        owner = np.concatenate([a, b])
        order = np.argsort(owner, kind="stable")
        first = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=len(graph)))]).astype(np.int64)
        return first, np.concatenate([low, low])[order], np.concatenate([high, high])[order]


def _gaps(graph: RegionGraph) -> Float64Array:
    """How far each region is from linked neighbours that it does not touch, shape (r, 3): a wall, along each axis."""
    gaps = np.zeros((len(graph), 3))
    a, b = graph.link.reshape(-1, 2).T
    apart = np.maximum(graph.minimum[a], graph.minimum[b]) - np.minimum(graph.maximum[a], graph.maximum[b])
    apart[apart > LARGEST_MARGIN] = 0.0  # no wall: whoever linked these regions meant something else
    np.maximum.at(gaps, a, apart)
    np.maximum.at(gaps, b, apart)
    return gaps


def smoothstep(x: Float64Array) -> Float64Array:
    """3x² - 2x³ for x in [0, 1], 0 below and 1 above."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)
