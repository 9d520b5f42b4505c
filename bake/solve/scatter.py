"""Sums of values by index: the one operation that assembles everything here."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.types import Float64Array


def scatter_add(index: NDArray[np.integer[Any]], values: Float64Array, size: int) -> Float64Array:
    """Sums `values` into `size` bins, shape (size,), float64, in the order of the values.

    Args:
        index: Bin of each value; any shape.
        values: Same shape as `index`.
        size: Number of bins.
    """
    summed: Any = np.bincount(index.ravel(), values.ravel(), minlength=size)
    return summed.astype(np.float64, copy=False)  # an empty index would give integers
