"""Tessellated shapes: boxes, surfaces of revolution, tubes, spheres, height fields."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from assets.sample_level.mesh import Faces, Points, Solid, joined, welded
from assets.sample_level.randomness import value_noise

Vector = Sequence[float]


def graded(start: float, end: float, coarse: float, fine: float | None = None, *, growth: float = 0.4) -> Points:
    """Places from `start` to `end`, `coarse` apart in the middle and `fine` apart at both ends, where contacts are."""
    fine = coarse if fine is None else fine
    t = np.linspace(start, end, 257)
    wanted = np.minimum(coarse, fine + growth * np.minimum(t - start, end - t))
    density = 1.0 / wanted
    count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(t))])
    steps = max(1, int(np.ceil(count[-1] - 0.25)))
    return np.interp(np.linspace(0.0, count[-1], steps + 1), count, t)


def graded_between(stops: Sequence[float], coarse: float, fine: float) -> Points:
    """`graded` between each two neighbouring stops, one list."""
    pieces = [graded(a, b, coarse, fine)[:-1] for a, b in itertools.pairwise(stops)]
    return np.concatenate([*pieces, np.array([stops[-1]])])


def grid_faces(rows: int, columns: int) -> Faces:
    """Two triangles a cell of a grid of points; the normal is (along rows) × (along columns)."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1)
    a, b, c, d = corner, corner + columns, corner + columns + 1, corner + 1
    # Alternating diagonals: no direction is favoured.
    odd = ((corner // columns + corner % columns) % 2 == 1)[:, None]
    first = np.where(odd, np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(odd, np.stack([b, c, d], 1), np.stack([a, c, d], 1))
    return np.stack([first, second], 1).reshape(-1, 3)


def sheet(points: Points) -> Solid:
    """A grid of points, shape (rows, columns, 3), as a sheet."""
    return Solid(points.reshape(-1, 3), grid_faces(*points.shape[:2]))


def lattice(xs: Points, ys: Points, zs: Points) -> Solid:
    """The surface of a box with the given lines on its sides."""
    lines = (np.asarray(xs), np.asarray(ys), np.asarray(zs))
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


def box(low: Vector, high: Vector, coarse: float = 0.5, fine: float | None = None) -> Solid:
    """A box, its sides subdivided by `graded`."""
    return lattice(*(graded(low[i], high[i], coarse, fine) for i in range(3)))


def revolved(profile: Sequence[tuple[float, float]], segments: int, *, start: float = 0.0) -> Solid:
    """A closed surface of revolution about +Y.

    Args:
        profile: Radius and height, from the bottom of the outside to the top; ends of radius 0 close it.
        segments: Steps around.
        start: Angle of the first meridian in degrees.
    """
    angles = np.radians(start + np.arange(segments + 1) * (360.0 / segments))
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


def tube(path: Points, radii: Points, sides: int) -> Solid:
    """A tapering tube along a path, shape (n, 3), open below and pointed or open above."""
    directions = np.gradient(path, axis=0)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    helper = np.where(np.abs(directions[:, 1:2]) > 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    u = np.cross(helper, directions)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(directions, u)
    angles = np.arange(sides + 1) * (2 * np.pi / sides)
    around = np.cos(angles)[None, :, None] * u[:, None] + np.sin(angles)[None, :, None] * v[:, None]
    return welded(sheet(path[:, None] + radii[:, None, None] * around).flipped())


def icosphere(levels: int) -> Solid:
    """A unit sphere of 20·4^levels triangles."""
    g = (1 + 5**0.5) / 2
    corners = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    corners += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = "0 11 5 0 5 1 0 1 7 0 7 10 0 10 11 1 5 9 5 11 4 11 10 2 10 7 6 7 1 8"
    faces += " 3 9 4 3 4 2 3 2 6 3 6 8 3 8 9 4 9 5 2 4 11 6 2 10 8 6 7 9 8 1"
    solid = Solid(np.array(corners) / np.hypot(1, g), np.array(faces.split(), np.int64).reshape(-1, 3))
    for _ in range(levels):
        solid = _split_in_four(solid)
        solid = Solid(solid.positions / np.linalg.norm(solid.positions, axis=1, keepdims=True), solid.faces)
    return solid


def _split_in_four(solid: Solid) -> Solid:
    edges = np.sort(solid.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    a, b, c = solid.faces.T
    ab, bc, ca = (inverse.reshape(-1, 3) + len(solid.positions)).T
    faces = np.concatenate([np.stack(t, 1) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    return Solid(np.concatenate([solid.positions, solid.positions[unique].mean(axis=1)]), faces)


def boulder(levels: int, size: Vector, roughness: float, seed: int) -> Solid:
    """A sphere pushed in and out by noise."""
    solid = icosphere(levels)
    bumps = value_noise(solid.positions * 1.3 + 7.0, seed) + 0.45 * value_noise(solid.positions * 3.1 + 3.0, seed + 1)
    return welded(Solid(solid.positions * (1.0 + roughness * bumps)[:, None] * np.asarray(size), solid.faces))


def height_field(xs: Points, zs: Points, height: Callable[[Points, Points], Points]) -> Solid:
    """Ground over the lines `xs` and `zs`, facing +Y; `height` takes and gives arrays."""
    x, z = np.meshgrid(xs, zs, indexing="ij")
    return welded(sheet(np.stack([x, height(x, z), z], axis=-1)).flipped())


def warped(solid: Solid, change: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> Solid:
    """Every position sent through `change`, which takes and gives shape (n, 3)."""
    return welded(Solid(change(solid.positions), solid.faces))
