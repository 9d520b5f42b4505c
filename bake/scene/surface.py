"""Which triangles have enough surface to take samples."""

from __future__ import annotations

import numpy as np

from bake.types import BoolArray, Float64Array, Int32Array, Int64Array

SLIVER_RATIO = 1e-6  # height over longest edge
AREA_RATIO = 1e-12  # area over the square of the object's diagonal: what float32 coordinates can still resolve
FACES_AT_ONCE = 1 << 18


def samplable_faces(
    positions: Float64Array, faces: Int32Array, face_object: Int32Array, diagonals: Float64Array
) -> BoolArray:
    """Faces that are neither points nor slivers, shape (m,).

    A face is left out if its area is below 1e-12 of the square of its object's diagonal, or its height below 1e-6 of
    its longest edge: its normal would be made of rounding errors. Measured against the object, not the scene, so that
    a small prop in a wide level keeps its faces.

    Args:
        positions: Shape (n, 3).
        faces: Shape (m, 3).
        face_object: Shape (m,).
        diagonals: Shape (o,): diagonal of each object's bounding box, in the units of `positions`.
    """
    enough = np.empty(len(faces), np.bool_)
    for begin in range(0, len(faces), FACES_AT_ONCE):
        span = slice(begin, begin + FACES_AT_ONCE)
        points, slivers = lacking_surface(positions[faces[span]], diagonals[face_object[span]])
        enough[span] = ~(points | slivers)
    return enough


def lacking_surface(corners: Float64Array, diagonals: Float64Array) -> tuple[BoolArray, BoolArray]:
    """Faces without area and, among the others, slivers; each of shape (m,).

    Args:
        corners: Shape (m, 3, 3).
        diagonals: Shape (m,): diagonal of the bounding box of each face's object.
    """
    edges = np.roll(corners, -1, axis=1) - corners
    normals = np.cross(edges[:, 0], edges[:, 1])
    doubled_area = np.sqrt(np.einsum("ij,ij->i", normals, normals))
    longest_squared = np.einsum("ijk,ijk->ij", edges, edges).max(axis=1, initial=0.0)
    points = ~((doubled_area > 0.0) & (0.5 * doubled_area >= AREA_RATIO * diagonals * diagonals))
    return points, ~points & ~(doubled_area >= SLIVER_RATIO * longest_squared)


def referenced_vertices(faces: Int32Array | Int64Array, vertex_count: int) -> BoolArray:
    """Vertices that some face uses, shape (vertex_count,)."""
    used = np.zeros(vertex_count, np.bool_)
    used[faces.reshape(-1)] = True
    return used
