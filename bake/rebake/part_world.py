"""A world of only some of its objects."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.types import Int64Array, World


def part_world(world: World, numbers: Int64Array) -> World:
    """Some objects where they lie, in the order given, with nothing around them.

    Args:
        world: The world.
        numbers: Shape (p,), ascending.
    """
    chosen: list[int] = numbers.tolist()
    vertices = [slice(*world.first_vertex[number : number + 2].tolist()) for number in chosen]
    faces = [slice(*world.first_face[number : number + 2].tolist()) for number in chosen]
    first_vertex, first_face = _offsets(vertices), _offsets(faces)

    def joined(values: NDArray[Any], spans: list[slice]) -> NDArray[Any]:
        return np.concatenate([values[span] for span in spans]) if spans else values[:0]

    corners = joined(world.faces, faces)
    starts = np.array([span.start for span in vertices], np.int64)
    shift: Int64Array = np.repeat(first_vertex[:-1] - starts, np.diff(first_face))
    return dataclasses.replace(
        world,
        positions=joined(world.positions, vertices),
        normals=joined(world.normals, vertices),
        faces=(corners + shift[:, None]).astype(np.int32),
        face_object=np.repeat(np.arange(len(faces), dtype=np.int32), np.diff(first_face)),
        face_casts=joined(world.face_casts, faces),
        face_samples=joined(world.face_samples, faces),
        face_two_sided=joined(world.face_two_sided, faces),
        face_openness=joined(world.face_openness, faces),
        first_vertex=first_vertex,
        first_face=first_face,
        object_paths=tuple(world.object_paths[number] for number in chosen),
        object_roles=tuple(world.object_roles[number] for number in chosen),
        object_keys=tuple(world.object_keys[number] for number in chosen),
        object_hash=tuple(world.object_hash[number] for number in chosen),
        vertex_uv=None if world.vertex_uv is None else joined(world.vertex_uv, vertices),
        face_texture=None if world.face_texture is None else joined(world.face_texture, faces),
    )


def _offsets(spans: list[slice]) -> Int64Array:
    return np.concatenate([[0], np.cumsum([span.stop - span.start for span in spans])]).astype(np.int64)
