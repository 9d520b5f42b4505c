"""Vertex normals: made by crease angle where a file has none, and turned where they contradict their faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.equal_rows import stable_order
from bake.in_parts import in_parts, meanwhile
from bake.scene.edges import EdgeCounts, MeshEdges
from bake.scene.fans import find_fans
from bake.scene.remembered import remembered
from bake.scene.surface import referenced_vertices
from bake.scene.weld import places_of
from bake.triangles import Triangles, Vectors, columns, dot, normals_of
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array


@dataclass(frozen=True, slots=True)
class CreaseSplit:
    """A mesh whose vertices were split along its creases.

    Attributes:
        faces: Shape (m, 3), int32, into the split vertices; order and corners as before.
        normals: Shape (n, 3), float32, unit; zero for vertices without a face of any area.
        source: Shape (n,), int32, ascending: the vertex that each split vertex came from. Every one occurs.
        place: Shape (n,), int64: equal numbers for vertices at the same place (`places_of`).
        edges: How many edges are odd.
    """

    faces: Int32Array
    normals: Float32Array
    source: Int32Array
    place: Int64Array
    edges: EdgeCounts


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
    count = len(faces)
    looking = meanwhile(lambda: _face_directions(positions, faces), count)
    place, places = places_of(positions), len(positions)
    welded = place[faces]
    edges = MeshEdges(welded)
    directions, angles = looking()
    summing = meanwhile(lambda: _sums(directions, angles, edges.start, places), count)
    counting = meanwhile(edges.counts, count)
    fans = find_fans(edges, places, directions, np.cos(np.radians(crease_angle)))
    groups = int(fans.group.max(initial=-1)) + 1

    # A vertex of a whole place stays one; elsewhere, each group that it has corners in makes one of it.
    corner_vertex = faces.reshape(-1)
    unique, number, _ = _numbered(corner_vertex[fans.others] * np.int64(max(groups, 1)) + fans.group)
    source, group = np.divmod(unique, max(groups, 1))
    made = np.bincount(source, minlength=len(positions))
    count_of = np.maximum(made, 1)
    first = np.cumsum(count_of) - count_of
    split = first[source] + np.arange(len(source)) - (np.cumsum(made) - made)[source]
    corners = first.astype(np.int32).take(corner_vertex)
    corners[fans.others] = split[number]
    normals = np.zeros((int(count_of.sum()), 3))
    used = referenced_vertices(faces, len(positions))
    normals[first[used]] = summing().take(place[used], axis=0)
    if len(split):
        normals[split] = _sums_of(directions, angles, fans.others, fans.group, groups)[group]
    source_vertex = np.repeat(np.arange(len(positions), dtype=np.int32), count_of)
    return CreaseSplit(
        faces=corners.reshape(count, 3),
        normals=unit_vectors(normals),
        source=source_vertex,
        place=place[source_vertex],
        edges=counting(),
    )


def _sums(directions: Vectors, angles: Float64Array, bin_of: Int64Array, bins: int) -> Float64Array:
    """Sums of face normals weighted by corner angle over the corners of each bin, shape (bins, 3)."""
    sums = np.empty((bins, 3))

    def axes(begin: int, end: int) -> None:
        for axis in range(begin, end):
            sums[:, axis] = np.bincount(bin_of, (directions[axis][:, None] * angles).ravel(), bins)

    in_parts(axes, 3, 1)
    return sums


def _sums_of(
    directions: Vectors, angles: Float64Array, corners: Int64Array, bin_of: Int64Array, bins: int
) -> Float64Array:
    """The same for some corners, shape (k,)."""
    face, angle = corners // 3, angles.ravel().take(corners)
    sums = [np.bincount(bin_of, axis.take(face) * angle, bins) for axis in directions]
    return np.stack(sums, axis=1).astype(np.float64, copy=False)


def _numbered(keys: Int64Array) -> tuple[Int64Array, Int32Array, Int64Array]:
    """The distinct keys, ascending, the number of each key among them, and where each comes first; none is negative."""
    order = stable_order(keys.astype(np.uint64), int(keys.max(initial=0)))
    ascending = keys[order]
    is_new = np.ones(len(keys), np.bool_)
    is_new[1:] = ascending[1:] != ascending[:-1]
    number = np.empty(len(keys), np.int32)
    number[order] = np.cumsum(is_new, dtype=np.int32) - np.int32(1)
    return ascending[is_new], number, order[is_new]


def _face_directions(positions: Float64Array, faces: Int64Array | Int32Array) -> tuple[Vectors, Float64Array]:
    """Unit face normals, m of them, zero for faces without area, and corner angles in radians, shape (m, 3)."""
    x, y, z = directions = np.empty((3, len(faces)))
    angles = np.empty((len(faces), 3))
    triangles = Triangles(positions, faces)

    def part(begin: int, end: int) -> None:
        sides = triangles.sides(begin, end)
        normals = normals_of(sides)
        lengths = np.sqrt(dot(normals, normals))
        divisor = np.where(lengths > 0.0, lengths, np.inf)
        for axis in range(3):
            directions[axis, begin:end] = normals[axis] / divisor
        for corner in range(3):
            angles[begin:end, corner] = np.arctan2(lengths, -dot(sides[corner], sides[corner - 1]))

    in_parts(part, len(faces))
    return (x, y, z), angles


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
