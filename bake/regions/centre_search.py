"""A better centre for each region's model, by pattern search."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bake.arrays import BoolArray, Float64Array

_FIRST_STEP = 0.25  # in half extents
_LAST_STEP = 0.01
_MOST_ROUNDS = 48
_LEAST_GAIN = 1e-6  # of the squared error, below which a move is noise


def search_centres(
    error: Callable[[Float64Array], Float64Array], start: Float64Array, middle: Float64Array, half: Float64Array
) -> tuple[Float64Array, BoolArray]:
    """Moves each centre along the axes while that lowers its error, in steps that halve where nothing does.

    The derivatives are solved for anew at each centre, so that only the three coordinates are searched, as in variable
    projection (Golub and Pereyra 1973). The error has kinks where a centre passes a plane of the grid, which is why
    no derivative of it is used. All regions are searched at once.

    Args:
        error: Squared errors, shape (r,), of centres of shape (r, 3).
        start: Shape (r, 3).
        middle, half: Shape (r, 3): the boxes; centres stay inside.

    Returns:
        Centres, shape (r, 3), and which of them are better than where they started, shape (r,).
    """
    best, least = start.copy(), error(start)
    first = least.copy()
    step = np.full(len(start), _FIRST_STEP)
    for _ in range(_MOST_ROUNDS):
        searching = step >= _LAST_STEP
        if not searching.any():
            break
        moved, lowest = best.copy(), least.copy()
        for axis in range(3):
            for sign in (1.0, -1.0):
                tried = best.copy()
                tried[:, axis] += sign * step * half[:, axis]
                tried = np.clip(tried, middle - half, middle + half)
                found = error(tried)
                better = searching & (found < lowest)
                moved[better], lowest[better] = tried[better], found[better]
        gained = lowest < least * (1.0 - _LEAST_GAIN)
        best[gained], least[gained] = moved[gained], lowest[gained]
        step[~gained] *= 0.5
    return best, least < first * (1.0 - _LEAST_GAIN)
