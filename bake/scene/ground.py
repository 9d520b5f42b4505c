"""The ground plane (after NVIDIA's OptiX Prime baking sample): a quad under the scene that blocks light from below."""

from __future__ import annotations

import numpy as np

from bake.settings import Ground
from bake.types import Float64Array

GROUND_PATH = "ground"
QUAD_FACES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def ground_quad(ground: Ground, minimum: Float64Array, maximum: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Corners and normal of the quad.

    Where the scene is flat along an axis, its largest extent stands in, so that the quad neither coincides with a
    flat floor nor vanishes.

    Args:
        ground: Which side faces up, size and distance in units of the scene's extents.
        minimum, maximum: Shape (3,): the scene's bounding box.

    Returns:
        Shape (4, 3), counter-clockwise seen from above (use with `QUAD_FACES`), and the unit normal, shape (3,).
    """
    extent = maximum - minimum
    extent = np.where(extent > 1e-9 * extent.max(), extent, extent.max())
    axis, downward = divmod(ground.axis, 2)
    sign = -1.0 if downward else 1.0
    height = (maximum[axis] if downward else minimum[axis]) - sign * ground.offset * extent[axis]
    centre = 0.5 * (minimum + maximum)
    first, second = (axis + 1) % 3, (axis + 2) % 3  # first × second points along +axis
    signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    if downward:
        signs = signs[::-1]
    corners = np.empty((4, 3))
    corners[:, axis] = height
    for column, tangent in enumerate((first, second)):
        corners[:, tangent] = centre[tangent] + signs[:, column] * 0.5 * ground.scale * extent[tangent]
    normal = np.zeros(3)
    normal[axis] = sign
    return corners, normal
