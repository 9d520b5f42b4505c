"""Which vertices lie at the same place: the connectivity that a file of split vertices does not store."""

from __future__ import annotations

import numpy as np

from bake.equal_rows import UInt64Array, number_rows
from bake.scene.remembered import remembered
from bake.triangles import columns
from bake.types import Float64Array, Int64Array


def weld_positions(positions: Float64Array) -> Int64Array:
    """Numbers the distinct positions; vertices at exactly the same place share a number.

    Args:
        positions: Shape (n, 3), finite.

    Returns:
        Shape (n,), int64, values in [0, number of distinct positions).
    """
    return number_rows(columns(positions))[0]


def places_of(positions: Float64Array) -> Int64Array:
    """A number for each vertex, equal exactly where positions are: that of the first vertex at the place.

    Neighbours in the file have near numbers, so that what is sorted by them finds its neighbours in the cache.

    Args:
        positions: Shape (n, 3), finite.

    Returns:
        Shape (n,), int64, in [0, n).
    """
    number, first = number_rows(columns(positions))
    return first[number]


known_places = remembered(places_of)
"""The same for the positions of meshes, which stay as they are."""


def edge_keys(start: Int64Array, end: Int64Array) -> UInt64Array:
    """One key per undirected edge between welded vertices below 2³², shape as the arguments, uint64."""
    low, high = np.minimum(start, end).astype(np.uint64), np.maximum(start, end).astype(np.uint64)
    return (low << np.uint64(32)) | high
