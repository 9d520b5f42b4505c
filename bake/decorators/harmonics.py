"""From the visibility around a point, kept as spherical harmonics, to AO about a normal."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bake import spherical_harmonics
from bake.arrays import Float32Array

OPEN = math.sqrt(4.0 * math.pi)
"""First coefficient of the function that is 1 everywhere; its others are 0."""

# Clamped cosine by band, π, 2π/3 and π/4 (Ramamoorthi and Hanrahan 2001, equation 8), over π: AO of the open is 1.
_COSINE = np.repeat([1.0, 2.0 / 3.0, 1.0 / 4.0], (1, 3, 5))


def ambient_obscurance(sh: NDArray[np.floating], normals: NDArray[np.floating]) -> Float32Array:
    """AO about normals: ρ convolved with the clamped cosine and divided by π.

    Exact for everything in the span of the nine functions; a half-space lies in the first four (Sloan et al. 2013,
    section 2.3). What the missing bands make ring is cut off at 0 and 1, at the very end.

    Args:
        sh: Shape (n, 9, k): coefficients of ρ over the sphere.
        normals: Shape (n, 3), unit.

    Returns:
        Shape (n, k), in [0, 1]; NaN where `sh` is.
    """
    lobes = spherical_harmonics.evaluate(np.asarray(normals, np.float64)) * _COSINE
    return np.clip(np.einsum("ij,ijk->ik", lobes, sh), 0.0, 1.0).astype(np.float32)


def constant(value: float, count: int, distance_count: int) -> Float32Array:
    """Coefficients of a constant, shape (count, 9, k)."""
    sh = np.zeros((count, spherical_harmonics.COUNT, distance_count), np.float32)
    sh[:, 0] = value * OPEN
    return sh
