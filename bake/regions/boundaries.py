"""The part of a boundary between two regions that is open: its area and its middle."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from bake.regions.free_space import FreeSpace
from bake.regions.links import Sections, boundary_sections, other_sections
from bake.regions.sees import sees_region
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array

SPACING = 0.4
"""Metres between the places where a boundary is tried: an ordinary door has several."""

_FEWEST, _MOST = 4, 24  # places along an edge
_MOST_AGAIN = 6  # the same, where a boundary is sought a second time
_PLACES_AT_ONCE = 1 << 18


@dataclass(frozen=True, slots=True)
class Openings:
    """What is open between the regions of each pair.

    Attributes:
        area: Shape (p,), square metres; 0 where nothing is open.
        centre: Shape (p, 3): the open place nearest the middle of all open ones; NaN where nothing is open.
    """

    area: Float64Array
    centre: Float64Array


def measure_openings(
    minimum: Float64Array,
    maximum: Float64Array,
    valid: BoolArray,
    seed: Float64Array,
    pairs: Int32Array,
    free: FreeSpace,
) -> Openings:
    """How much of each pair's boundary joins the free space of both regions.

    The boundary is tried at evenly spread places. One counts where the gap between the boxes, if there is one, can be
    crossed, and where a valid grid point, or the seed, of either region can be seen from it.

    Args:
        minimum, maximum: Shape (r, 3), boxes.
        valid: Shape (r, GRID³), the valid grid points.
        seed: Shape (r, 3).
        pairs: Shape (p, 2).
        free: What blocks.
    """
    area, centre = _measured(
        boundary_sections(minimum, maximum, pairs), _MOST, minimum, maximum, valid, seed, pairs, free
    )
    closed = np.flatnonzero(area == 0.0)
    if len(closed):
        others = other_sections(minimum, maximum, pairs[closed])
        # Each of these is asked on its own, and the widest opening taken.
        asked = pairs[closed[others.pair]]
        single = dataclasses.replace(others, pair=np.arange(len(others)))
        found, middle = _measured(single, _MOST_AGAIN, minimum, maximum, valid, seed, asked, free)
        order = np.lexsort((found, others.pair))
        widest = order[np.append(np.diff(others.pair[order]) != 0, True)] if len(order) else order
        area[closed[others.pair[widest]]], centre[closed[others.pair[widest]]] = found[widest], middle[widest]
    return Openings(area, centre)


def _measured(
    sections: Sections,
    most: int,
    minimum: Float64Array,
    maximum: Float64Array,
    valid: BoolArray,
    seed: Float64Array,
    pairs: Int32Array,
    free: FreeSpace,
) -> tuple[Float64Array, Float64Array]:
    """Open area of each pair over its sections, shape (p,), and the middle of it, shape (p, 3)."""
    section, places, weight = _places(sections, most)
    moment = np.zeros((len(pairs), 3))
    pair = sections.pair[section]
    is_open = np.zeros(len(places), np.bool_)
    for begin in range(0, len(places), _PLACES_AT_ONCE):
        part = slice(begin, begin + _PLACES_AT_ONCE)
        crossed = _crosses_gap(places[part], sections, section[part], free)
        still = begin + np.flatnonzero(crossed)
        for side in (0, 1):
            region = pairs[pair[still], side]
            still = still[sees_region(places[still], region, minimum, maximum, valid, seed, free)]
        is_open[still] = True
    area = np.bincount(pair[is_open], weights=weight[is_open], minlength=len(pairs)).astype(np.float64)
    for axis in range(3):
        weighted = weight[is_open] * places[is_open, axis]
        moment[:, axis] = np.bincount(pair[is_open], weights=weighted, minlength=len(pairs))
    mean = moment / np.where(area > 0.0, area, np.nan)[:, None]
    return area, _nearest_places(mean, places[is_open], pair[is_open])


def _places(sections: Sections, most: int) -> tuple[Int64Array, Float64Array, Float64Array]:
    """Places spread over sections: the section of each, shape (n,), position, (n, 3), and its share of area, (n,)."""
    count = len(sections)
    other = (sections.axis[:, None] + np.array([1, 2])) % 3
    row = np.arange(count)[:, None]
    edge = (sections.maximum - sections.minimum)[row, other]
    steps = np.clip(np.ceil(edge / SPACING), _FEWEST, most).astype(np.int64)
    total = steps.prod(axis=1)
    section = np.repeat(np.arange(count), total)
    within = np.arange(len(section)) - np.repeat(np.cumsum(total) - total, total)
    u = (within // steps[section, 1] + 0.5) / steps[section, 0]
    v = (within % steps[section, 1] + 0.5) / steps[section, 1]
    places = sections.minimum[section].copy()
    number = np.arange(len(section))
    places[number, other[section, 0]] += u * edge[section, 0]
    places[number, other[section, 1]] += v * edge[section, 1]
    return section, places, (edge.prod(axis=1) / total)[section]


def _crosses_gap(places: Float64Array, sections: Sections, section: Int64Array, free: FreeSpace) -> BoolArray:
    """Whether one can go straight from box to box at each place."""
    half = 0.5 * sections.gap[section]
    crossed = np.ones(len(places), np.bool_)
    gap = np.flatnonzero(half > 0.0)
    way = np.zeros((len(gap), 3))
    way[np.arange(len(gap)), sections.axis[section[gap]]] = half[gap]
    crossed[gap] = free.clear(places[gap] - way, places[gap] + way)
    return crossed


def _nearest_places(mean: Float64Array, places: Float64Array, pair: Int64Array) -> Float64Array:
    """The place of each pair that lies nearest its mean, shape (p, 3): the mean itself may lie in a wall."""
    centre = np.full(mean.shape, np.nan)
    away = ((places - mean[pair]) ** 2).sum(axis=1)
    order = np.lexsort((away, pair))
    first = order[np.append(True, np.diff(pair[order]) != 0)] if len(order) else order
    centre[pair[first]] = places[first]
    return centre
