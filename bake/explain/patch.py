"""A patch of the surface around a spot, cut out of the scene so that it can be solved by itself."""

from __future__ import annotations

import dataclasses

import numpy as np

from bake.types import BoolArray, Int64Array, SampleSet, World

NEAR = 1e-3
"""Vertices within about this many metres count as connected: whatever a solve may weld lies closer."""


def rings_around(world: World, vertices: Int64Array, rings: int) -> Int64Array:
    """How many steps each receiving face is from vertices, shape (m,), from 1 to `rings`; 0 for all that are farther.

    Steps cross every seam, welded or not.

    Args:
        world: The flattened scene.
        vertices: Shape (v,).
        rings: Steps from face to face.
    """
    receives = np.array([role.receives_per_vertex for role in world.object_roles], np.bool_)[world.face_object]
    reached = np.zeros(world.vertex_count, np.bool_)
    reached[vertices] = True
    ring = np.zeros(world.face_count, np.int64)
    for step in range(1, rings + 1):
        _join_near(world, reached)
        new = receives & (ring == 0) & reached[world.faces].any(axis=1)
        if not new.any():
            break
        ring[new] = step
        reached[world.faces[new].ravel()] = True
    return ring


def _join_near(world: World, reached: BoolArray) -> None:
    """Adds the vertices that share a small cell with one that is reached."""
    own = world.positions[reached]
    low, high = own.min(axis=0) - NEAR, own.max(axis=0) + NEAR
    near = np.flatnonzero(np.all((world.positions >= low) & (world.positions <= high), axis=1))
    for shift in (0.0, 0.5):
        index = np.floor((world.positions[near] - low) / NEAR + shift).astype(np.int64)
        key = (index[:, 0] * 73856093) ^ (index[:, 1] * 19349663) ^ (index[:, 2] * 83492791)
        reached[near[np.isin(key, np.unique(key[reached[near]]))]] = True


def cut_out(world: World, samples: SampleSet, faces: BoolArray) -> tuple[World, SampleSet, Int64Array, Int64Array]:
    """A world of some faces alone, with their samples.

    Args:
        world: The flattened scene.
        samples: All of its samples.
        faces: Shape (m,): those to keep.

    Returns:
        The part, in which every object remains, though perhaps without faces; its samples; their rows in `samples`;
        and the vertices of the part, indices into the world's.
    """
    kept = np.flatnonzero(faces)
    vertices = np.unique(world.faces[kept]).astype(np.int64)
    place = np.full(world.vertex_count, -1, np.int64)
    place[vertices] = np.arange(len(vertices))
    rows = np.flatnonzero(faces[samples.face])
    face_place = np.full(world.face_count, -1, np.int64)
    face_place[kept] = np.arange(len(kept))
    part = dataclasses.replace(
        world,
        positions=world.positions[vertices],
        normals=world.normals[vertices],
        faces=place[world.faces[kept]].astype(np.int32),
        face_object=world.face_object[kept],
        face_casts=world.face_casts[kept],
        face_samples=world.face_samples[kept],
        face_two_sided=world.face_two_sided[kept],
        face_openness=world.face_openness[kept],
        first_vertex=np.searchsorted(vertices, world.first_vertex),
        first_face=np.searchsorted(kept, world.first_face),
        vertex_uv=None,
        face_texture=None,
        textures=(),
    )
    own = SampleSet(
        face=face_place[samples.face[rows]].astype(np.int32),
        barycentric=samples.barycentric[rows],
        area=samples.area[rows],
        index=samples.index[rows],
        face_seed=samples.face_seed[kept],
    )
    return part, own, rows, vertices
