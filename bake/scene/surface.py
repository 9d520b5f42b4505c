"""Which triangles have enough surface to take samples."""

from __future__ import annotations

import numpy as np

from bake.in_parts import in_parts
from bake.triangles import Triangles, dot, normals_of
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array

SLIVER_RATIO = 1e-6  # height over longest edge
AREA_RATIO = 1e-12  # area over the square of the object's diagonal: what float32 coordinates can still resolve


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
    points, slivers = lacking_surface(positions, faces, diagonals, face_object)
    return ~(points | slivers)


def lacking_surface(
    positions: Float64Array,
    faces: Int32Array,
    diagonals: Float64Array,
    face_object: Int32Array | None = None,
) -> tuple[BoolArray, BoolArray]:
    """Faces without area and, among the others, slivers; each of shape (m,).

    Args:
        positions: Shape (n, 3).
        faces: Shape (m, 3).
        diagonals: Shape (o,): diagonal of each object's bounding box.
        face_object: Shape (m,); without it there is one object.
    """
    triangles = Triangles(positions, faces)
    points, slivers = np.empty(len(faces), np.bool_), np.empty(len(faces), np.bool_)

    def part(begin: int, end: int) -> None:
        here = slice(begin, end)
        sides = triangles.sides(begin, end)
        normals = normals_of(sides)
        doubled_area = np.sqrt(dot(normals, normals))
        longest_squared = np.maximum(np.maximum(*(dot(side, side) for side in sides[:2])), dot(sides[2], sides[2]))
        diagonal = diagonals[0] if face_object is None else diagonals[face_object[here]]
        points[here] = ~((doubled_area > 0.0) & (0.5 * doubled_area >= AREA_RATIO * diagonal * diagonal))
        slivers[here] = ~points[here] & ~(doubled_area >= SLIVER_RATIO * longest_squared)

    in_parts(part, len(faces))
    return points, slivers


def referenced_vertices(faces: Int32Array | Int64Array, vertex_count: int) -> BoolArray:
    """Vertices that some face uses, shape (vertex_count,)."""
    used = np.zeros(vertex_count, np.bool_)
    used[faces.reshape(-1)] = True
    return used
