"""Where the grid points of regions lie."""

from __future__ import annotations

import numpy as np

from bake.arrays import Float64Array
from bake.region_types import GRID, RegionGraph


def grid_levels(minimum: Float64Array, maximum: Float64Array) -> Float64Array:
    """Coordinates of the grid's planes along each axis, boxes of shape (r, 3) → (r, 3, GRID).

    They are the middles of GRID equal slices: no point lies on the boundary, where walls tend to be.
    """
    share = (np.arange(GRID) + 0.5) / GRID
    return minimum[:, :, None] * (1.0 - share) + maximum[:, :, None] * share


def grid_positions(graph: RegionGraph) -> Float64Array:
    """All grid points in the order of `RegionPoints`, shape (r · GRID³, 3), float64, relative to `World.origin`."""
    return box_points(graph.minimum, graph.maximum).reshape(-1, 3)


def box_points(minimum: Float64Array, maximum: Float64Array) -> Float64Array:
    """The grid points of each box, boxes of shape (r, 3) → (r, GRID³, 3)."""
    x, y, z = np.moveaxis(grid_levels(minimum, maximum), 1, 0)
    points = np.empty((len(minimum), GRID, GRID, GRID, 3))
    points[..., 0], points[..., 1], points[..., 2] = x[:, :, None, None], y[:, None, :, None], z[:, None, None, :]
    return points.reshape(-1, GRID**3, 3)
