"""Products of a model's basis functions over boxes, and the boxes of regions that share a model."""

from __future__ import annotations

import numpy as np

from bake.arrays import Float64Array, Int32Array
from bake.region_types import PARAMETERS


def box_gram(minimum: Float64Array, maximum: Float64Array, centre: Float64Array, half: Float64Array) -> Float64Array:
    """Means over boxes of the products of a model's seven basis functions, offsets in units of `half`.

    In closed form: along one axis the offset u is uniform over [a, b], which gives the means of its positive and its
    negative part and of their squares; different axes are independent.

    Args:
        minimum, maximum, centre, half: Shape (r, 3).

    Returns:
        Shape (r, 7, 7): for parameters d, dᵀ G d is the mean square of the model over the box.
    """
    a, b = (minimum - centre) / half, (maximum - centre) / half
    # A box without extent along an axis has its offset there as the mean.
    above, below = np.maximum(b, 0.0) - np.maximum(a, 0.0), np.minimum(b, 0.0) - np.minimum(a, 0.0)
    length = np.maximum(b - a, 1e-12)
    mean = np.ones((len(a), PARAMETERS))
    mean[:, 1::2] = above * 0.5 * (np.maximum(b, 0.0) + np.maximum(a, 0.0)) / length
    mean[:, 2::2] = below * 0.5 * (np.minimum(b, 0.0) + np.minimum(a, 0.0)) / length
    gram = mean[:, :, None] * mean[:, None, :]
    square = np.ones((len(a), PARAMETERS))
    square[:, 1::2] = (np.maximum(b, 0.0) ** 3 - np.maximum(a, 0.0) ** 3) / (3.0 * length)
    square[:, 2::2] = (np.minimum(b, 0.0) ** 3 - np.minimum(a, 0.0) ** 3) / (3.0 * length)
    diagonal = np.arange(PARAMETERS)
    gram[:, diagonal, diagonal] = square
    positive, negative = diagonal[1::2], diagonal[2::2]
    gram[:, positive, negative] = gram[:, negative, positive] = 0.0  # never both at one point
    return gram


def box_volumes(minimum: Float64Array, maximum: Float64Array) -> Float64Array:
    """Volumes of boxes, shape (r, 3) → (r,), m³; a box without volume gets a speck, so that its share is defined."""
    return np.maximum(np.prod(maximum - minimum, axis=1), 1e-12)


def group_boxes(minimum: Float64Array, maximum: Float64Array, owner: Int32Array) -> tuple[Float64Array, Float64Array]:
    """Middle and half extents of the box around each owner's regions, shape (r, 3) each; half extents are positive."""
    low, high = minimum.copy(), maximum.copy()
    np.minimum.at(low, owner, minimum)
    np.maximum.at(high, owner, maximum)
    half = 0.5 * (high - low)
    return 0.5 * (low + high), np.maximum(half, np.maximum(1e-6 * half.max(axis=1, keepdims=True), 1e-9))
