"""Gives floor that no rectangle has to a rectangle beside it, which is enlarged for it."""

from __future__ import annotations

import numpy as np

from bake.regions.floors import Floors
from bake.regions.rectangles import Rectangles
from bake.types import BoolArray, Int64Array

_STRETCH = 1.25  # how far a rectangle's edges and rise may go beyond their limits for it
_WASTE = 0.6  # share of the rectangle by which it may grow
_PASSES = 3


def attach_remnants(floors: Floors, air: BoolArray, rectangles: Rectangles) -> None:
    """Enlarges rectangles to take up connected remnants of floor beside them.

    Each goes to the neighbour that need grow least; one for which all would grow too much stays. As it touches floor
    of that neighbour, it can be reached inside the enlarged box.

    Args:
        floors: All cells.
        air: Shape (n,), bool: the cells that shall be covered.
        rectangles: Changed in place.
    """
    for _ in range(_PASSES):
        if not _attach(floors, air, rectangles):
            break


def _attach(floors: Floors, air: BoolArray, rectangles: Rectangles) -> int:
    left = np.flatnonzero(air & (rectangles.owner < 0))
    if len(left) == 0 or len(rectangles) == 0:
        return 0
    part = floors.parts(left)
    order = np.argsort(part, kind="stable")
    first = np.flatnonzero(np.append(True, np.diff(part[order]) != 0))
    size = np.diff(np.append(first, len(left)))
    i, j = floors.column[left[order]] // floors.plan.shape[1], floors.column[left[order]] % floors.plan.shape[1]
    box = np.stack(
        [extreme.reduceat(values, first) for extreme in (np.minimum, np.maximum) for values in (i, j)], axis=1
    )
    floor = floors.floor[left[order]]
    heights = np.stack([np.minimum.reduceat(floor, first), np.maximum.reduceat(floor, first)], axis=1)

    touching: list[Int64Array] = []
    for side in range(4):
        beside = floors.beside[left, side]
        owner = np.where(beside >= 0, rectangles.owner[beside], -1)
        touching.append(np.stack([part[owner >= 0], owner[owner >= 0]]).astype(np.int64))
    pairs = np.unique(np.concatenate(touching, axis=1), axis=1)
    bounds = np.searchsorted(pairs[0], np.arange(len(first) + 1))
    taken = 0
    for number in np.argsort(-size, kind="stable").tolist():
        candidates = pairs[1, bounds[number] : bounds[number + 1]]
        lowest, highest = float(heights[number, 0]), float(heights[number, 1])
        chosen = _least_growth(rectangles, candidates, box[number], lowest, highest)
        if chosen < 0:
            continue
        rectangles.enlarge(chosen, box[number], lowest, highest)
        cells = left[order[first[number] : first[number] + size[number]]]
        rectangles.give(chosen, cells)
        taken += 1
    return taken


def _least_growth(
    rectangles: Rectangles, candidates: Int64Array, box: Int64Array, lowest: float, highest: float
) -> int:
    """The candidate that grows least for a box of columns, or -1."""
    if len(candidates) == 0:
        return -1
    own = rectangles.corners[candidates]
    grown = np.concatenate([np.minimum(own[:, :2], box[:2]), np.maximum(own[:, 2:], box[2:])], axis=1)
    size, grown_size = own[:, 2:] - own[:, :2] + 1, grown[:, 2:] - grown[:, :2] + 1
    rise = np.maximum(rectangles.floor[candidates, 1], highest) - np.minimum(rectangles.floor[candidates, 0], lowest)
    growth = grown_size.prod(axis=1) - size.prod(axis=1)
    fits = (grown_size <= np.maximum(_STRETCH * rectangles.most, size)).all(axis=1)
    fits &= (rise <= _STRETCH * rectangles.rise) & (growth <= _WASTE * size.prod(axis=1))
    best = int(np.where(fits, growth, np.iinfo(np.int64).max).argmin())
    return int(candidates[best]) if fits[best] else -1
