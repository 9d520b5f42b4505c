"""Worlds and samples for the mapping, made without tracing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bake.types import SampleSet, World


def grid(nx: int, ny: int, *, size: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """A flat grid of (nx + 1)(ny + 1) vertices in the plane z = 0, facing +z."""
    x, y = np.meshgrid(np.linspace(0, size, nx + 1), np.linspace(0, size, ny + 1), indexing="ij")
    positions = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    i, j = np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij")
    a = (i * (ny + 1) + j).ravel()
    b, c, d = a + ny + 1, a + ny + 2, a + 1
    return positions, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def soup(positions: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same surface with three vertices of its own for every face."""
    return positions[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)


def moved(positions: np.ndarray, along_x: float) -> np.ndarray:
    """Positions moved along x."""
    return positions + np.array([along_x, 0.0, 0.0])


def random_samples(world: World, per_face: int, *, seed: int = 1) -> SampleSet:
    """`per_face` random samples on every face that takes samples."""
    rng = np.random.default_rng(seed)
    face = np.repeat(np.flatnonzero(world.face_samples), per_face)
    root, v = np.sqrt(rng.random(len(face))), rng.random(len(face))
    a, b, c = np.moveaxis(world.positions[world.faces], 1, 0)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return SampleSet(
        face=face.astype(np.int32),
        barycentric=np.column_stack([1 - root, v * root]).astype(np.float32),
        area=(area[face] / per_face).astype(np.float32),
        index=np.tile(np.arange(per_face, dtype=np.int32), len(face) // per_face),
        face_seed=np.zeros(world.face_count, np.uint32),
    )


def points(world: World, samples: SampleSet) -> np.ndarray:
    """Positions of the samples, shape (n, 3)."""
    weights = np.column_stack([samples.barycentric, 1.0 - samples.barycentric.astype(float).sum(1)])
    return np.einsum("ij,ijk->ik", weights, world.positions[world.faces[samples.face]])


def ao_of(world: World, samples: SampleSet, *functions: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """AO of the samples, one column a function of position, shape (n, k), float32."""
    at = points(world, samples)
    return np.column_stack([function(at) for function in functions]).astype(np.float32)
