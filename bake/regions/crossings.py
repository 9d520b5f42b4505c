"""Where a character may cross from region to region: the places at which neighbouring models shall agree.

The middle of a boundary alone does not do. Boxes overlap, and whoever walks through what they share changes region
wherever the tags change, metres away from the middle; there, models that agree in the middle may still be far apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.arrays import BoolArray, Float64Array, Int64Array
from bake.region_types import RegionGraph, RegionPoints
from bake.regions.boxes import Boxes

MARGIN = 0.2
"""Metres by which a neighbour must hold a character better before it counts, so that it may stroll on a boundary."""

MOST = 17
"""Places of a link: its middle, the eight outermost, and eight spread between them."""

_SPREAD = 8
_TRIED = 256
_SLACK = 0.05  # metres beyond the margin within which a place still counts
_FARTHER = 0.1  # the same beyond the best place, where no place comes that close
_LINKS_AT_ONCE = 512
_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


@dataclass(frozen=True, slots=True)
class Crossings:
    """Places on the boundary of each link.

    Attributes:
        position: Shape (l, MOST, 3): metres relative to `World.origin`; the first is the link's middle.
        counts: Shape (l, MOST), bool: which rows are places; the others repeat the middle.
    """

    position: Float64Array
    counts: BoolArray


def middles(graph: RegionGraph) -> Crossings:
    """The middle of each boundary alone (Sloan et al. 2013)."""
    return Crossings(graph.link_centre[:, None, :], np.ones((len(graph.link), 1), np.bool_))


def find_crossings(graph: RegionGraph, points: RegionPoints) -> Crossings:
    """Places where the tag of a character may change from either region of a link to the other.

    Evenly spread places of what the boxes share are looked at. Those count that both regions reach, and at which
    neither holds a character better by more than `MARGIN`. Of these the outermost toward the eight corners are taken,
    since models are bent planes that differ most there, and the first few of the others.

    Args:
        graph: The regions and their links.
        points: Their grid points.
    """
    boxes = Boxes(graph, points)
    sequence = _halton(_TRIED)
    position = np.repeat(graph.link_centre[:, None, :], MOST, axis=1)
    counts = np.zeros((len(graph.link), MOST), np.bool_)
    counts[:, 0] = True
    for begin in range(0, len(graph.link), _LINKS_AT_ONCE):
        part = slice(begin, begin + _LINKS_AT_ONCE)
        a, b = graph.link[part].T
        low, high = np.maximum(graph.minimum[a], graph.minimum[b]), np.minimum(graph.maximum[a], graph.maximum[b])
        low, high = np.minimum(low, high), np.maximum(low, high)  # a gap between the boxes is shared like an overlap
        places = low[:, None] + sequence * (high - low)[:, None]
        link, place = np.nonzero(_chosen(_crossed(boxes, a, b, places), sequence))
        row = np.arange(len(link)) - np.searchsorted(link, np.arange(len(a)))[link] + 1
        position[begin + link, row] = places[link, place]
        counts[begin + link, row] = True
    return Crossings(position, counts)


def _crossed(boxes: Boxes, a: np.ndarray, b: np.ndarray, places: Float64Array) -> BoolArray:
    """At which places, shape (l, n, 3), tags may change between the regions a and b, shape (l,)."""
    count = places.shape[1]
    sides = [np.repeat(side, count).astype(np.int64) for side in (a, b)]
    flat = places.reshape(-1, 3)
    held = [boxes.held_depth(side, boxes.clamped(side, flat)) for side in sides]
    away = np.maximum(np.abs(held[0] - held[1]) - MARGIN - _SLACK, 0.0).reshape(-1, count)
    reached = np.ones(len(flat), np.bool_)
    for side in sides:
        rows = np.flatnonzero(reached)
        reached[rows] = boxes.open_share(side[rows], boxes.clamped(side[rows], flat[rows])) > 0.0
    away[~reached.reshape(-1, count)] = np.inf
    return np.isfinite(away) & (away <= away.min(axis=1, keepdims=True) + _FARTHER)


def _chosen(crossed: BoolArray, sequence: Float64Array) -> BoolArray:
    """Some of the places at which regions are crossed, shape (l, n): MOST - 1 at most."""
    chosen = crossed & (np.cumsum(crossed, axis=1) <= _SPREAD)
    link = np.flatnonzero(crossed.any(axis=1))
    for corner in _CORNERS:
        outermost = np.where(crossed[link], sequence @ corner, -np.inf).argmax(axis=1)
        chosen[link, outermost] = True
    return chosen


def _halton(count: int) -> Float64Array:
    """Evenly spread points of the unit cube, shape (count, 3) (Halton 1960)."""
    points = np.zeros((count, 3))
    for axis, base in enumerate((2, 3, 5)):
        rest: Int64Array = np.arange(1, count + 1)
        share = 1.0
        while rest.any():
            share /= base
            points[:, axis] += share * (rest % base)
            rest //= base
    return points
