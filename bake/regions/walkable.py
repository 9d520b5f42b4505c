"""Which floors belong to the level: not every roof and table that could be stood on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.regions.floors import STEP, Floors
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array

SMALLEST = 4.0
"""Square metres: a floor apart from all others is a place of its own from this size on."""

LEAST = 1.0
"""Square metres: no floor at all is smaller."""

LARGEST_OBSTACLE = 25.0
"""Square metres: what lies within a ledge of a floor and is no larger, such as a table, has its air with it."""


@dataclass(frozen=True, slots=True)
class Walkable:
    """The cells of floor that count.

    Attributes:
        floors: All cells.
        walked: Shape (n,), bool: on a floor of the level.
        air: Shape (n,), bool: walked, or on an obstacle over which its air reaches.
    """

    floors: Floors
    walked: BoolArray
    air: BoolArray


def choose_walkable(floors: Floors, seeds: Float64Array | None = None) -> Walkable:
    """Chooses among the floors that steps connect.

    With seeds, those below them. Without, each that is large enough and is neither the top of something (on most open
    sides it falls off to lower ground) nor a roof (open at most sides, with free space under most of it); the largest
    that is no roof counts always, if it has a square metre.

    Args:
        floors: All cells.
        seeds: Shape (s, 3), (u, v, height), or None.
    """
    if len(floors) == 0:
        return Walkable(floors, np.zeros(0, np.bool_), np.zeros(0, np.bool_))
    label = floors.parts(np.arange(len(floors)), climb=STEP)
    cells = np.bincount(label)
    wanted = _below_seeds(floors, label, seeds) if seeds is not None else _likely(floors, label, cells)
    walked = wanted[label]
    small = cells * floors.plan.cell**2 <= LARGEST_OBSTACLE
    touched = np.zeros(len(cells), np.bool_)
    for side in range(4):
        other = floors.beside[:, side]
        touched[label[(other >= 0) & walked[other]]] = True
    return Walkable(floors, walked, (wanted | (touched & small))[label])


def _likely(floors: Floors, label: Int32Array, cells: Int64Array) -> BoolArray:
    count = len(cells)
    sides = np.bincount(label, weights=(floors.beside < 0).sum(axis=1), minlength=count)
    falls = np.bincount(label, weights=floors.falls, minlength=count)
    edges = np.bincount(label, weights=floors.edges, minlength=count)
    hollow = np.bincount(label, weights=floors.below, minlength=count)
    roof = (hollow > 0.5 * cells) & (falls + edges > 0.5 * sides)
    top = falls > 0.5 * sides
    wanted = (cells * floors.plan.cell**2 >= SMALLEST) & ~roof & ~top
    largest = np.where(roof, 0, cells).argmax() if not roof.all() else cells.argmax()
    wanted[largest] |= cells[largest] * floors.plan.cell**2 >= LEAST
    return wanted


def _below_seeds(floors: Floors, label: Int32Array, seeds: Float64Array) -> BoolArray:
    """The floors on which seeds stand, or that are nearest below them; a seed over no floor is without effect."""
    wanted = np.zeros(int(label.max()) + 1, np.bool_)
    shape = np.array(floors.plan.shape)
    place = np.floor((seeds[:, :2] - floors.plan.low) / floors.plan.cell).astype(np.int64)
    for (i, j), height in zip(place.tolist(), seeds[:, 2].tolist(), strict=True):
        if not (0 <= i < shape[0] and 0 <= j < shape[1]):
            continue
        column = i * shape[1] + j
        cell = np.arange(int(floors.first[column]), int(floors.first[column + 1]))
        cell = cell[(floors.floor[cell] <= height + STEP) & (floors.ceiling[cell] >= height)]
        if len(cell):
            wanted[label[cell[-1]]] = True
    return wanted
