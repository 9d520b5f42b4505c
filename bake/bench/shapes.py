"""Small solids for benchmarks that put objects into real scenes: boxes, sheets, balls and turned shapes, y up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bake.arrays import Float32Array, Float64Array, Int32Array
from bake.bench.synthetic import octahedron, subdivided
from bake.scene.normals import crease_normals

Lines = Float64Array | Sequence[float]


@dataclass(frozen=True, slots=True)
class Solid:
    """Bare geometry: positions, shape (n, 3), and faces, shape (m, 3), counter-clockwise from outside."""

    positions: Float64Array
    faces: Int32Array

    def moved(self, x: float, y: float, z: float) -> Solid:
        """Shifted."""
        return Solid(self.positions + np.array([x, y, z]), self.faces)

    def flipped(self) -> Solid:
        """With the winding reversed."""
        return Solid(self.positions, self.faces[:, ::-1])

    def scaled(self, x: float, y: float, z: float) -> Solid:
        """Stretched along the axes."""
        return Solid(self.positions * np.array([x, y, z]), self.faces)


@dataclass(frozen=True, slots=True)
class Shaded:
    """Geometry with vertex normals, as a modelling program would export it.

    Attributes:
        positions: Shape (n, 3), float64.
        normals: Shape (n, 3), float32, unit.
        faces: Shape (m, 3), int32.
    """

    positions: Float64Array
    normals: Float32Array
    faces: Int32Array


def shaded(solid: Solid, crease: float = 40.0) -> Shaded:
    """With normals by crease angle, vertices split where they must be."""
    split = crease_normals(solid.positions, solid.faces, crease)
    return Shaded(solid.positions[split.source], split.normals, split.faces)


def joined(*solids: Solid) -> Solid:
    """Several as one, not welded to each other."""
    starts = np.cumsum([0, *(len(solid.positions) for solid in solids)])
    return Solid(
        np.concatenate([solid.positions for solid in solids]),
        np.concatenate([s.faces + np.int32(o) for s, o in zip(solids, starts, strict=False)]).astype(np.int32),
    )


def welded(solid: Solid, step: float = 1e-7) -> Solid:
    """Coincident positions made one; faces that collapse are dropped."""
    keys = np.round(solid.positions / step).astype(np.int64)
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    faces = inverse.reshape(-1)[solid.faces].astype(np.int32)
    proper = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return Solid(solid.positions[first], faces[proper])


def sheet(points: Float64Array) -> Solid:
    """A grid of points, shape (rows, columns, 3); its normal is (along rows) × (along columns)."""
    rows, columns = int(points.shape[0]), int(points.shape[1])
    a = np.add.outer(np.arange(rows - 1) * columns, np.arange(columns - 1)).reshape(-1).astype(np.int64)
    b, c, d = a + columns, a + columns + 1, a + 1
    odd = ((a // columns + a % columns) % 2 == 1)[:, None]
    first = np.where(odd, np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(odd, np.stack([b, c, d], 1), np.stack([a, c, d], 1))
    return Solid(points.reshape(-1, 3), np.concatenate([first, second]).astype(np.int32))


def lattice(xs: Lines, ys: Lines, zs: Lines) -> Solid:
    """The surface of a box with the given lines on its sides."""
    lines = (np.asarray(xs, float), np.asarray(ys, float), np.asarray(zs, float))
    sides: list[Solid] = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, -1):
            points = np.empty((len(lines[u]), len(lines[v]), 3))
            points[..., axis] = lines[axis][end]
            points[..., u] = lines[u][:, None]
            points[..., v] = lines[v][None, :]
            side = sheet(points)
            sides.append(side if end == -1 else side.flipped())
    return welded(joined(*sides))


def steps(low: float, high: float, step: float) -> Float64Array:
    """Places from `low` to `high`, at most about `step` apart."""
    return np.linspace(low, high, max(1, round((high - low) / step)) + 1)


def block(low: Sequence[float], high: Sequence[float], step: float = 0.2) -> Solid:
    """A box, its sides subdivided."""
    return lattice(*(steps(low[axis], high[axis], step) for axis in range(3)))


def revolved(profile: Sequence[tuple[float, float]], segments: int) -> Solid:
    """A closed surface of revolution about +Y: radius and height from the bottom of the outside to the top."""
    angles = np.arange(segments + 1) * (2.0 * np.pi / segments)
    radius, height = np.array(profile).T
    points = np.stack(
        [
            radius[:, None] * np.cos(angles),
            np.broadcast_to(height[:, None], (len(profile), segments + 1)),
            -radius[:, None] * np.sin(angles),
        ],
        axis=-1,
    )
    return welded(sheet(points).flipped())


def ball(times: int, x: float, y: float, z: float, *, rough: float = 0.0, seed: int = 0) -> Solid:
    """An ellipsoid of half axes x, y, z about the origin; rough ones have bumps of that share."""
    positions, faces = subdivided(octahedron(), times, radius=1.0)
    if rough > 0.0:
        waves = np.random.default_rng(seed).normal(0.0, 2.0, (6, 3))
        positions = positions * (1.0 + rough * np.sin(positions @ waves.T + np.arange(6)).mean(axis=1))[:, None]
    return Solid(positions * np.array([x, y, z]), faces)


def with_normal(solid: Solid, normal: Sequence[float]) -> Shaded:
    """Every vertex with the same normal."""
    unit = np.asarray(normal, float) / np.linalg.norm(normal)
    return Shaded(solid.positions, np.broadcast_to(unit, solid.positions.shape).astype(np.float32), solid.faces)


def upright(left: float, right: float, low: float, high: float, cells: int) -> Solid:
    """A sheet in the plane z = 0 that shows to +z."""
    x, y = np.meshgrid(np.linspace(left, right, cells + 1), np.linspace(low, high, cells + 1), indexing="ij")
    return sheet(np.stack([x, y, np.zeros_like(x)], axis=-1))


def flat(left: float, right: float, back: float, front: float, height: float, cells: int) -> Solid:
    """A horizontal sheet that shows up."""
    z, x = np.meshgrid(np.linspace(back, front, cells + 1), np.linspace(left, right, cells + 1), indexing="ij")
    return sheet(np.stack([x, np.full_like(x, height), z], axis=-1))


def plinth() -> Shaded:
    """What every injection stands on: its top is at y = 0."""
    return shaded(block((-0.85, -0.8, -0.85), (0.85, 0.0, 0.85), 0.2))
