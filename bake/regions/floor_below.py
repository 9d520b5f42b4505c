"""The floor below points, and where a character's middle is above it."""

from __future__ import annotations

import numpy as np

from bake.regions.rays import Nearest
from bake.regions.upright import Upright
from bake.types import BoolArray, Float64Array, Int32Array

HEIGHT = 1.0
"""Metres above the floor at which a character is lit: about its middle."""

_RAYS_A_CALL = 1 << 20
_MOST_LEAVES = 16
_BEHIND = 1e-3  # metres below a leaf from which one falls on


class Floor:
    """Finds floors below points.

    Args:
        nearest: A tracer's closest hits.
        up: Which way is up.
        stops: Shape (m,), bool: faces on which one can stand; leaves are none.
    """

    def __init__(self, nearest: Nearest, up: Upright, stops: BoolArray) -> None:
        self._nearest = nearest
        self._stops = stops
        self.up = up

    def height_above(self, points: Float64Array, *, reach: float) -> Float64Array:
        """How far below points, shape (n, 3), the floor is, shape (n,), metres; inf where it is beyond `reach`."""
        found = np.empty(len(points))
        for begin in range(0, len(points), _RAYS_A_CALL):
            part = slice(begin, begin + _RAYS_A_CALL)
            found[part] = self._below(points[part], reach)
        return found

    def lowered(self, points: Float64Array, *, reach: float) -> Float64Array:
        """Points at walking height over the floor below them; where there is none within `reach`, as they are.

        Nothing is raised into a ceiling: where a point is nearer to the floor than walking height, it stays.
        """
        drop = np.maximum(self.height_above(points, reach=reach) - HEIGHT, 0.0)
        return points + np.where(np.isfinite(drop), drop, 0.0)[:, None] * self.up.down

    def lowered_centres(
        self, pairs: Int32Array, centre: Float64Array, minimum: Float64Array, maximum: Float64Array
    ) -> Float64Array:
        """Where characters cross the boundaries between regions, shape (l, 3).

        The middle of each, lowered to walking height as far as both regions go: nobody crosses up in the air, and
        models that agree there would still part toward the floor.

        Args:
            pairs: Shape (l, 2), the regions.
            centre: Shape (l, 3), the middles; what is not finite stays.
            minimum, maximum: Shape (r, 3), the boxes.
        """
        axis, found = self.up.axis, np.array(centre, np.float64).reshape(-1, 3)
        known = np.flatnonzero(np.isfinite(found).all(axis=1))
        a, b = pairs.reshape(-1, 2)[known].T
        ends = np.stack([np.maximum(minimum[a], minimum[b])[:, axis], np.minimum(maximum[a], maximum[b])[:, axis]])
        middle = found[known, axis]
        reach = float((maximum - minimum)[:, axis].max(initial=1.0))
        lowered = self.lowered(found[known], reach=reach)
        lowered[:, axis] = lowered[:, axis].clip(
            np.minimum(ends.min(axis=0), middle), np.maximum(ends.max(axis=0), middle)
        )
        found[known] = lowered
        return found

    def _below(self, points: Float64Array, reach: float) -> Float64Array:
        fallen, falling = np.zeros(len(points)), np.arange(len(points))
        for _ in range(_MOST_LEAVES):
            origins = (points[falling] + fallen[falling, None] * self.up.down).astype(np.float32)
            directions = np.broadcast_to(self.up.down.astype(np.float32), origins.shape).copy()
            hits = self._nearest(origins, directions, reach)
            fallen[falling] += hits.distance
            passed = (hits.face >= 0) & ~self._stops[np.maximum(hits.face, 0)]
            falling = falling[passed]
            if not len(falling):
                break
            fallen[falling] += _BEHIND
        return np.where(fallen <= reach, fallen, np.inf)
