"""Scenes of any size, made on the spot, for measurements that need no files of others."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bake.arrays import BoolArray, Float64Array, Int32Array

Geometry = tuple[Float64Array, Int32Array]


def height_field(cells: int, width: float = 200.0) -> Geometry:
    """A rolling square field of `cells`² × 2 triangles, `width` metres wide, z up.

    z = 3 sin(0.1 x) cos(0.13 y) + 0.5 sin(0.7 x + 0.4 y)
    """
    line = np.linspace(-width / 2, width / 2, cells + 1)
    x, y = np.meshgrid(line, line)
    z = _height(x, y)
    corner = np.arange(cells * (cells + 1)).reshape(cells, cells + 1)[:, :-1].ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + cells + 1], axis=1),
            np.stack([corner + 1, corner + cells + 2, corner + cells + 1], axis=1),
        ]
    )
    return np.stack([x, y, z], axis=-1).reshape(-1, 3), faces.astype(np.int32)


def _height(x: Float64Array, y: Float64Array) -> Float64Array:
    return 3.0 * np.sin(0.1 * x) * np.cos(0.13 * y) + 0.5 * np.sin(0.7 * x + 0.4 * y)


def under_the_field(points: Float64Array) -> BoolArray:
    """Which points, shape (n, 3), lie lower than `height_field`, shape (n,)."""
    return points[:, 2] < _height(points[:, 0], points[:, 1])


def subdivided(geometry: Geometry, times: int, *, radius: float | None = None) -> Geometry:
    """Each triangle split into four, `times` times; with a radius, pushed out to that sphere."""
    positions, faces = geometry
    for _ in range(times):
        edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = (inverse.reshape(-1, 3) + len(positions)).T
        positions = np.concatenate([positions, positions[unique].mean(axis=1)])
        a, b, c = faces.T
        parts = ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))
        faces = np.concatenate([np.stack(part, axis=1) for part in parts]).astype(np.int32)
    if radius is not None:
        positions = positions / np.linalg.norm(positions, axis=1, keepdims=True) * radius
    return positions, faces


def cube() -> Geometry:
    """A unit cube about the origin."""
    positions = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [corner for a, b, c, d in quads for corner in ([a, b, c], [a, c, d])]
    return positions, np.array(faces, np.int32)


def octahedron() -> Geometry:
    """An octahedron of radius 1 about the origin."""
    positions = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    return positions, np.array(faces, np.int32)


def icosahedron() -> Geometry:
    """An icosahedron of radius 1 about the origin."""
    long = (1.0 + np.sqrt(5.0)) / 2.0
    corners = [(0.0, a, b * long) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    positions = np.array([np.roll(corner, turn) for turn in range(3) for corner in corners])
    edge = np.linalg.norm(positions[:, None] - positions[None], axis=2) < 2.1
    triples = [
        (a, b, c)
        for a in range(12)
        for b in range(a + 1, 12)
        for c in range(b + 1, 12)
        if edge[a, b] and edge[b, c] and edge[c, a]
    ]
    faces = np.array(triples, np.int32)
    inward = np.linalg.det(positions[faces]) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return positions / np.sqrt(1.0 + long * long), faces


def comparison_field(props: int = 300, *, seed: int = 1) -> Geometry:
    """The field on which other bakers are compared: 400 × 400 points, 200 m wide, and props as one mesh of soup.

    In turn icospheres of radius 1 to 4 m (3 subdivisions) and boxes with edges of 2 to 10 m (2 subdivisions), centred
    uniformly within ±90 m and -2 to 4 m high: 271,000 vertices, 539,202 triangles.
    """
    rng = np.random.default_rng(seed)
    parts = [height_field(399)]
    for i in range(props):
        if i % 2 == 0:
            positions, faces = subdivided(icosahedron(), 3, radius=rng.uniform(1.0, 4.0))
        else:
            positions, faces = subdivided(cube(), 2)
            positions = positions * rng.uniform(2.0, 10.0, 3)
        centre = np.append(rng.uniform(-90.0, 90.0, 2), rng.uniform(-2.0, 4.0))
        parts.append((positions + centre, faces))
    return joined(parts)


def joined(parts: Sequence[Geometry]) -> Geometry:
    """Several meshes as one."""
    starts = np.cumsum([0, *(len(p) for p, _ in parts)])
    faces = np.concatenate([f + start for (_, f), start in zip(parts, starts, strict=False)])
    return np.concatenate([p for p, _ in parts]), faces.astype(np.int32)


def field_with_props(cells: int, props: int = 300, *, seed: int = 1, subdivisions: int = 3) -> Geometry:
    """A height field with spheres and boxes half sunk into it, as one mesh of soup."""
    rng = np.random.default_rng(seed)
    parts = [height_field(cells)]
    for i in range(props):
        if i % 2 == 0:
            positions, faces = subdivided(octahedron(), subdivisions + 1, radius=rng.uniform(1.0, 4.0))
        else:
            positions, faces = subdivided(cube(), subdivisions)
            positions = positions * rng.uniform(2.0, 10.0, 3)
        centre = np.append(rng.uniform(-90.0, 90.0, 2), rng.uniform(-2.0, 4.0))
        parts.append((positions + centre, faces))
    return joined(parts)


def write_ply(path: Path, geometry: Geometry) -> None:
    """Writes a binary PLY without normals."""
    positions, faces = geometry
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(positions)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    with path.open("wb") as file:
        file.write(header.encode())
        file.write(positions.astype("<f4").tobytes())
        file.write(rows.tobytes())
