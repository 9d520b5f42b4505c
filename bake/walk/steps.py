"""How much AO changes from frame to frame, and how much of that a screen shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bake.types import BoolArray, Float64Array


def steps(ao: NDArray[np.floating], teleported: BoolArray) -> Float64Array:
    """AO less that of the frame before, shape (n, m); 0 on frames to which no step leads."""
    values = ao.astype(np.float64)
    changes: Float64Array = np.diff(values, axis=0, prepend=values[:1])
    changes[teleported] = 0.0
    return changes


def codes(ao: NDArray[np.floating]) -> Float64Array:
    """8-bit sRGB codes of AO under an ambient light of 1.0, unrounded, in [0, 255] (IEC 61966-2-1)."""
    linear = np.clip(ao.astype(np.float64), 0.0, 1.0)
    curved = 1.055 * np.power(linear, 1.0 / 2.4) - 0.055
    return 255.0 * np.where(linear <= 0.0031308, 12.92 * linear, curved)
