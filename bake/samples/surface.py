"""Surface samples: how many a face gets, where they lie and how much surface each stands for."""

from __future__ import annotations

import zlib

import numpy as np

from bake.geometry import as_traced, face_normals
from bake.low_discrepancy import hash_u32, owen_sobol
from bake.settings import BakeSettings
from bake.types import Float64Array, Int32Array, Int64Array, SampleSet, UInt32Array, World

_POSITION_SALT = np.uint32(0x68E31DA4)


def place_samples(world: World, settings: BakeSettings) -> SampleSet:
    """Places samples on every face that takes some.

    A face of area A gets one sample per square of edge `sample_spacing`, but at least the minimum and at most the
    maximum (NVIDIA's sample has only the former, Sloan et al. 2013 only the latter); an object's `samples` key
    replaces both. The count depends on the face alone, so an edit elsewhere moves no sample. Each sample stands for an
    equal share of its face, which makes every area integral unbiased.
    """
    areas = face_normals(as_traced(world.positions).astype(np.float64), world.faces)[1]
    counts = samples_per_face(world, areas, settings)
    sample_count = int(counts.sum())
    face = np.repeat(np.arange(world.face_count, dtype=np.int32), counts)
    first = np.cumsum(counts) - counts
    index = (np.arange(sample_count, dtype=np.int64) - first[face]).astype(np.int32)
    seed = face_seeds(world, settings.seed)
    area = (areas / np.maximum(counts, 1)).astype(np.float32)[face]
    return SampleSet(face=face, barycentric=barycentrics(face, index, seed), area=area, index=index, face_seed=seed)


def samples_per_face(world: World, areas: Float64Array, settings: BakeSettings) -> Int64Array:
    """Number of samples of each face, shape (m,)."""
    fewest, most = settings.samples_per_face
    wanted = np.ceil(np.minimum(areas / settings.sample_spacing**2, most))
    counts = np.clip(wanted.astype(np.int64), fewest, most)
    for i, keys in enumerate(world.object_keys):
        if keys.samples is not None:
            counts[world.first_face[i] : world.first_face[i + 1]] = keys.samples
    return np.where(world.face_samples & (areas > 0.0), counts, 0)


def face_seeds(world: World, seed: int) -> UInt32Array:
    """A scramble for each face, shape (m,), from the seed, the object's path and the face's number in the object."""
    paths = np.array([zlib.crc32(path.encode()) for path in world.object_paths], dtype=np.uint32)
    with np.errstate(over="ignore"):
        objects = hash_u32(paths ^ hash_u32(np.full(1, seed, np.uint32)))
        local = (np.arange(world.face_count) - world.first_face[world.face_object]).astype(np.uint32)
        return hash_u32(objects[world.face_object] + hash_u32(local))


def barycentrics(face: Int32Array, index: Int32Array, seed: UInt32Array) -> np.ndarray:
    """Weights of corners 0 and 1 of each sample, shape (n, 2), float32: an Owen-scrambled Sobol sequence a face.

    The square is folded to the triangle by u = 1 - √r₁, v = r₂√r₁ (Turk 1990), which keeps areas.
    """
    r1, r2 = owen_sobol(index, seed[face] ^ _POSITION_SALT)
    root = np.sqrt(r1)
    return np.stack([1.0 - root, r2 * root], axis=1).astype(np.float32)
