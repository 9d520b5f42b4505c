"""Questions about free space that rays answer: is the way open, and is a point inside something."""

from __future__ import annotations

import numpy as np

from bake.geometry import GRAZING_COSINE, sphere_direction
from bake.regions.rays import Nearest
from bake.types import BoolArray, Float32Array, Float64Array, World

_RAYS_A_CALL = 1 << 20
_LOOKS = 8  # directions in which a point looks for back faces
_MOST_LEAVES = 16  # faces that do not stop and that one segment passes; behind them it counts as blocked


class FreeSpace:
    """The faces of a world that stop what moves, as obstacles.

    Positions are metres relative to `World.origin`. A two-sided face has no inside.

    Attributes:
        rays: How many were traced so far.
    """

    def __init__(self, world: World, nearest: Nearest, stops: BoolArray | None = None) -> None:
        """Takes a tracer's closest hits, and which faces stop, shape (m,); by default all do."""
        self._nearest = nearest
        self._two_sided = world.face_two_sided
        self._stops = np.ones(world.face_count, np.bool_) if stops is None else stops
        self.rays = 0

    def clear(self, start: Float64Array, end: Float64Array, *, width: float | Float64Array = 0.0) -> BoolArray:
        """Whether nothing lies between two points each, shape (n, 3) → (n,).

        With a `width`, in metres, scalar or shape (n,), a second ray beside the first must pass too: a crack between
        two faces is no opening.
        """
        clear = self._clear(start, end)
        widths = np.broadcast_to(np.asarray(width, np.float64), len(start))
        again = np.flatnonzero(clear & (widths > 0.0))
        if len(again):
            beside = _beside(end[again] - start[again]) * widths[again, None]
            clear[again] = self._clear(start[again] + beside, end[again] + beside)
        return clear

    def look(self, points: Float64Array, reach: Float64Array) -> tuple[BoolArray, Float64Array]:
        """Whether points, shape (n, 3), are inside geometry, and how far the nearest face is that a few rays meet.

        A point is inside if most of its rays that hit anything within `reach`, shape (n,), metres, strike the back of
        a one-sided face, and these are at least a quarter of all rays.

        Returns:
            Inside, shape (n,), and the distance, shape (n,), metres, at most `reach`.
        """
        directions = _directions(_LOOKS)
        inside = np.zeros(len(points), np.bool_)
        clearance = np.array(reach, np.float64)
        at_once = max(1, _RAYS_A_CALL // _LOOKS)
        for begin in range(0, len(points), at_once):
            part = slice(begin, begin + at_once)
            count = len(points[part])
            origins = np.repeat(points[part].astype(np.float32), _LOOKS, axis=0)
            hits = self._nearest(origins, np.tile(directions, (count, 1)), float(reach[part].max()))
            self.rays += len(origins)
            distance = hits.distance.reshape(count, _LOOKS)
            stopped = (hits.face >= 0) & self._stops[np.maximum(hits.face, 0)]
            met = stopped.reshape(count, _LOOKS) & (distance <= reach[part, None])
            one_sided = ~self._two_sided[np.maximum(hits.face, 0)].reshape(count, _LOOKS)
            back = met & one_sided & (hits.cosine.reshape(count, _LOOKS) > GRAZING_COSINE)
            backs, all_met = back.sum(axis=1), met.sum(axis=1)
            inside[part] = (2 * backs > all_met) & (4 * backs >= _LOOKS)
            clearance[part] = np.minimum(clearance[part], np.where(met, distance, np.inf).min(axis=1))
        return inside, clearance

    def below(self, points: Float64Array, down: Float64Array, reach: Float64Array) -> BoolArray:
        """Whether there is something to stand on below points, shape (n, 3), within `reach`, shape (n,), metres.

        Args:
            points: Positions.
            down: Unit vector, shape (3,).
            reach: Metres.
        """
        found = np.zeros(len(points), np.bool_)
        for begin in range(0, len(points), _RAYS_A_CALL):
            part = slice(begin, begin + _RAYS_A_CALL)
            origins = points[part].astype(np.float32)
            directions = np.broadcast_to(down.astype(np.float32), origins.shape).copy()
            hits = self._nearest(origins, directions, float(reach[part].max()))
            self.rays += len(origins)
            face = np.maximum(hits.face, 0)
            front = (hits.cosine < 0.0) | self._two_sided[face] | ~self._stops[face]  # leaves hang above something
            found[part] = (hits.face >= 0) & (hits.distance <= reach[part]) & front
        return found

    def _clear(self, start: Float64Array, end: Float64Array) -> BoolArray:
        clear = np.ones(len(start), np.bool_)
        for begin in range(0, len(start), _RAYS_A_CALL):
            part = slice(begin, begin + _RAYS_A_CALL)
            clear[part] = self._clear_at_once(start[part], end[part])
        return clear

    def _clear_at_once(self, start: Float64Array, end: Float64Array) -> BoolArray:
        way = end - start
        length = np.linalg.norm(way, axis=1)
        direction = way / np.where(length > 0.0, length, 1.0)[:, None]
        direction[length == 0.0] = (0.0, 0.0, 1.0)
        clear = np.ones(len(start), np.bool_)
        going, gone = np.arange(len(start)), np.zeros(len(start))
        for _ in range(_MOST_LEAVES):
            left = length[going] - gone[going]
            origins = (start[going] + gone[going, None] * direction[going]).astype(np.float32)
            hits = self._nearest(origins, direction[going].astype(np.float32), float(left.max(initial=1e-6)))
            self.rays += len(going)
            hit = hits.distance < left
            clear[going[hit]] = False
            passes = hit & ~self._stops[np.maximum(hits.face, 0)]
            going = going[passes]
            if len(going) == 0:
                break
            # Behind the leaf, rays go on, and count as clear again until they meet something.
            gone[going] += hits.distance[passes] * (1.0 + 1e-5) + 1e-4
            clear[going] = True
        clear[going] = False
        return clear


def _beside(way: Float64Array) -> Float64Array:
    """Unit vectors across ways, shape (n, 3), leaning to no axis."""
    across = np.cross(way, np.array([0.36, 0.48, 0.8]))
    parallel = np.linalg.norm(across, axis=1) < 1e-3 * np.linalg.norm(way, axis=1)
    across[parallel] = np.cross(way[parallel], np.array([0.8, -0.6, 0.0]))
    length = np.linalg.norm(across, axis=1)
    return across / np.where(length > 0.0, length, 1.0)[:, None]


def _directions(count: int) -> Float32Array:
    """A fixed spiral over the sphere, shape (count, 3): no direction lies along an axis, as walls and edges do."""
    number = np.arange(count, dtype=np.float64) + 0.5
    return sphere_direction(number / count, 0.61803398875 * number % 1.0).astype(np.float32)
