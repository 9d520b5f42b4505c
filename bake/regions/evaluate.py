"""The model of a region at a point and a normal: the reference that every other evaluation is held to."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake import spherical_harmonics
from bake.arrays import Float32Array, Float64Array
from bake.region_types import PARAMETERS, RegionModels

AXIS_NORMALS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], np.float64)
"""The six normals over which errors and mismatches are taken."""

_COEFFICIENTS = {1: 1, 2: 4, 3: 9}
_POINTS_A_PART = 1 << 15


def evaluate(
    models: RegionModels,
    region: NDArray[np.integer[Any]] | int,
    positions: NDArray[np.floating[Any]],
    normals: NDArray[np.floating[Any]],
    *,
    bands: int = 3,
    clamp: bool = True,
) -> Float32Array:
    """AO at points about normals (Sloan et al. 2013, equation 4).

    Args:
        models: One a region.
        region: Shape (n,), or one for all: whose model is meant; the point may lie outside its box.
        positions: Shape (n, 3), metres relative to `World.origin`.
        normals: Shape (n, 3), or (3,) for all; unit.
        bands: 3 for the quadratic harmonics that are stored, 2 for the linear ones that an engine evaluates.
        clamp: Cut off at 0 and 1, as an engine does at the very end.

    Returns:
        Shape (n, k), float32.
    """
    positions = np.asarray(positions, np.float64)
    numbers = np.broadcast_to(np.asarray(region), (len(positions),))
    normals = np.broadcast_to(np.asarray(normals, np.float64), positions.shape)
    ao = np.empty((len(positions), models.coefficients.shape[3]))
    for begin in range(0, len(positions), _POINTS_A_PART):
        part = slice(begin, begin + _POINTS_A_PART)
        ao[part] = ambient_obscurance(harmonics(models, numbers[part], positions[part]), normals[part], bands=bands)
    return (np.clip(ao, 0.0, 1.0) if clamp else ao).astype(np.float32)


def harmonics(
    models: RegionModels, region: NDArray[np.integer[Any]], positions: NDArray[np.floating[Any]]
) -> Float64Array:
    """A region's harmonics at points, shape (n, 9, k): what a runtime blends in time, for it is linear in them.

    Args:
        models: One a region.
        region: Shape (n,).
        positions: Shape (n, 3), metres relative to `World.origin`.
    """
    weights = basis(positions - models.centre[region])
    return np.einsum("np,npck->nck", weights, models.coefficients[region])


def ambient_obscurance(sh: NDArray[np.floating[Any]], normals: Float64Array, *, bands: int = 3) -> Float64Array:
    """AO about normals from convolved harmonics, shapes (n, 9, k) and (n, 3) → (n, k); nothing is cut off."""
    count = _COEFFICIENTS[bands]
    return np.einsum("nc,nck->nk", spherical_harmonics.evaluate(normals)[:, :count], sh[:, :count])


def basis(offsets: NDArray[np.floating[Any]]) -> Float64Array:
    """What multiplies a model's parameters at offsets p - c, shape (..., 3) → (..., 7).

    One, then each coordinate on its positive and on its negative side: with one-sided derivatives the model bends at
    its centre, so that a room can darken toward all of its walls.
    """
    weights = np.empty((*offsets.shape[:-1], PARAMETERS))
    weights[..., 0] = 1.0
    weights[..., 1::2] = np.maximum(offsets, 0.0)
    weights[..., 2::2] = np.minimum(offsets, 0.0)
    return weights
