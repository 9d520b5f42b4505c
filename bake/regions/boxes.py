"""Which boxes of the regions hold a point, and which of those know the free space around it."""

from __future__ import annotations

import numpy as np

from bake.region_types import GRID, PointState, RegionGraph, RegionPoints
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array

_DEEPEST = 1.0  # metres from the nearest face beyond which a box holds a point no better
_A_DECADE = 0.25  # metres less that a box of ten times the volume holds a point


class Boxes:
    """The boxes of a graph with the validity of their grid points.

    Args:
        graph: The regions.
        points: Their grid points.
    """

    def __init__(self, graph: RegionGraph, points: RegionPoints) -> None:
        self.minimum: Float64Array = graph.minimum
        self.maximum: Float64Array = graph.maximum
        self.size: Float64Array = np.maximum(graph.maximum - graph.minimum, 1e-9)
        reachable = (points.state != PointState.UNREACHABLE).reshape(-1, GRID, GRID, GRID)
        self._share = reachable.astype(np.float32)

    def __len__(self) -> int:
        return len(self.minimum)

    def holding(self, point: Float64Array) -> Int64Array:
        """The boxes that hold one point, ascending."""
        return np.flatnonzero(((self.minimum <= point) & (point <= self.maximum)).all(axis=1))

    def holds_any(self, points: Float64Array) -> BoolArray:
        """Which points, shape (n, 3), lie in any box."""
        held = np.zeros(len(points), np.bool_)
        for low, high in zip(self.minimum, self.maximum, strict=True):
            held |= ((low <= points) & (points <= high)).all(axis=1)
        return held

    def distance(self, point: Float64Array) -> Float64Array:
        """How far each box is from one point, shape (r,), metres; 0 inside."""
        return np.linalg.norm(np.maximum(np.maximum(self.minimum - point, point - self.maximum), 0.0), axis=1)

    def clamped(self, region: Int32Array | Int64Array, points: Float64Array) -> Float64Array:
        """Points, shape (n, 3), moved to the nearest place of their region's box."""
        return np.clip(points, self.minimum[region], self.maximum[region])

    def held_depth(self, region: Int32Array | Int64Array, points: Float64Array) -> Float64Array:
        """How well boxes hold points, whether or not their regions reach them, metres; -inf outside.

        By the distance to the nearest face, up to a metre; of boxes inside each other the smaller holds better.

        Args:
            region: Shape (…).
            points: Shape (…, 3), or what broadcasts with it.

        Returns:
            Shape (…).
        """
        inner = np.minimum(points - self.minimum[region], self.maximum[region] - points).min(axis=-1)
        score: Float64Array = np.minimum(inner, _DEEPEST) - _A_DECADE * np.log10(self.size[region].prod(axis=-1))
        score[inner < 0.0] = -np.inf
        return score

    def open_share(self, region: Int32Array | Int64Array, points: Float64Array) -> Float64Array:
        """How much of the free space at points their region reaches, shape (n,), in [0, 1].

        The trilinear mean of the eight grid points around, 1 where they are reachable from the region's seed; beyond
        the outermost ones it stays what it is there. 0 says that the place is another region's, behind a wall.
        """
        cell = (points - self.minimum[region]) / self.size[region] * GRID - 0.5
        cell = np.clip(cell, 0.0, GRID - 1.0)
        low = np.minimum(cell.astype(np.int64), GRID - 2)
        part = cell - low
        share = np.zeros(len(points))
        for corner in range(8):
            offset = np.array([corner >> 2 & 1, corner >> 1 & 1, corner & 1])
            weight = np.where(offset == 1, part, 1.0 - part).prod(axis=1)
            x, y, z = (low + offset).T
            share += weight * self._share[region, x, y, z]
        return share
