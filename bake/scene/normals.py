"""Vertex normals: made by crease angle where a file has none, and turned where they contradict their faces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix  # pyright: ignore[reportMissingTypeStubs]
from scipy.sparse.csgraph import (  # pyright: ignore[reportMissingTypeStubs]
    connected_components,  # pyright: ignore[reportUnknownVariableType]
)

from bake.equal_rows import stable_order
from bake.in_parts import in_parts, meanwhile
from bake.scene.remembered import remembered
from bake.scene.surface import referenced_vertices
from bake.scene.weld import weld_positions
from bake.triangles import Triangles, Vectors, columns, dot, normals_of
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array

# Faces around one edge that are all compared with each other; more than that only in deliberately odd files.
MOST_FACES_COMPARED = 8


@dataclass(frozen=True, slots=True)
class CreaseSplit:
    """A mesh whose vertices were split along its creases.

    Attributes:
        faces: Shape (m, 3), int32, into the split vertices; order and corners as before.
        normals: Shape (n, 3), float32, unit; zero for vertices without a face of any area.
        source: Shape (n,), int32, ascending: the vertex that each split vertex came from. Every one occurs.
    """

    faces: Int32Array
    normals: Float32Array
    source: Int32Array


def crease_normals(positions: Float64Array, faces: Int64Array | Int32Array, crease_angle: float) -> CreaseSplit:
    """Makes vertex normals; faces share one wherever they meet at an edge flatter than the crease angle.

    Around each position, corners are joined across flat edges, and every group of joined corners becomes one vertex
    with the sum of its face normals weighted by corner angle (Thürmer and Wüthrich 1998). Vertices at the same place
    count as one, so files that store every triangle apart come out smooth as well.

    Args:
        positions: Shape (n, 3).
        faces: Shape (m, 3), indices within range.
        crease_angle: In degrees; faces that meet at a larger angle keep normals of their own.
    """
    faces = faces.astype(np.int64)
    count = len(faces)
    looking = meanwhile(lambda: _face_directions(positions, faces), count)
    welded = weld_positions(positions)[faces]
    joined = _join_corners(welded, lambda: looking()[0], np.cos(np.radians(crease_angle)))
    directions, angles = looking()
    # Corner c of face f is number 3 f + c; a split vertex is a (group, source vertex) pair.
    groups = int(joined.max(initial=-1)) + 1
    summing = meanwhile(
        lambda: np.stack(
            [np.bincount(joined, (directions[:, axis, None] * angles).ravel(), groups) for axis in range(3)], axis=1
        ),
        count,
    )
    keys = faces.reshape(-1) * np.int64(max(groups, 1)) + joined
    used = referenced_vertices(faces, len(positions))
    if not used.all():
        keys = np.concatenate((keys, np.flatnonzero(~used) * np.int64(max(groups, 1))))
    unique, corner_vertex, first = _numbered(keys)
    normals = np.zeros((len(unique), 3))
    has_corner = first < 3 * count
    normals[has_corner] = summing()[joined[first[has_corner]]]
    return CreaseSplit(
        faces=corner_vertex[: 3 * count].reshape(count, 3),
        normals=unit_vectors(normals),
        source=(unique // max(groups, 1)).astype(np.int32),
    )


def _numbered(keys: Int64Array) -> tuple[Int64Array, Int32Array, Int64Array]:
    """The distinct keys, ascending, the number of each key among them, and where each comes first; none is negative."""
    order = stable_order(keys.astype(np.uint64), int(keys.max(initial=0)))
    ascending = keys[order]
    is_new = np.ones(len(keys), np.bool_)
    is_new[1:] = ascending[1:] != ascending[:-1]
    number = np.empty(len(keys), np.int32)
    number[order] = np.cumsum(is_new, dtype=np.int32) - np.int32(1)
    return ascending[is_new], number, order[is_new]


def _face_directions(positions: Float64Array, faces: Int64Array) -> tuple[Float64Array, Float64Array]:
    """Unit face normals, shape (m, 3), zero for faces without area, and corner angles in radians, shape (m, 3)."""
    directions, angles = np.empty((len(faces), 3)), np.empty((len(faces), 3))
    triangles = Triangles(positions, faces)

    def part(begin: int, end: int) -> None:
        sides = triangles.sides(begin, end)
        normals = normals_of(sides)
        lengths = np.sqrt(dot(normals, normals))
        divisor = np.where(lengths > 0.0, lengths, np.inf)
        for axis in range(3):
            directions[begin:end, axis] = normals[axis] / divisor
        for corner in range(3):
            angles[begin:end, corner] = np.arctan2(lengths, -dot(sides[corner], sides[corner - 1]))

    in_parts(part, len(faces))
    return directions, angles


def _join_corners(welded: Int64Array, directions: Callable[[], Float64Array], least_cosine: float) -> Int64Array:
    """Group of each corner, shape (3 m,), int64: corners joined across edges flatter than the crease."""
    count = len(welded)
    start, end = welded.reshape(-1), welded[:, [1, 2, 0]].reshape(-1)
    corner = np.arange(3 * count, dtype=np.int32 if 3 * count < 2**31 else np.int64)
    number = int(welded.max(initial=-1)) + 1
    edges = (np.minimum(start, end) * number + np.maximum(start, end)).astype(np.uint64)
    order = stable_order(edges, number * number)
    keys, order = edges[order], order.astype(corner.dtype)
    by_axis = columns(directions())
    rows: list[NDArray[Any]] = []
    others: list[NDArray[Any]] = []
    for step in range(1, MOST_FACES_COMPARED):
        same = np.flatnonzero(keys[step:] == keys[:-step])
        if len(same) == 0:
            break
        first, second = order[same], order[same + step]
        flat = np.empty(len(same), np.bool_)
        joined = np.empty((4, len(same)), corner.dtype)

        in_parts(partial(_ends, start, by_axis, least_cosine, first, second, flat, joined), len(same))
        joined = joined if flat.all() else joined[:, flat]
        rows += [joined[0], joined[1]]
        others += [joined[2], joined[3]]
    if not rows:
        return corner.astype(np.int64)
    row, column = np.concatenate(rows), np.concatenate(others)
    graph = coo_matrix((np.ones(len(row), np.int32), (row, column)), shape=(3 * count, 3 * count))
    return np.asarray(connected_components(graph.tocsr(), directed=False)[1], np.int64)


def _ends(
    start: Int64Array,
    directions: Vectors,
    least_cosine: float,
    first: NDArray[Any],
    second: NDArray[Any],
    flat: BoolArray,
    joined: NDArray[Any],
    begin: int,
    end: int,
) -> None:
    """Of edges `begin` to `end`, whether they are flat, and which corners of their first and second face meet."""
    one, other = first[begin:end], second[begin:end]
    face, face_beyond = one // 3, other // 3
    cosine = np.zeros(len(one))
    for axis in directions:
        cosine += axis.take(face) * axis.take(face_beyond)
    flat[begin:end] = cosine >= least_cosine
    forward = start.take(one) == start.take(other)  # both faces run along the edge in the same direction
    next_one, next_other = one + 1 - 3 * (one - 3 * face == 2), other + 1 - 3 * (other - 3 * face_beyond == 2)
    joined[:, begin:end] = one, next_one, np.where(forward, other, next_other), np.where(forward, next_other, other)


def unit_vectors(vectors: Float64Array | Float32Array, matrix: Float64Array | None = None) -> Float32Array:
    """Vectors, shape (n, 3), scaled to unit length as float32; zero where they have no length or are not finite.

    Args:
        vectors: In float32 or float64.
        matrix: Shape (3, 3), float64: they are multiplied by it first.
    """
    unit = np.empty(vectors.shape, np.float32)

    def part(begin: int, end: int) -> None:
        own = vectors[begin:end].astype(np.float64, copy=False)
        x, y, z = columns(own if matrix is None else own @ matrix.T)
        largest = np.maximum(np.maximum(np.abs(x), np.abs(y)), np.abs(z))
        usable = np.isfinite(largest) & (largest > 0.0)
        if not usable.all():
            x, y, z = (np.where(usable, axis, 0.0) for axis in (x, y, z))
            largest = np.where(usable, largest, 1.0)
        scaled = x / largest, y / largest, z / largest
        lengths = np.sqrt(dot(scaled, scaled))
        lengths[~usable] = 1.0
        for axis in range(3):
            unit[begin:end, axis] = scaled[axis] / lengths

    in_parts(part, len(vectors))
    return unit


def opposing_normals(positions: Float64Array, normals: Float32Array, faces: Int32Array) -> BoolArray:
    """Vertices whose normal points away from every face around them, shape (n,).

    Such a normal is turned round (after NVIDIA's OptiX Prime baking sample, which does so per face). Where some faces
    agree and others don't, either reading may be meant and the normal stays as it is: the hemisphere above each face
    is still respected when rays are made.
    """
    opposing = np.zeros(len(positions), np.bool_)
    agreeing = np.zeros(len(positions), np.bool_)
    triangles, columns_of_normals = Triangles(positions, faces), columns(normals)

    def part(begin: int, end: int) -> None:
        face_normals = normals_of(triangles.sides(begin, end))
        for vertex in triangles.corners(begin, end):
            x, y, z = (axis.take(vertex) for axis in columns_of_normals)
            side = dot(face_normals, (x, y, z))
            opposing[vertex[side < 0.0]] = True  # threads may meet at a vertex, but write the same
            agreeing[vertex[side > 0.0]] = True

    in_parts(part, len(faces))
    return opposing & ~agreeing


known_opposing_normals = remembered(opposing_normals)
"""The same for the arrays of meshes, which stay as they are."""
