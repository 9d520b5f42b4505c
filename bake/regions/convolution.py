"""From what is open around a point to AO about any normal."""

from __future__ import annotations

import math

import numpy as np

from bake.arrays import Float32Array, Float64Array

CLAMPED_COSINE = np.repeat([math.pi, 2.0 * math.pi / 3.0, math.pi / 4.0], (1, 3, 5))
"""What the clamped cosine multiplies each coefficient by, band by band (Ramamoorthi and Hanrahan 2001, equation 8)."""


def convolve(sh: Float32Array) -> Float64Array:
    """The openness around points, about normals instead of in directions.

    Args:
        sh: Shape (n, 9, k): harmonics of the open share ρ over the sphere.

    Returns:
        Shape (n, 9, k): harmonics of (1/π) ∫ ρ max(0, ω · n) dω, the AO about a normal n; 1 in the open.
    """
    return sh * (CLAMPED_COSINE / math.pi)[:, None]
