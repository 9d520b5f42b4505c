"""Vertex normals: made by crease angle where a file has none, and turned where they contradict their faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix  # pyright: ignore[reportMissingTypeStubs]
from scipy.sparse.csgraph import (  # pyright: ignore[reportMissingTypeStubs]
    connected_components,  # pyright: ignore[reportUnknownVariableType]
)

from bake.scene.surface import referenced_vertices
from bake.scene.weld import stable_order, weld_positions
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
    directions, angles = _face_directions(positions, faces)
    welded = weld_positions(positions)[faces]
    joined = _join_corners(welded, directions, np.cos(np.radians(crease_angle)))
    # Corner c of face f is number 3 f + c; a split vertex is a (group, source vertex) pair.
    weighted = (directions[:, None, :] * angles[:, :, None]).reshape(3 * count, 3)
    groups = int(joined.max(initial=-1)) + 1
    sums = np.stack([np.bincount(joined, weighted[:, axis], groups) for axis in range(3)], axis=1)
    keys = faces.reshape(-1) * np.int64(max(groups, 1)) + joined
    unused = np.flatnonzero(~referenced_vertices(faces, len(positions)))
    unique, corner_vertex = _numbered(np.concatenate((keys, unused * np.int64(max(groups, 1)))))
    normals = np.zeros((len(unique), 3))
    normals[corner_vertex[: 3 * count]] = sums[joined]
    return CreaseSplit(
        faces=corner_vertex[: 3 * count].reshape(count, 3).astype(np.int32),
        normals=unit_vectors(normals),
        source=(unique // max(groups, 1)).astype(np.int32),
    )


def _numbered(keys: Int64Array) -> tuple[Int64Array, Int64Array]:
    """The distinct keys, ascending, and the number of each key among them; keys are not negative."""
    order = stable_order(keys.astype(np.uint64), int(keys.max(initial=0)))
    ascending = keys[order]
    is_new = np.ones(len(keys), np.bool_)
    is_new[1:] = ascending[1:] != ascending[:-1]
    number = np.empty(len(keys), np.int64)
    number[order] = np.cumsum(is_new) - 1
    return ascending[is_new], number


def _face_directions(positions: Float64Array, faces: Int64Array) -> tuple[Float64Array, Float64Array]:
    """Unit face normals, shape (m, 3), zero for faces without area, and corner angles in radians, shape (m, 3)."""
    corners = positions[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    directions = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)
    angles = np.zeros(faces.shape)
    for corner in range(3):
        ahead = corners[:, (corner + 1) % 3] - corners[:, corner]
        behind = corners[:, (corner + 2) % 3] - corners[:, corner]
        angles[:, corner] = np.arctan2(lengths[:, 0], np.einsum("ij,ij->i", ahead, behind))
    return directions, angles


def _join_corners(welded: Int64Array, directions: Float64Array, least_cosine: float) -> Int64Array:
    """Group of each corner, shape (3 m,), int64: corners joined across edges flatter than the crease."""
    count = len(welded)
    start, end = welded.reshape(-1), np.roll(welded, -1, axis=1).reshape(-1)
    corner = np.arange(3 * count)
    next_corner = corner - corner % 3 + (corner + 1) % 3
    number = int(welded.max(initial=-1)) + 1
    edges = (np.minimum(start, end) * number + np.maximum(start, end)).astype(np.uint64)
    order = stable_order(edges, number * number)
    keys = edges[order]
    rows: list[Int64Array] = []
    columns: list[Int64Array] = []
    for step in range(1, MOST_FACES_COMPARED):
        same = np.flatnonzero(keys[step:] == keys[:-step])
        if len(same) == 0:
            break
        first, second = order[same], order[same + step]
        cosine = np.einsum("ij,ij->i", directions[first // 3], directions[second // 3])
        flat = cosine >= least_cosine
        first, second = first[flat], second[flat]
        forward = start[first] == start[second]  # both faces run along the edge in the same direction
        at_start, at_end = (
            np.where(forward, second, next_corner[second]),
            np.where(forward, next_corner[second], second),
        )
        rows += [first, next_corner[first]]
        columns += [at_start, at_end]
    if not rows:
        return corner
    row, column = np.concatenate(rows), np.concatenate(columns)
    graph = coo_matrix((np.ones(len(row), np.int32), (row, column)), shape=(3 * count, 3 * count))
    return np.asarray(connected_components(graph.tocsr(), directed=False)[1], np.int64)


def unit_vectors(vectors: Float64Array) -> Float32Array:
    """`vectors`, shape (n, 3), scaled to unit length as float32; zero where they have no length or are not finite."""
    largest = np.abs(vectors).max(axis=1, keepdims=True, initial=0.0)
    usable = np.isfinite(largest) & (largest > 0.0)
    scaled = np.divide(vectors, largest, out=np.zeros(vectors.shape), where=usable)
    lengths = np.linalg.norm(scaled, axis=1, keepdims=True)
    return np.divide(scaled, lengths, out=scaled, where=lengths > 0.0).astype(np.float32)


def opposing_normals(positions: Float64Array, normals: Float32Array, faces: Int32Array) -> BoolArray:
    """Vertices whose normal points away from every face around them, shape (n,).

    Such a normal is turned round (after NVIDIA's OptiX Prime baking sample, which does so per face). Where some faces
    agree and others don't, either reading may be meant and the normal stays as it is: the hemisphere above each face
    is still respected when rays are made.
    """
    corners = positions[faces]
    face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    opposing = np.zeros(len(positions), np.bool_)
    agreeing = np.zeros(len(positions), np.bool_)
    for corner in range(3):
        vertex = faces[:, corner]
        side = np.einsum("ij,ij->i", face_normals, normals[vertex].astype(np.float64))
        opposing[vertex[side < 0.0]] = True
        agreeing[vertex[side > 0.0]] = True
    return opposing & ~agreeing
