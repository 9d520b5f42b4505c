"""Parts of a scene that stand for the whole: patches of neighbouring faces, with all of the scene around them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from bake.geometry import face_normals
from bake.types import BoolArray, Float64Array, Int64Array, SampleSet, World

PATCH_FACES = 60
_MOST_PATCHES = 1000


@dataclass(frozen=True, slots=True)
class Patches:
    """Patches drawn half by area and half evenly over the faces that have samples.

    Attributes:
        count: How many.
        world: Their faces alone; vertices as in the whole.
        samples: Theirs, n, with faces of the patches' own world.
        traced: The same with faces of the whole.
        rows: Shape (n,): their rows among the scene's samples.
        share: Shape (v,): the part of the scene that each vertex stands for, half by area and half by faces; 0 where
            faces are missing.
    """

    count: int
    world: World
    samples: SampleSet
    traced: SampleSet
    rows: Int64Array
    share: Float64Array


def patches_of(world: World, samples: SampleSet, seed: int, most: int) -> Patches:
    """Patches with at most `most` samples together, or a single one.

    A face counts for its share of the scene over its chance to be drawn (Horvitz and Thompson 1952). Since it is drawn
    by that share, no face counts for more than a patch does, however large it is.
    """
    sampled = np.unique(samples.face).astype(np.int64)
    corners = world.positions[world.faces[sampled]]
    area = face_normals(world.positions, world.faces[sampled])[1]
    drawn = 0.5 * area / area.sum() + 0.5 / len(sampled)
    tree, centres = cKDTree(corners.mean(axis=1)), corners.mean(axis=1)
    middles = np.random.default_rng(seed).choice(len(sampled), _MOST_PATCHES, p=drawn)
    size = min(PATCH_FACES, len(sampled))
    near = np.asarray(tree.query(centres[middles], size)[1]).reshape(len(middles), size)
    each = np.bincount(samples.face, minlength=world.face_count)[sampled]
    count, some = 0, np.zeros(len(sampled), np.bool_)
    while count < len(near):
        some[near[count]] = True
        if count and int(each[some].sum()) > most:
            break
        count += 1
    found, times = np.unique(near[:count], return_counts=True)
    around = np.asarray(tree.query(centres[found], size)[1]).reshape(len(found), size)
    inverse = times / drawn[around].sum(axis=1) / count
    faces = sampled[found]

    here: BoolArray = np.zeros(world.face_count, np.bool_)
    here[faces] = True
    touching = here | ~world.face_samples  # slivers have no samples and can be missed
    missing = np.bincount(world.faces[~touching].ravel(), minlength=world.vertex_count) > 0
    part = np.repeat(drawn[found] * inverse / 3.0, 3)
    share = np.where(missing, 0.0, np.bincount(world.faces[faces].ravel(), part, world.vertex_count))
    rows = np.flatnonzero(here[samples.face])
    traced = samples.only(rows)
    local = np.searchsorted(faces, traced.face)
    own = replace(traced, face=local.astype(np.int32), face_seed=samples.face_seed[faces])
    return Patches(count, _faces_of(world, faces), own, traced, rows, share)


def whole_of(world: World, samples: SampleSet) -> Patches:
    """All of a scene as its one patch."""
    sampled = np.unique(samples.face).astype(np.int64)
    area = face_normals(world.positions, world.faces[sampled])[1]
    part = np.repeat((0.5 * area / area.sum() + 0.5 / len(sampled)) / 3.0, 3)
    share = np.bincount(world.faces[sampled].ravel(), part, world.vertex_count).astype(np.float64)
    return Patches(1, world, samples, samples, np.arange(len(samples)), share)


def _faces_of(world: World, faces: Int64Array) -> World:
    """A world of some faces, in their order."""
    return replace(
        world,
        faces=world.faces[faces],
        face_object=world.face_object[faces],
        face_casts=world.face_casts[faces],
        face_samples=world.face_samples[faces],
        face_two_sided=world.face_two_sided[faces],
        face_openness=world.face_openness[faces],
        first_face=np.searchsorted(faces, world.first_face).astype(np.int64),
        face_texture=None if world.face_texture is None else world.face_texture[faces],
    )
