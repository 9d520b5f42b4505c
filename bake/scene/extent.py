"""Boxes around points, and points through a matrix: what every mesh needs, on all processors."""

from __future__ import annotations

import numpy as np

from bake.in_parts import in_parts
from bake.scene.surface import referenced_vertices
from bake.types import Float32Array, Float64Array, Int32Array

_WIDE = 256
"""Points that one step of a reduction takes side by side: three columns alone would be a loop over three numbers."""


def box_of(points: Float64Array) -> tuple[Float64Array, Float64Array]:
    """The least and the greatest coordinates of points, shape (n, 3) with n > 0; each shape (3,)."""
    whole = len(points) // _WIDE * _WIDE
    low, high = points[whole:], points[whole:]
    if whole:
        rows = points[:whole].reshape(-1, 3 * _WIDE)
        low = np.concatenate((rows.min(axis=0).reshape(-1, 3), low))
        high = np.concatenate((rows.max(axis=0).reshape(-1, 3), high))
    return low.min(axis=0), high.max(axis=0)


def used_positions(positions: Float64Array, faces: Int32Array) -> Float64Array:
    """The positions that some face uses, shape (u, 3): `positions` itself where all are."""
    used = referenced_vertices(faces, len(positions))
    return positions if used.all() else positions[used]


def through_matrix(vectors: Float64Array | Float32Array, matrix: Float64Array, out: Float64Array) -> None:
    """`matrix` times each of some vectors, shape (n, 3), into `out`.

    Part by part: a whole level at once would be shared out among the threads of the matrix library, which wait for each
    other in busy loops.
    """

    def part(begin: int, end: int) -> None:
        np.matmul(vectors[begin:end], matrix.T, out=out[begin:end])

    in_parts(part, len(vectors))
