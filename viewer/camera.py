"""Where the viewer stands: orbit, pan, zoom, look, frame and fly, as pure functions of a frozen camera."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from bake.types import Float64Array
from viewer.boxes import box_around

_STEEPEST = math.radians(89.0)


@dataclass(frozen=True, slots=True)
class Camera:
    """A turntable camera: the horizon stays level.

    Attributes:
        focal: Shape (3,), the point looked at and orbited, in the view's metres.
        azimuth: Angle about the up axis, radians.
        elevation: Angle above the horizon from which the focal point is seen, radians, within ±89°.
        distance: From the focal point to the eye, metres, positive.
        up_axis: 0, 1 or 2.
        view_angle: Vertical field of view, radians.
    """

    focal: tuple[float, float, float] = (0.0, 0.0, 0.0)
    azimuth: float = math.radians(35.0)
    elevation: float = math.radians(28.0)
    distance: float = 10.0
    up_axis: int = 1
    view_angle: float = math.radians(45.0)

    @property
    def up(self) -> Float64Array:
        """Unit vector of the up axis, shape (3,)."""
        return np.eye(3)[self.up_axis]

    @property
    def backward(self) -> Float64Array:
        """Unit vector from the focal point to the eye, shape (3,)."""
        first, second = (self.up_axis + 1) % 3, (self.up_axis + 2) % 3
        vector = np.zeros(3)
        vector[self.up_axis] = math.sin(self.elevation)
        vector[first] = math.cos(self.elevation) * math.sin(self.azimuth)
        vector[second] = math.cos(self.elevation) * math.cos(self.azimuth)
        return vector

    @property
    def right(self) -> Float64Array:
        """Unit vector to the right of the picture, shape (3,)."""
        vector = np.cross(self.up, self.backward)
        return vector / np.linalg.norm(vector)

    @property
    def picture_up(self) -> Float64Array:
        """Unit vector to the top of the picture, shape (3,)."""
        return np.cross(self.backward, self.right)

    @property
    def eye(self) -> Float64Array:
        """Position of the eye, shape (3,)."""
        return np.asarray(self.focal) + self.distance * self.backward

    def orbited(self, azimuth: float, elevation: float) -> Camera:
        """Turned about the focal point by angles in radians."""
        return dataclasses.replace(self, azimuth=self.azimuth + azimuth, elevation=_limited(self.elevation + elevation))

    def looked(self, azimuth: float, elevation: float) -> Camera:
        """Turned about the eye by angles in radians, as when looking around."""
        turned = self.orbited(azimuth, elevation)
        return dataclasses.replace(turned, focal=_triple(self.eye - self.distance * turned.backward))

    def panned(self, right: float, up: float) -> Camera:
        """Moved in the picture's plane by shares of its height."""
        height = 2.0 * self.distance * math.tan(self.view_angle / 2.0)
        return self.moved(right * height, up * height, 0.0)

    def moved(self, right: float, up: float, forward: float) -> Camera:
        """Moved along its own axes by metres, eye and focal point together."""
        step = right * self.right + up * self.picture_up - forward * self.backward
        return dataclasses.replace(self, focal=_triple(np.asarray(self.focal) + step))

    def zoomed(self, factor: float, about: Float64Array | None = None) -> Camera:
        """Closer by a factor above 1, keeping `about` (a point, shape (3,)) where it is in the picture."""
        share = 1.0 / factor
        focal = np.asarray(self.focal)
        if about is not None:
            focal = about + (focal - about) * share
        return dataclasses.replace(self, focal=_triple(focal), distance=max(self.distance * share, 1e-4))

    def aimed(self, point: Float64Array | tuple[float, float, float], distance: float) -> Camera:
        """Looking at a point, shape (3,), from a distance in metres, in the same direction."""
        return dataclasses.replace(self, focal=_triple(np.asarray(point)), distance=max(distance, 1e-4))

    def framed(self, low: Float64Array, high: Float64Array, aspect: float) -> Camera:
        """Far enough that a box fits the picture, seen from the same direction.

        Args:
            low, high: Corners of the box, each of shape (3,).
            aspect: Width over height of the picture.
        """
        low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
        centre = (low + high) / 2.0
        corners = np.array([[(low, high)[bit >> axis & 1][axis] for axis in range(3)] for bit in range(8)]) - centre
        tangent = math.tan(self.view_angle / 2.0)
        depth = corners @ self.backward
        needed = np.maximum(np.abs(corners @ self.picture_up), np.abs(corners @ self.right) / max(aspect, 1e-3))
        distance = max(float(np.max(depth + needed / tangent)) * 1.05, float(np.linalg.norm(high - low)) * 0.01, 1e-3)
        return dataclasses.replace(self, focal=_triple(centre), distance=distance)

    def ray(self, x: float, y: float, aspect: float) -> tuple[Float64Array, Float64Array]:
        """The ray through a point of the picture.

        Args:
            x, y: Position in [-1, 1], right and up.
            aspect: Width over height of the picture.

        Returns:
            Origin and unit direction, each of shape (3,), float64.
        """
        tangent = math.tan(self.view_angle / 2.0)
        direction = x * tangent * aspect * self.right + y * tangent * self.picture_up - self.backward
        return self.eye, direction / np.linalg.norm(direction)

    def toward(self, other: Camera, share: float) -> Camera:
        """Between this camera and another, eased at both ends, for a flight; `share` in [0, 1]."""
        eased = share * share * (3.0 - 2.0 * share)
        turn = math.remainder(other.azimuth - self.azimuth, math.tau)
        focal = (1.0 - eased) * np.asarray(self.focal) + eased * np.asarray(other.focal)
        return dataclasses.replace(
            other,
            focal=_triple(focal),
            azimuth=self.azimuth + eased * turn,
            elevation=(1.0 - eased) * self.elevation + eased * other.elevation,
            distance=self.distance ** (1.0 - eased) * other.distance**eased,
        )


def robust_bounds(positions: Float64Array, outside: float = 0.02) -> tuple[Float64Array, Float64Array]:
    """A box around most of the points, so that a far backdrop does not shrink the level to a dot.

    Args:
        positions: Shape (n, 3).
        outside: Share of the points that may lie outside on each side of each axis.

    Returns:
        Low and high corner, each of shape (3,); the full box where it is hardly larger.
    """
    if not len(positions):
        return np.zeros(3), np.ones(3)
    step = max(1, len(positions) // 50_000)
    low, high = np.quantile(positions[::step], (outside, 1.0 - outside), axis=0)
    full_low, full_high = box_around(positions)
    if np.linalg.norm(full_high - full_low) <= 1.6 * np.linalg.norm(high - low):
        return full_low, full_high
    margin = 0.05 * np.linalg.norm(high - low)
    return np.maximum(low - margin, full_low), np.minimum(high + margin, full_high)


def guessed_up_axis(face_normals_by_area: Float64Array) -> int:
    """Y or Z (1 or 2), whichever more surface faces: floors and ceilings outweigh walls.

    Args:
        face_normals_by_area: Shape (m, 3), normals whose length is the face's area.
    """
    facing = np.abs(face_normals_by_area).sum(axis=0) if len(face_normals_by_area) else np.ones(3)
    return 2 if facing[2] > 1.1 * facing[1] else 1


def _limited(elevation: float) -> float:
    return min(max(elevation, -_STEEPEST), _STEEPEST)


def _triple(vector: Float64Array) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])
