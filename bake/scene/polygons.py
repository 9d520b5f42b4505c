"""Polygons → triangles, for file formats that store faces with any number of corners."""

from __future__ import annotations

import numpy as np

from bake.errors import SceneError
from bake.types import Float64Array, Int64Array

MOST_CONCAVE_CORNERS = 4096  # cutting ears takes cubic time at worst


def triangulate_polygons(
    corners: Float64Array, counts: Int64Array, *, where: str = ""
) -> tuple[Int64Array, Int64Array]:
    """Splits polygons into triangles of the same winding.

    Convex ones become fans; a quad is cut along its other diagonal if the first leaves it; concave ones with more
    corners lose one ear after the other (Meisters 1975).

    Args:
        corners: Shape (c, 3): positions of all corners, polygon after polygon.
        counts: Shape (p,): corners of each polygon; those with fewer than 3 give no triangle.
        where: The file, for messages.

    Returns:
        Triangles, shape (m, 3), int64, as indices into `corners`, in the order of the polygons; and the polygon of
        each, shape (m,).

    Raises:
        SceneError: a concave polygon with more than 4096 corners.
    """
    first = np.cumsum(counts) - counts
    triangles: list[Int64Array] = []
    owners: list[Int64Array] = []
    sizes: list[int] = np.flatnonzero(np.bincount(counts)).tolist()
    for size in sizes:
        if size < 3:
            continue
        polygons = np.flatnonzero(counts == size)
        indices: Int64Array = np.take(first, polygons)[:, None] + np.arange(size, dtype=np.int64)
        pieces = _split(corners, indices, size, where)
        triangles.append(pieces.reshape(-1, 3))
        owners.append(np.repeat(polygons, size - 2))
    if not triangles:
        return np.zeros((0, 3), np.int64), np.zeros(0, np.int64)
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(triangles)[order], owner[order]


def _split(corners: Float64Array, indices: Int64Array, size: int, where: str) -> Int64Array:
    """Triangles of polygons with `size` corners each, shape (p, size - 2, 3)."""
    steps = np.arange(1, size - 1)
    fans = np.stack(
        [np.broadcast_to(indices[:, :1], (len(indices), size - 2)), indices[:, steps], indices[:, steps + 1]]
    )
    fans = np.moveaxis(fans, 0, -1).copy()
    if size == 3:
        return fans
    normals = _newell_normals(corners[indices])
    unfit = np.flatnonzero(_least_agreement(corners[fans], normals) <= 0.0)
    if size == 4:
        other = indices[unfit][:, [[1, 2, 3], [1, 3, 0]]]
        better = _least_agreement(corners[other], normals[unfit]) > 0.0
        fans[unfit[better]] = other[better]
    elif len(unfit) and size > MOST_CONCAVE_CORNERS:
        raise SceneError(f"a concave polygon has {size} corners", where=where, remedy="triangulate it before export")
    else:
        for polygon in unfit:
            fans[polygon] = indices[polygon][_clip_ears(corners[indices[polygon]], normals[polygon])]
    return fans


def _newell_normals(polygons: Float64Array) -> Float64Array:
    """Area-weighted normals, shape (p, 3), of polygons, shape (p, n, 3), flat or not."""
    centred = polygons - polygons[:, :1]
    return np.cross(centred, np.roll(centred, -1, axis=1)).sum(axis=1)


def _least_agreement(triangles: Float64Array, normals: Float64Array) -> Float64Array:
    """Least dot product of a polygon's triangle normals with its own, shape (p,); positive: a proper split."""
    own = np.cross(triangles[:, :, 1] - triangles[:, :, 0], triangles[:, :, 2] - triangles[:, :, 0])
    return np.einsum("pti,pi->pt", own, normals).min(axis=1)


def _clip_ears(polygon: Float64Array, normal: Float64Array) -> Int64Array:
    """Triangles of one polygon, shape (n - 2, 3), as indices into it."""
    drop = int(np.argmax(np.abs(normal)))
    flat = np.delete(polygon, drop, axis=1) * (1.0 if normal[drop] > 0.0 else -1.0)
    if drop == 1:
        flat = flat[:, ::-1]
    flat = flat if normal[drop] > 0.0 else flat * (1.0, -1.0)
    left = list(range(len(polygon)))
    triangles: list[tuple[int, int, int]] = []
    position = 0
    misses = 0
    while len(left) > 3 and misses <= len(left):
        around = [left[position - 1], left[position], left[(position + 1) % len(left)]]
        if _is_ear(flat, around, left):
            triangles.append((around[0], around[1], around[2]))
            del left[position]
            misses = 0
        else:
            position += 1
            misses += 1
        position %= len(left)
    # What is left is a triangle, or crosses itself and has no ear: a fan keeps the count and the corners.
    triangles += [(left[0], left[i], left[i + 1]) for i in range(1, len(left) - 1)]
    return np.array(triangles, np.int64)


def _is_ear(flat: Float64Array, around: list[int], left: list[int]) -> bool:
    a, b, c = flat[around]
    if _cross(b - a, c - a) <= 0.0:
        return False
    others = flat[[index for index in left if index not in around]]
    # Where a cut leads to a hole, corners come twice; one that lies on the ear's own corner is not inside it.
    others = others[(others[:, None] != flat[around]).any(axis=2).all(axis=1)]
    inside = (
        (_cross(b - a, others - a) >= 0.0) & (_cross(c - b, others - b) >= 0.0) & (_cross(a - c, others - c) >= 0.0)
    )
    return not bool(inside.any())


def _cross(first: Float64Array, second: Float64Array) -> Float64Array:
    return first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
