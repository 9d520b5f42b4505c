"""Triangles as columns of coordinates: what is worked out for millions of faces runs on contiguous arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bake.arrays import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array
from bake.in_parts import in_parts

Vectors = tuple[Float64Array, Float64Array, Float64Array]
"""x, y and z of n vectors, each shape (n,), float64."""


class Triangles:
    """The faces of a mesh, taken apart once and read part by part.

    Args:
        positions: Shape (n, 3).
        faces: Shape (m, 3).
    """

    def __init__(self, positions: Float64Array | Float32Array, faces: Int32Array | Int64Array) -> None:
        self._positions = columns(positions)
        self._corners = [np.ascontiguousarray(faces[:, corner]) for corner in range(3)]

    def corners(self, begin: int, end: int) -> list[NDArray[np.int32 | np.int64]]:
        """The vertices of faces `begin` to `end`, corner by corner."""
        return [corner[begin:end] for corner in self._corners]

    def sides(self, begin: int, end: int) -> tuple[Vectors, Vectors, Vectors]:
        """The vectors from each corner to the next of faces `begin` to `end`."""
        a, b, c = ([axis.take(corner) for axis in self._positions] for corner in self.corners(begin, end))
        return _between(a, b), _between(b, c), _between(c, a)


def touching(faces: Int32Array | Int64Array, marked: BoolArray) -> BoolArray:
    """Faces, shape (m, 3), that have a marked vertex, shape (m,)."""
    found = np.empty(len(faces), np.bool_)

    def part(begin: int, end: int) -> None:
        at = marked.take(faces[begin:end])
        found[begin:end] = at[:, 0] | at[:, 1] | at[:, 2]

    in_parts(part, len(faces))
    return found


def columns(vectors: Float64Array | Float32Array) -> Vectors:
    """The columns of an array of shape (n, 3)."""
    x, y, z = (np.ascontiguousarray(vectors[:, axis], np.float64) for axis in range(3))
    return x, y, z


def _between(tail: list[Float64Array], head: list[Float64Array]) -> Vectors:
    return head[0] - tail[0], head[1] - tail[1], head[2] - tail[2]


def cross(a: Vectors, b: Vectors) -> Vectors:
    """Cross products."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def dot(a: Vectors, b: Vectors) -> Float64Array:
    """Dot products, shape (n,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def normals_of(sides: tuple[Vectors, Vectors, Vectors]) -> Vectors:
    """Normals as long as twice the faces' areas: the first side × the second."""
    return cross(sides[0], sides[1])
