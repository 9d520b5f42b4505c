"""A path: points joined by straight lines, measured by how far one has walked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from bake.errors import InputError
from bake.types import Float64Array, Int32Array
from bake.walk.types import WalkPath


def path_through(points: ArrayLike) -> WalkPath:
    """The path from point to point.

    Args:
        points: Shape (n, 3), metres relative to `World.origin`.

    Raises:
        InputError: as `path_in_pieces`.
    """
    return path_in_pieces([points])


def path_in_pieces(pieces: Sequence[ArrayLike], *, where: str = "path") -> WalkPath:
    """A path between whose pieces the character teleports.

    A point on top of the one before it is left out.

    Args:
        pieces: Points of each piece, shape (n, 3).
        where: What an error message names.

    Raises:
        InputError: no piece, a piece without points, numbers that are not finite, or a length of zero.
    """
    points: list[Float64Array] = []
    numbers: list[Int32Array] = []
    distances: list[Float64Array] = []
    walked = 0.0
    for number, given in enumerate(pieces):
        piece = np.asarray(given, np.float64)
        if piece.ndim != 2 or piece.shape[1:] != (3,) or not len(piece):
            raise InputError("a path is made of points of three numbers", where=where, remedy="write x, y, z each")
        if not np.isfinite(piece).all():
            raise InputError("a point of the path is not finite", where=where, remedy="remove it")
        steps: Float64Array = np.linalg.norm(np.diff(piece, axis=0), axis=1)
        kept = np.concatenate([[True], steps > 0.0])
        along = walked + np.concatenate([[0.0], np.cumsum(steps)])
        walked = float(along[-1])
        points.append(piece[kept])
        distances.append(along[kept])
        numbers.append(np.full(int(kept.sum()), number, np.int32))
    if walked <= 0.0:
        raise InputError("the path has no length", where=where, remedy="give at least two different points")
    return WalkPath(np.concatenate(points), np.concatenate(numbers), np.concatenate(distances))


def places(path: WalkPath, distance: Float64Array, piece: Int32Array) -> Float64Array:
    """Points of a path, shape (n, 3).

    Args:
        path: The path.
        distance: Shape (n,): metres walked.
        piece: Shape (n,): which piece is meant; a distance beyond its ends gives its end.
    """
    found = np.empty((len(distance), 3))
    for number in np.unique(piece).tolist():
        own, asked = path.piece == number, piece == number
        for axis in range(3):
            found[asked, axis] = np.interp(distance[asked], path.distance[own], path.points[own, axis])
    return found


def piece_at(path: WalkPath, distance: Float64Array) -> Int32Array:
    """Which piece one is on after so many metres, shape (n,); at a teleport the new one already."""
    first = np.flatnonzero(np.diff(path.piece, prepend=-1))
    return path.piece[first][np.searchsorted(path.distance[first], distance, side="right") - 1]
