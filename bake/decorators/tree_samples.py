"""Points on trees at which gold signal and model are compared: chosen once a mesh, placed on every instance."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from bake.arrays import Float32Array, Float64Array, Int32Array
from bake.geometry import as_traced, face_normals, shading_normals
from bake.low_discrepancy import hash_u32, owen_sobol
from bake.scene_types import Mesh
from bake.types import SampleSet, World

FEWEST, MOST, PER_FACE = 512, 4096, 4
"""Samples a tree: four unknowns need hundreds, and detail smaller than a thousandth of the tree is no global AO."""

_SALT = np.uint32(0x7C0FFEE1)


@dataclass(frozen=True, slots=True)
class MeshSamples:
    """Samples on a mesh, each standing for the same area in object space.

    Attributes:
        face: Shape (n,), int32, index into the mesh's faces, ascending.
        weights: Shape (n, 3), float64: barycentric weights of the face's corners.
        expected: Shape (m,), float64: samples that each face gets on average; 0 for faces without area.
    """

    face: Int32Array
    weights: Float64Array
    expected: Float64Array

    def __len__(self) -> int:
        return len(self.face)

    def interpolate(self, mesh: Mesh, values: Float32Array) -> Float64Array:
        """Vertex values, shape (v, k), at the samples, shape (n, k)."""
        return np.einsum("ij,ijk->ik", self.weights, values[mesh.faces[self.face]].astype(np.float64))


@dataclass(frozen=True, slots=True)
class PlacedSamples:
    """The same samples on one instance.

    Attributes:
        face: Shape (n,), int32, index into `World.faces`.
        weights: Shape (n, 3), float64, in the order of the world's corners.
        points: Shape (n, 3), float64, metres relative to `World.origin`.
        normals: Shape (n, 3), float64, unit: shading normals on the face's side; zero where nothing gives one.
        area: Shape (n,), float64: the surface that each stands for, in m².
    """

    face: Int32Array
    weights: Float64Array
    points: Float64Array
    normals: Float64Array
    area: Float64Array

    def every(self, step: int) -> PlacedSamples:
        """Each `step`th of them, which stand for the whole as well."""
        return PlacedSamples(
            face=self.face[::step],
            weights=self.weights[::step],
            points=self.points[::step],
            normals=self.normals[::step],
            area=self.area[::step] * step,
        )


def sample_mesh(mesh: Mesh) -> MeshSamples:
    """Spreads samples evenly over a mesh's area; over its faces alike if it has none."""
    count = int(np.clip(PER_FACE * len(mesh.faces), FEWEST, MOST))
    areas = face_normals(mesh.positions, mesh.faces)[1]
    total = areas.sum()
    share = areas / total if total > 0.0 else np.full(len(areas), 1.0 / len(areas))
    upto = np.cumsum(share)
    face = np.searchsorted(upto / upto[-1], (np.arange(count) + 0.5) / count).astype(np.int32)
    r1, r2 = owen_sobol(np.arange(count), np.full(count, _SALT))
    root = np.sqrt(r1)
    weights = np.stack([1.0 - root, r2 * root, root - r2 * root], axis=1)
    return MeshSamples(face, weights, count * share)


def place(samples: MeshSamples, mesh: Mesh, world: World, number: int) -> PlacedSamples:
    """A mesh's samples on the object `number` that instances it."""
    first = world.first_face[number]
    face = (samples.face + first).astype(np.int32)
    corners = world.faces[face]
    # A mirrored instance has its corners in reverse; the weights belong to the mesh's.
    mirrored = corners[:, 0] - world.first_vertex[number] != mesh.faces[samples.face, 0]
    weights = np.where(mirrored[:, None], samples.weights[:, ::-1], samples.weights)
    positions = as_traced(world.positions[world.first_vertex[number] : world.first_vertex[number + 1]])
    own = world.faces[first : world.first_face[number + 1]] - np.int32(world.first_vertex[number])
    normal, areas = face_normals(positions.astype(np.float64), own)
    points = np.einsum("ij,ijk->ik", weights, positions[own[samples.face]].astype(np.float64))
    normals = shading_normals(world.normals[corners], weights, normal[samples.face])
    area = areas[samples.face] / samples.expected[samples.face]
    if not area.any():  # nothing has any area: all points count alike
        area = np.ones(len(face))
    return PlacedSamples(face, weights, points, normals, area)


def as_sample_set(placed: PlacedSamples, world: World, seed: int) -> SampleSet:
    """The samples of one instance in the form that tracers take."""
    order = np.arange(len(placed.face), dtype=np.int64)
    begins = np.flatnonzero(np.diff(placed.face, prepend=-1))
    index = order - np.repeat(begins, np.diff(begins, append=len(order)))
    return SampleSet(
        face=placed.face,
        barycentric=np.ascontiguousarray(placed.weights[:, :2], np.float32),
        area=placed.area.astype(np.float32),
        index=index.astype(np.int32),
        face_seed=_face_seeds(world.object_paths, world.first_face.tobytes(), seed),
    )


@lru_cache(maxsize=2)  # a fit and its check, for one tree after the other of a world with millions of faces
def _face_seeds(paths: tuple[str, ...], first_face: bytes, seed: int) -> np.ndarray[tuple[int], np.dtype[np.uint32]]:
    """A scramble for each face from its object's path and its number there: stable under edits elsewhere."""
    counts = np.diff(np.frombuffer(first_face, np.int64))
    names = np.array([zlib.crc32(path.encode()) for path in paths], np.uint32)
    with np.errstate(over="ignore"):
        objects = np.repeat(hash_u32(names ^ hash_u32(np.full(1, ~seed & 0xFFFFFFFF, np.uint32))), counts)
        local = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
        seeds = hash_u32(objects + hash_u32(local.astype(np.uint32)))
    seeds.flags.writeable = False
    return seeds
