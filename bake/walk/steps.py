"""How much AO changes from frame to frame, and how much of that a screen shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bake.types import BoolArray, Float64Array


@dataclass(frozen=True, slots=True)
class Steps:
    """The steps of one variant. What is not known does not step, nor does a teleport.

    Attributes:
        ao: Shape (n, m): AO less that of the frame before.
        codes: Shape (n, m): the same in 8-bit sRGB codes, 0 or more.
        largest: Shape (n,): of |ao| over the normals.
        largest_codes: Shape (n,): of codes over the normals.
    """

    ao: Float64Array
    codes: Float64Array
    largest: Float64Array
    largest_codes: Float64Array


def measure_steps(ao: NDArray[np.floating], teleported: BoolArray) -> Steps:
    """Steps of AO, shape (n, m), in [0, 1] or NaN."""
    changes = np.nan_to_num(steps(ao, teleported), copy=False)
    in_codes = np.abs(np.nan_to_num(steps(codes(ao), teleported), copy=False))
    return Steps(changes, in_codes, _largest(np.abs(changes)), _largest(in_codes))


def steps(ao: NDArray[np.floating], teleported: BoolArray) -> Float64Array:
    """AO less that of the frame before, shape (n, m); 0 on frames to which no step leads."""
    values = ao.astype(np.float64)
    changes = np.empty_like(values)
    changes[:1] = 0.0
    np.subtract(values[1:], values[:-1], out=changes[1:])
    changes[teleported] = 0.0
    return changes


def codes(ao: NDArray[np.floating]) -> Float64Array:
    """8-bit sRGB codes of AO under an ambient light of 1.0, unrounded, in [0, 255] (IEC 61966-2-1)."""
    linear = np.clip(ao.astype(np.float64), 0.0, 1.0)
    curved = 1.055 * np.power(linear, 1.0 / 2.4) - 0.055
    return 255.0 * np.where(linear <= 0.0031308, 12.92 * linear, curved)


def _largest(values: Float64Array) -> Float64Array:
    """Over a few columns, of which NumPy would make a loop for each row."""
    largest = values[:, 0].copy()
    for column in values.T[1:]:
        np.maximum(largest, column, out=largest)
    return largest
