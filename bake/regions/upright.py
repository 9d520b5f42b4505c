"""Which way is up, and coordinates in which it is the last axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.geometry import face_normals
from bake.settings import BakeSettings
from bake.types import Float64Array, Scene, World

_FLAT = 0.9  # cosine above which a face counts as level


@dataclass(frozen=True, slots=True)
class Upright:
    """A turn of coordinates: plan u and v, then height.

    Attributes:
        axis: The axis of the world that points up or down.
        sign: 1 where up is positive.
    """

    axis: int
    sign: float

    @property
    def order(self) -> list[int]:
        """Axes of the world that become u, v and height."""
        return [(self.axis + 1) % 3, (self.axis + 2) % 3, self.axis]

    @property
    def down(self) -> Float64Array:
        """Unit vector of the world, shape (3,)."""
        vector = np.zeros(3)
        vector[self.axis] = -self.sign
        return vector

    def turned(self, points: Float64Array) -> Float64Array:
        """World coordinates to (u, v, height), shape (…, 3)."""
        return points[..., self.order] * np.array([1.0, 1.0, self.sign])

    def boxes(self, low: Float64Array, high: Float64Array) -> tuple[Float64Array, Float64Array]:
        """Boxes in (u, v, height) back to the world, shape (r, 3) each."""
        a, b = self.world(low), self.world(high)
        return np.minimum(a, b), np.maximum(a, b)

    def world(self, points: Float64Array) -> Float64Array:
        """(u, v, height) back to world coordinates, shape (…, 3)."""
        result = np.empty_like(points)
        result[..., self.order] = points * np.array([1.0, 1.0, self.sign])
        return result


def find_up(scene: Scene, world: World, settings: BakeSettings) -> Upright:
    """What points up: as the `ground` setting says, else the file, else the side that most level area faces.

    For a file that does not say, Y and Z are compared, and Y is taken where they are close: levels are wider than they
    are high, so more of their area is level than faces any one side.
    """
    if settings.ground is not None:
        return Upright(settings.ground.axis // 2, -1.0 if settings.ground.axis % 2 else 1.0)
    if scene.up_axis >= 0:
        return Upright(scene.up_axis, 1.0)
    normal, area = face_normals(world.positions, world.faces)
    area = np.where(world.face_casts, area, 0.0)
    level = [float(area[np.abs(normal[:, axis]) > _FLAT].sum()) for axis in range(3)]
    return Upright(2, 1.0) if level[2] > 1.25 * level[1] else Upright(1, 1.0)
