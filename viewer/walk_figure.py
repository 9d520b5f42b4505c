"""A figure that walks: a turned shape as tall as a person, with a normal a vertex."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bake.types import Float64Array, Int32Array

TALL = 1.8
"""Metres."""
MIDDLE = 1.0
"""Height above its feet of the place at which the walk evaluates AO."""

# Radius and height along its outline, metres, from the sole to the crown.
_OUTLINE = (
    (0.0, 0.0), (0.17, 0.0), (0.2, 0.03), (0.19, 0.07), (0.12, 0.13), (0.125, 0.35), (0.15, 0.6), (0.185, 0.85),
    (0.185, 0.98), (0.16, 1.1), (0.185, 1.25), (0.215, 1.38), (0.2, 1.45), (0.11, 1.5), (0.06, 1.53), (0.065, 1.57),
    (0.1, 1.6), (0.122, 1.66), (0.118, 1.72), (0.09, 1.77), (0.045, 1.795), (0.0, 1.8),
)  # fmt: skip
_FLATTER = 0.62  # front to back, against side to side: shows which way it faces
_SIDES = 24


@dataclass(frozen=True, slots=True)
class Figure:
    """A mesh about the walk's place, facing +x with up along +z.

    Attributes:
        positions: Shape (n, 3), metres from the place.
        normals: Shape (n, 3), unit.
        faces: Shape (m, 3), int32.
    """

    positions: Float64Array
    normals: Float64Array
    faces: Int32Array

    def placed(
        self, place: Float64Array, heading: Float64Array, up: Float64Array, scale: float = 1.0
    ) -> tuple[Float64Array, Float64Array]:
        """Positions and normals of the figure at a place.

        Args:
            place: Shape (3,): where its middle is.
            heading: Shape (3,): the way it goes; its share along `up` does not count.
            up: Shape (3,), unit.
            scale: 1 is a person.

        Returns:
            Two arrays of shape (n, 3).
        """
        forward = heading - (heading @ up) * up
        length = float(np.linalg.norm(forward))
        if length < 1e-9:
            forward = np.roll(up, 1)
            forward = forward - (forward @ up) * up
            length = float(np.linalg.norm(forward))
        forward = forward / length
        turn = np.stack([forward, np.cross(up, forward), up])
        return place + scale * (self.positions @ turn), self.normals @ turn


def figure() -> Figure:
    """The figure."""
    radius, height = np.array(_OUTLINE).T
    angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    slope = np.gradient(np.stack([radius, height], axis=1), axis=0)
    outward, upward = slope[:, 1], -slope[:, 0]
    x, y = _FLATTER * np.cos(angle), np.sin(angle)
    positions = np.stack(
        [radius[:, None] * x, radius[:, None] * y, np.broadcast_to(height[:, None] - MIDDLE, (len(radius), _SIDES))],
        axis=-1,
    )
    normals = np.stack(
        [
            outward[:, None] * np.cos(angle) / _FLATTER,
            outward[:, None] * np.sin(angle),
            np.broadcast_to(upward[:, None], (len(radius), _SIDES)),
        ],
        axis=-1,
    )
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    row, side = np.meshgrid(np.arange(len(radius) - 1), np.arange(_SIDES), indexing="ij")
    a, b = row * _SIDES + side, row * _SIDES + (side + 1) % _SIDES
    c, d = a + _SIDES, b + _SIDES
    faces = np.concatenate([np.stack([a, b, d], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)])
    return Figure(positions.reshape(-1, 3), normals.reshape(-1, 3), faces.astype(np.int32))


def heading_at(position: Float64Array, frame: int, reach: int) -> Float64Array:
    """The way a walk goes at a frame, shape (3,), over so many frames before and after it."""
    low, high = max(frame - reach, 0), min(frame + reach, len(position) - 1)
    way = position[high] - position[low]
    return way if math.isfinite(float(way @ way)) else np.zeros(3)
