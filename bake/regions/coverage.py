"""How much of the walkable floor regions serve."""

from __future__ import annotations

import numpy as np

from bake.region_types import GRID
from bake.regions.free_space import FreeSpace
from bake.regions.sees import sees_region
from bake.types import BoolArray, Float64Array

_TESTS_AT_ONCE = 1 << 22


def coverage(
    minimum: Float64Array,
    maximum: Float64Array,
    valid: BoolArray,
    seed: Float64Array,
    points: Float64Array,
    free: FreeSpace,
) -> float:
    """Share of points that lie in a region and see one of its valid grid points around them, or its seed.

    A box over a point is not enough: behind a wall, its model would be wrong there.

    Args:
        minimum, maximum: Shape (r, 3), boxes.
        valid: Shape (r · GRID³,) or (r, GRID³).
        seed: Shape (r, 3).
        points: Shape (n, 3), such as `AutomaticRegions.points`.
        free: What blocks.

    Returns:
        In [0, 1]; NaN without points.
    """
    if len(points) == 0:
        return float("nan")
    valid = valid.reshape(len(minimum), GRID**3)
    served = np.zeros(len(points), np.bool_)
    at_once = max(1, _TESTS_AT_ONCE // max(len(minimum), 1))
    for begin in range(0, len(points), at_once):
        part = points[begin : begin + at_once]
        held = np.ones((len(part), len(minimum)), np.bool_)
        for axis in range(3):
            along = part[:, axis, None]
            held &= (along >= minimum[:, axis]) & (along <= maximum[:, axis])
        point, region = np.nonzero(held)
        sees = sees_region(part[point], region, minimum, maximum, valid, seed, free)
        served[begin + point[sees]] = True
    return float(served.mean())
