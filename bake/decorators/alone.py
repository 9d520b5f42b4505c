"""Worlds with one object alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bake.types import ObjectKeys, Role, World


def only(world: World, number: int) -> World:
    """The object `number` where it stands, and nothing else; in tracers' terms, as `with_unhittable_face`."""
    vertices = slice(int(world.first_vertex[number]), int(world.first_vertex[number + 1]))
    faces = slice(int(world.first_face[number]), int(world.first_face[number + 1]))
    alone = replace(
        world,
        positions=world.positions[vertices],
        normals=world.normals[vertices],
        faces=world.faces[faces] - np.int32(vertices.start),
        face_object=np.zeros(faces.stop - faces.start, np.int32),
        face_casts=world.face_casts[faces],
        face_samples=world.face_samples[faces],
        face_two_sided=world.face_two_sided[faces],
        face_openness=world.face_openness[faces],
        first_vertex=np.array([0, vertices.stop - vertices.start], np.int64),
        first_face=np.array([0, faces.stop - faces.start], np.int64),
        object_paths=world.object_paths[number : number + 1],
        object_roles=world.object_roles[number : number + 1],
        object_keys=world.object_keys[number : number + 1],
        object_hash=world.object_hash[number : number + 1],
        vertex_uv=None if world.vertex_uv is None else world.vertex_uv[vertices],
        face_texture=None if world.face_texture is None else world.face_texture[faces],
    )
    return with_unhittable_face(alone)


def with_unhittable_face(world: World) -> World:
    """The world with one more object: a blocker whose only face has no area.

    A tree alone leaves tracers without anything that stops a ray; this gives their BVH its one triangle.
    """
    vertex, count = world.vertex_count, world.object_count
    changes: dict[str, object] = {
        "positions": np.concatenate([world.positions, world.positions[:1]]),
        "normals": np.concatenate([world.normals, np.zeros((1, 3), np.float32)]),
        "faces": np.concatenate([world.faces, np.full((1, 3), vertex, np.int32)]),
        "face_object": np.append(world.face_object, np.int32(count)),
        "face_casts": np.append(world.face_casts, True),
        "face_samples": np.append(world.face_samples, False),
        "face_two_sided": np.append(world.face_two_sided, True),
        "face_openness": np.append(world.face_openness, np.float32(0.0)),
        "first_vertex": np.append(world.first_vertex, vertex + 1),
        "first_face": np.append(world.first_face, world.face_count + 1),
        "object_paths": (*world.object_paths, ""),
        "object_roles": (*world.object_roles, Role.BLOCKER),
        "object_keys": (*world.object_keys, ObjectKeys()),
        "object_hash": (*world.object_hash, ""),
    }
    if world.vertex_uv is not None:
        changes["vertex_uv"] = np.concatenate([world.vertex_uv, np.zeros((1, 2), np.float32)])
    if world.face_texture is not None:
        changes["face_texture"] = np.append(world.face_texture, np.int32(-1))
    return replace(world, **changes)  # pyright: ignore[reportArgumentType]
