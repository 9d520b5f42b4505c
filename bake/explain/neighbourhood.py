"""What AO is usual around a vertex: along the surface, and in space across surfaces that are not connected."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.types import BoolArray, Float32Array, Float64Array, Int64Array, SampleSet, World

RINGS = 3
MOST_SAMPLES = 1_000_000  # for the neighbourhood in space; more tell no more about a mean


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What lies around each vertex.

    Attributes:
        along: Shape (n,), float32: mean AO within three rings of faces, whichever object they belong to.
        near: Shape (n,), float32: mean AO of the surface within a few metres, connected or not.
        spread: Shape (n,), float32: standard deviation of that.
    """

    along: Float32Array
    near: Float32Array
    spread: Float32Array


@dataclass(frozen=True, slots=True)
class BakedFaces:
    """The faces whose three vertices have values.

    Attributes:
        face: Shape (m,), int64, index into `World.faces`.
        corners: Shape (m, 3), int32, vertices.
        places: Shape (m, 3), int64: numbers of distinct positions.
        place: Shape (n,), int64: of each vertex.
        area: Shape (m,), float64, m².
    """

    face: Int64Array
    corners: Int64Array
    places: Int64Array
    place: Int64Array
    area: Float64Array

    def to_vertices(self, per_face: Float64Array, *, weight: Float64Array | None = None) -> Float64Array:
        """Area-weighted mean over the faces around each vertex, shape (n,); NaN where there are none."""
        area = self.area if weight is None else weight
        count = len(self.place)
        total, mass = np.zeros(count), np.zeros(count)
        for corner in range(3):
            total += np.bincount(self.corners[:, corner], area * per_face, count)
            mass += np.bincount(self.corners[:, corner], area, count)
        return np.divide(total, mass, out=np.full(count, np.nan), where=mass > 0.0)

    def most_at_vertices(self, per_face: Float32Array) -> Float32Array:
        """Largest value on the faces around each vertex, shape (n,); 0 where there are none."""
        most = np.zeros(len(self.place), np.float32)
        for corner in range(3):
            np.maximum.at(most, self.corners[:, corner], per_face)
        return most


def mean_along(faces: BakedFaces, ao: Float64Array) -> Float32Array:
    """Mean AO within `RINGS` rings, shape (n,): values spread from places to faces and back.

    Args:
        faces: With values at all corners.
        ao: Shape (n,).
    """
    size = int(faces.place.max(initial=-1)) + 1
    mass = np.zeros(size)
    for corner in range(3):
        mass += np.bincount(faces.places[:, corner], faces.area, size)
    mass = np.where(mass > 0.0, mass, 1.0)
    value = ao[faces.corners].mean(axis=1)
    mean = np.zeros(size)
    for ring in range(RINGS):
        if ring:
            value = mean[faces.places].mean(axis=1)
        weighted = faces.area * value
        mean = sum((np.bincount(faces.places[:, corner], weighted, size) for corner in range(3)), np.zeros(size)) / mass
    return mean[faces.place].astype(np.float32)


def mean_near(
    world: World, samples: SampleSet, ao: Float32Array, valid: BoolArray, cell: float
) -> tuple[Float32Array, Float32Array]:
    """Mean and standard deviation of AO in space around each vertex, shape (n,) each; NaN where there are no samples.

    Two grids of cells, shifted by half a cell, are averaged, so that no vertex is judged by a border alone.

    Args:
        world: The flattened scene.
        samples: Where AO was estimated.
        ao: Shape (s,).
        valid: Shape (s,).
        cell: Edge of a cell in metres.
    """
    used = np.flatnonzero(valid)
    used = used[:: max(1, len(used) // MOST_SAMPLES)]
    corners = world.faces[samples.face[used]]
    u, v = samples.barycentric[used].T.astype(np.float64)
    points = np.empty((len(used), 3))
    for axis in range(3):
        a, b, c = world.positions[:, axis][corners].T
        points[:, axis] = u * a + v * b + (1.0 - u - v) * c
    area, value = samples.area[used].astype(np.float64), ao[used].astype(np.float64)
    means: list[Float64Array] = []
    squares: list[Float64Array] = []
    for shift in (0.0, 0.5):
        keys, inverse = np.unique(_cells(points, cell, shift), return_inverse=True)
        mass = np.bincount(inverse, area, len(keys))
        mass = np.where(mass > 0.0, mass, 1.0)
        first = np.bincount(inverse, area * value, len(keys)) / mass
        second = np.bincount(inverse, area * value * value, len(keys)) / mass
        wanted = _cells(world.positions, cell, shift)
        place = np.minimum(np.searchsorted(keys, wanted), max(len(keys) - 1, 0))
        known = keys[place] == wanted if len(keys) else np.zeros(len(wanted), np.bool_)
        means.append(np.where(known, first[place], np.nan) if len(keys) else np.full(len(wanted), np.nan))
        squares.append(np.where(known, second[place], np.nan) if len(keys) else np.full(len(wanted), np.nan))
    mean, square = _known_mean(means), _known_mean(squares)
    return mean.astype(np.float32), np.sqrt(np.maximum(square - mean * mean, 0.0)).astype(np.float32)


def _known_mean(columns: list[Float64Array]) -> Float64Array:
    both = np.stack(columns)
    known = np.isfinite(both)
    count = known.sum(axis=0)
    return np.divide(np.where(known, both, 0.0).sum(axis=0), count, out=np.full(len(count), np.nan), where=count > 0)


def _cells(points: Float64Array, cell: float, shift: float) -> Int64Array:
    """One number per cell of a grid, shape (n,); 21 bits an axis."""
    index = np.floor(points / cell + shift).astype(np.int64) & 0x1FFFFF
    return (index[:, 0] << 42) | (index[:, 1] << 21) | index[:, 2]
