"""Whether places belong to the free space of a region: whether they see its valid grid points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bake.region_types import GRID
from bake.regions.free_space import FreeSpace
from bake.types import BoolArray, Float64Array, Int64Array

_PLACES_AT_ONCE = 1 << 17


def sees_region(
    places: Float64Array,
    region: NDArray[np.integer],
    minimum: Float64Array,
    maximum: Float64Array,
    valid: BoolArray,
    seed: Float64Array,
    free: FreeSpace,
) -> BoolArray:
    """Whether each place sees a valid grid point around it, or else the seed, of its region.

    Args:
        places: Shape (n, 3); outside its region's box, a place looks for the points nearest to it.
        region: Shape (n,).
        minimum, maximum: Shape (r, 3), boxes.
        valid: Shape (r, GRID³).
        seed: Shape (r, 3); NaN for none.
        free: What blocks.

    Returns:
        Shape (n,).
    """
    sees = np.zeros(len(places), np.bool_)
    for begin in range(0, len(places), _PLACES_AT_ONCE):
        part = slice(begin, begin + _PLACES_AT_ONCE)
        here = region[part]
        sees[part] = _sees(places[part], here, minimum[here], maximum[here], valid, free)
    asked = np.flatnonzero(~sees & np.isfinite(seed[region]).all(axis=1))
    sees[asked] = free.clear(places[asked], seed[region[asked]])
    return sees


def _sees(
    places: Float64Array,
    region: NDArray[np.integer],
    low: Float64Array,
    high: Float64Array,
    valid: BoolArray,
    free: FreeSpace,
) -> BoolArray:
    """Whether places see one of the eight grid points about them; `low` and `high` are their regions' boxes."""
    size = high - low
    cell = np.clip((places - low) / size * GRID - 0.5, 0.0, GRID - 1.0)
    first = np.minimum(np.floor(cell).astype(np.int64), GRID - 2)
    corner: Int64Array = first[:, None] + np.array([[c >> 2 & 1, c >> 1 & 1, c & 1] for c in range(8)])
    usable = valid[region[:, None], (corner * np.array([GRID * GRID, GRID, 1])).sum(axis=2)]
    away = (((corner - cell[:, None]) * size[:, None]) ** 2).sum(axis=2)
    order = np.argsort(np.where(usable, away, np.inf), axis=1)
    row = np.arange(len(places))
    sees = np.zeros(len(places), np.bool_)
    for attempt in range(8):
        chosen = order[:, attempt]
        ask = np.flatnonzero(~sees & usable[row, chosen])
        if len(ask) == 0:
            break
        point = low[ask] + (corner[ask, chosen[ask]] + 0.5) / GRID * size[ask]
        sees[ask] = free.clear(places[ask], point)
    return sees
