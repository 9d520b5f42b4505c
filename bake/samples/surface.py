"""Surface samples: how many a face gets, where they lie and how much surface each stands for."""

from __future__ import annotations

import zlib
from itertools import pairwise

import numpy as np

from bake.geometry import as_traced
from bake.in_parts import AT_ONCE, in_parts, in_spans
from bake.low_discrepancy import hash_u32, owen_sobol
from bake.settings import BakeSettings
from bake.triangles import Triangles, cross, dot
from bake.types import Float32Array, Float64Array, Int32Array, Int64Array, SampleSet, UInt32Array, World

_POSITION_SALT = np.uint32(0x68E31DA4)


def place_samples(world: World, settings: BakeSettings) -> SampleSet:
    """Places samples on every face that takes some.

    A face of area A gets one sample per square of edge `sample_spacing`, but at least the minimum and at most the
    maximum (NVIDIA's sample has only the former, Sloan et al. 2013 only the latter); an object's `samples` key
    replaces both. The count depends on the face alone, so an edit elsewhere moves no sample. Each sample stands for an
    equal share of its face, which makes every area integral unbiased.
    """
    faces = world.face_count
    count, share, seed = np.zeros(faces, np.int64), np.empty(faces, np.float32), np.empty(faces, np.uint32)
    triangles = Triangles(as_traced(world.positions), world.faces)
    declared, seeds = _declared(world), _object_seeds(world, settings.seed)

    def prepare(begin: int, end: int) -> None:
        here = slice(begin, end)
        own, area = world.face_object[here], _areas(triangles, begin, end)
        takes = world.face_samples[here] & (area > 0.0)
        count[here] = np.where(takes, _samples_per_face(area, declared[own], settings), 0)
        share[here] = area / np.maximum(count[here], 1)
        seed[here] = _face_seeds(seeds[own], np.arange(begin, end) - world.first_face[own])

    in_parts(prepare, faces)
    ends = np.cumsum(count)
    total = int(count.sum())
    face, index, area = np.empty(total, np.int32), np.empty(total, np.int32), np.empty(total, np.float32)
    barycentric = np.empty((total, 2), np.float32)

    def place(begin: int, end: int) -> None:
        own, first = count[begin:end], ends[begin:end] - count[begin:end]
        here = slice(int(first[0]), int(ends[end - 1]))
        face[here] = np.repeat(np.arange(begin, end, dtype=np.int32), own)
        index[here] = np.arange(here.start, here.stop) - np.repeat(first, own)
        area[here] = np.repeat(share[begin:end], own)
        barycentric[here] = _barycentrics(index[here], np.repeat(seed[begin:end], own))

    # the faces on which every so manyth sample lies
    bounds = np.append(np.unique(np.searchsorted(ends, np.arange(0, total, AT_ONCE), "right")), faces)
    in_spans(place, pairwise(bounds.tolist()))
    return SampleSet(face=face, barycentric=barycentric, area=area, index=index, face_seed=seed)


def _areas(triangles: Triangles, begin: int, end: int) -> Float64Array:
    """Of faces `begin` to `end`, shape (m,), m²."""
    ab, _, ca = triangles.sides(begin, end)
    normal = cross(ab, (-ca[0], -ca[1], -ca[2]))
    return 0.5 * np.sqrt(dot(normal, normal))


def _declared(world: World) -> Int64Array:
    """Each object's own number of samples a face, -1 where it has none, shape (o,)."""
    return np.array([-1 if keys.samples is None else keys.samples for keys in world.object_keys], np.int64)


def _samples_per_face(area: Float64Array, declared: Int64Array, settings: BakeSettings) -> Int64Array:
    """Number of samples of faces that take some, shape (m,)."""
    fewest, most = settings.samples_per_face
    wanted = np.ceil(np.minimum(area / settings.sample_spacing**2, most))
    return np.where(declared >= 0, declared, np.clip(wanted.astype(np.int64), fewest, most))


def _object_seeds(world: World, seed: int) -> UInt32Array:
    """A scramble for each object, shape (o,), from the seed and the object's path."""
    paths = np.array([zlib.crc32(path.encode()) for path in world.object_paths], dtype=np.uint32)
    return hash_u32(paths ^ hash_u32(np.full(1, seed, np.uint32)))


def _face_seeds(objects: UInt32Array, local: Int64Array) -> UInt32Array:
    """A scramble for each face, shape (m,), from its object's and its number in the object."""
    return hash_u32(objects + hash_u32(local.astype(np.uint32)))


def _barycentrics(index: Int32Array, seed: UInt32Array) -> Float32Array:
    """Weights of corners 0 and 1 of each sample, shape (n, 2): an Owen-scrambled Sobol sequence a face.

    The square is folded to the triangle by u = 1 - √r₁, v = r₂√r₁ (Turk 1990), which keeps areas.
    """
    r1, r2 = owen_sobol(index, seed ^ _POSITION_SALT)
    root = np.sqrt(r1)
    return np.stack([1.0 - root, r2 * root], axis=1).astype(np.float32)
