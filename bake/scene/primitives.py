"""glTF primitive modes → triangles."""

from __future__ import annotations

import numpy as np

from bake.types import Int64Array

TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN = 4, 5, 6
MODE_NAMES = ("points", "lines", "a line loop", "a line strip", "triangles", "a triangle strip", "a triangle fan")


def triangulate(indices: Int64Array, mode: int) -> tuple[Int64Array, int]:
    """Triangles of a primitive, shape (m, 3), and how many indices at its end make no whole triangle.

    Strips alternate their winding so that all faces look the same way; the triangles without extent that stitch
    strips together are left out, since they are part of the notation and not of the surface.

    Args:
        indices: Shape (n,).
        mode: TRIANGLES, TRIANGLE_STRIP or TRIANGLE_FAN.
    """
    if mode == TRIANGLES:
        whole = len(indices) // 3 * 3
        return indices[:whole].reshape(-1, 3), len(indices) - whole
    if len(indices) < 3:
        return np.zeros((0, 3), np.int64), len(indices)
    if mode == TRIANGLE_FAN:
        return np.column_stack((indices[1:-1], indices[2:], np.full(len(indices) - 2, indices[0]))), 0
    faces = np.column_stack((indices[:-2], indices[1:-1], indices[2:]))
    faces[1::2] = faces[1::2][:, [0, 2, 1]]
    a, b, c = faces.T
    return faces[(a != b) & (b != c) & (c != a)], 0
