"""Models as an engine keeps them: linear harmonics of one function, 128 bytes each.

A model is eight vectors of four float32: its centre, then its mean and the derivatives toward +x, -x, +y, -y, +z, -z.
The four numbers of the mean and of each derivative are the factors of a normal's x, y and z, and the constant, so that
AO is one dot product with (n, 1). Evaluating one is a vector difference, three multiply-adds and that product.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake import spherical_harmonics
from bake.arrays import Float32Array, Float64Array, Int32Array, Int64Array
from bake.region_types import RegionModels, Regions

ROWS = 8
MODEL_BYTES = ROWS * 4 * 4
INDEX_BYTES = 2
"""What a region needs besides: the number of its model."""

_NORMAL_ORDER = [3, 1, 2, 0]  # of the stored harmonics: x, y, z, constant
_SCALE = np.array([spherical_harmonics.Y1] * 3 + [spherical_harmonics.Y0])


@dataclass(frozen=True, slots=True)
class PackedModels:
    """What is uploaded.

    Attributes:
        origin: Shape (3,), float64, world metres: what centres and query points are relative to.
        model: Shape (m, 8, 4), float32, row by row as above; the centre's fourth number is 0.
        region_model: Shape (r,), int32: the model of each region.
    """

    origin: Float64Array
    model: Float32Array
    region_model: Int32Array


def pack(regions: Regions, origin: Float64Array, weights: NDArray[np.floating[Any]]) -> PackedModels:
    """The regularised models, each once, for one function of AO.

    Args:
        regions: Of a bake.
        origin: `World.origin`.
        weights: Shape (k,): share of each distance in the one function, e.g. (0.03, 0.97) as Sloan et al. 2013 blend
            theirs; models are linear in AO, so that blending them is exact.
    """
    owners = np.unique(regions.owner)
    return PackedModels(
        origin=np.asarray(origin, np.float64),
        model=packed_models(regions.regularised, weights)[owners],
        region_model=np.searchsorted(owners, regions.owner).astype(np.int32),
    )


def packed_models(models: RegionModels, weights: NDArray[np.floating[Any]]) -> Float32Array:
    """One packed model a region, shape (r, 8, 4); see `pack`."""
    linear = np.asarray(models.coefficients, np.float64)[:, :, _NORMAL_ORDER] @ np.asarray(weights, np.float64)
    packed = np.zeros((len(models), ROWS, 4), np.float32)
    packed[:, 0, :3] = models.centre
    packed[:, 1:] = linear * _SCALE
    return packed


def evaluate_packed(
    packed: PackedModels,
    region: NDArray[np.integer[Any]],
    positions: NDArray[np.floating[Any]],
    normals: NDArray[np.floating[Any]],
) -> Float32Array:
    """AO as an engine computes it, in float32; the shaders of `shader_text` do the same, line by line.

    Args:
        packed: As uploaded.
        region: Shape (n,).
        positions: Shape (n, 3), metres relative to `packed.origin`.
        normals: Shape (n, 3), unit.

    Returns:
        Shape (n,), float32, in [0, 1].
    """
    rows = packed.model[packed.region_model[region]]
    d = positions.astype(np.float32) - rows[:, 0, :3]
    side = (d < 0.0).astype(np.int64)
    each: Int64Array = np.arange(len(rows))
    v = rows[:, 1]
    for axis in range(3):
        v = v + d[:, axis, None] * rows[each, 2 + 2 * axis + side[:, axis]]
    ao = (v[:, :3] * normals.astype(np.float32)).sum(axis=1) + v[:, 3]
    return np.clip(ao, 0.0, 1.0).astype(np.float32)


def model_bytes(regions: Regions) -> Int64Array:
    """What each region takes in the engine, shape (r,): its model and its number, or the number alone if absorbed."""
    own = regions.owner == np.arange(len(regions.owner))
    return np.where(own, MODEL_BYTES, 0) + INDEX_BYTES
