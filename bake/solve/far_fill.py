"""Values for components without any valid sample: those of the nearest vertices in space, wherever in the scene.

Only they look beyond their own block, so that they are kept apart: where each takes its value from, and how far that
is. An edit then asks only whether something nearer came up, or whether that source is gone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bake.solve.average import OPEN, nearest_among
from bake.solve.block import Block
from bake.solve.system import Equations
from bake.types import BoolArray, Int64Array


def lost_unknowns(block: Block, starved: BoolArray) -> Int64Array:
    """The unknowns of components that have no valid sample at all, sorted."""
    first = block.surface.first
    if len(first) < 2 or not starved.any():
        return np.zeros(0, np.int64)
    return np.flatnonzero(np.repeat(np.logical_and.reduceat(starved, first[:-1]), np.diff(first)))


def fill_from_afar(blocks: Sequence[Block], equations: Sequence[Equations]) -> list[Equations]:
    """The equations with the averages of components without samples taken from the whole scene.

    Args:
        blocks: All of the scene, in order.
        equations: As their own blocks have them.
    """
    wanted = [lost_unknowns(block, own.starved) for block, own in zip(blocks, equations, strict=True)]
    if not any(len(lost) for lost in wanted):
        return list(equations)
    known = [np.flatnonzero(~own.starved) for own in equations]
    columns = equations[0].average.shape[1]
    position = np.concatenate([block.surface.position[rows] for block, rows in zip(blocks, known, strict=True)])
    average = np.concatenate([own.average[rows] for own, rows in zip(equations, known, strict=True)])
    asked = np.concatenate([block.surface.position[lost] for block, lost in zip(blocks, wanted, strict=True)])
    if len(position):
        every = np.concatenate([position, asked])
        source = nearest_among(every, np.arange(len(position)), np.arange(len(position), len(every)))
        values = average[source]
    else:
        values = np.full((len(asked), columns), OPEN)
    filled: list[Equations] = []
    begin = 0
    for own, lost in zip(equations, wanted, strict=True):
        found = values[begin : begin + len(lost)]
        begin += len(lost)
        if len(lost) and not np.array_equal(found, own.average[lost]):
            mean = own.average.copy()
            mean[lost] = found
            own = replace(own, average=mean)
        filled.append(own)
    return filled
