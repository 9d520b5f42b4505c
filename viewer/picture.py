"""What lies inside the picture of a camera."""

from __future__ import annotations

import math

import numpy as np

from bake.types import BoolArray, Float64Array
from viewer.camera import Camera


def picture_matrix(camera: Camera, aspect: float) -> tuple[float, ...]:
    """Four rows that take a point to homogeneous coordinates in which the picture reaches from -1 to 1.

    Args:
        camera: Where the view stands.
        aspect: Width over height.
    """
    tangent = math.tan(camera.view_angle / 2.0)
    rows = [camera.right / (tangent * aspect), camera.picture_up / tangent, np.zeros(3), -camera.backward]
    return tuple(float(value) for row in rows for value in (*row, -float(row @ camera.eye)))


def boxes_in_picture(boxes: Float64Array, matrix: Float64Array) -> BoolArray:
    """Which boxes, shape (k, 2, 3), may reach into the picture of a matrix, shape (4, 4)."""
    bits = np.array([[bit >> axis & 1 for axis in range(3)] for bit in range(8)])
    corners = np.take_along_axis(boxes[:, None], bits[None, :, None, :], axis=2)[:, :, 0]
    clip = corners @ matrix[:, :3].T + matrix[:, 3]
    w = clip[..., 3]
    outside = (w <= 0.0).all(axis=1)
    for axis in (0, 1):
        outside |= (clip[..., axis] > w).all(axis=1) | (clip[..., axis] < -w).all(axis=1)
    return np.asarray(~outside)
