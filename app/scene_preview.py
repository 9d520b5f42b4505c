"""The geometry in view with every object where the scene's files have it now, before anything is baked anew."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from bake.types import BakeResult, Scene, VertexField, VertexState, World


def preview_world(base: World, scene: Scene, hashes: Mapping[str, str]) -> World:
    """A world that numbers the objects of `base` as it does, places them as the scene does, and adds new ones.

    What is gone stays, and so does an object that has another number of vertices or triangles now.

    Args:
        base: As baked, or as opened.
        scene: As its files are now.
        hashes: Content hash of each of its objects by path.

    Returns:
        `base` itself if nothing differs.
    """
    from bake.scene.flatten import flatten_about
    from bake.settings import BakeSettings

    numbers = {item.path: number for number, item in enumerate(scene.objects)}
    known = set(base.object_paths)
    targets, moved = [], []
    for index, (path, digest) in enumerate(zip(base.object_paths, base.object_hash, strict=True)):
        if path in numbers and hashes[path] != digest:
            targets.append(index)
            moved.append(numbers[path])
    added = [number for path, number in numbers.items() if path not in known]
    if not moved and not added:
        return base
    part = replace(scene, objects=tuple(scene.objects[number] for number in (*moved, *added)), regions=(), findings=())
    fresh = flatten_about(part, BakeSettings(), base.origin)
    world = _moved(base, fresh, targets)
    return _extended(world, fresh, len(moved)) if added else world


def padded_result(result: BakeResult, world: World) -> BakeResult:
    """A result with a world that was extended by `preview_world`: its new vertices have no values yet."""
    more = world.vertex_count - result.world.vertex_count
    if more <= 0:
        return result
    field = padded_field(result.field, world.vertex_count)
    baked = (*result.world.object_hash, *("" for _ in range(world.object_count - result.world.object_count)))
    return replace(result, world=replace(world, object_hash=baked), field=field)


def padded_field(field: VertexField, count: int) -> VertexField:
    """Values with a place for every vertex of an extended world, of which there are `count`; itself if it has that."""
    more = count - len(field.state)
    if more <= 0:
        return field
    ao, state = np.asarray(field.ao), np.asarray(field.state)
    return VertexField(
        np.concatenate((ao, np.full((more, ao.shape[1]), np.nan, ao.dtype))),
        np.concatenate((state, np.full(more, VertexState.UNREFERENCED, state.dtype))),
        field.report,
    )


def _moved(base: World, fresh: World, targets: list[int]) -> World:
    """`base` with the first objects of `fresh` in the places of `targets`."""
    names = ("positions", "normals")
    arrays: dict[str, Any] = {name: np.array(getattr(base, name)) for name in names}
    faces = base.faces
    hashes = list(base.object_hash)
    for number, index in enumerate(targets):
        own, new = _vertices(base, index), _vertices(fresh, number)
        own_faces, new_faces = _faces(base, index), _faces(fresh, number)
        if _length(own) != _length(new) or _length(own_faces) != _length(new_faces):
            continue
        for name in names:
            arrays[name][own] = getattr(fresh, name)[new]
        corners = np.asarray(fresh.faces)[new_faces] + np.int32(own.start - new.start)
        if not np.array_equal(corners, base.faces[own_faces]):  # else whoever knows these faces knows them again
            faces = np.array(faces) if faces is base.faces else faces
            faces[own_faces] = corners
        hashes[index] = fresh.object_hash[number]
    return replace(base, **arrays, faces=faces, object_hash=tuple(hashes))


def _extended(base: World, fresh: World, first: int) -> World:
    """`base` with the objects of `fresh` from the `first` on behind its own."""
    vertex, face = int(fresh.first_vertex[first]), int(fresh.first_face[first])
    old_vertices, old_faces = base.vertex_count, base.face_count

    def joined(name: str, start: int) -> Any:
        return np.concatenate((np.asarray(getattr(base, name)), np.asarray(getattr(fresh, name))[start:]))

    objects = np.asarray(fresh.face_object)[face:] + (base.object_count - first)
    return replace(
        base,
        positions=joined("positions", vertex),
        normals=joined("normals", vertex),
        faces=np.concatenate((base.faces, fresh.faces[face:] + np.int32(old_vertices - vertex))),
        face_object=np.concatenate((base.face_object, objects)).astype(np.int32),
        face_casts=joined("face_casts", face),
        face_samples=joined("face_samples", face),
        face_two_sided=joined("face_two_sided", face),
        face_openness=joined("face_openness", face),
        first_vertex=np.concatenate((base.first_vertex, fresh.first_vertex[first + 1 :] - vertex + old_vertices)),
        first_face=np.concatenate((base.first_face, fresh.first_face[first + 1 :] - face + old_faces)),
        object_paths=(*base.object_paths, *fresh.object_paths[first:]),
        object_roles=(*base.object_roles, *fresh.object_roles[first:]),
        object_keys=(*base.object_keys, *fresh.object_keys[first:]),
        object_hash=(*base.object_hash, *fresh.object_hash[first:]),
        vertex_uv=None,
        face_texture=None,
        textures=(),
    )


def _vertices(world: World, index: int) -> slice:
    return slice(int(world.first_vertex[index]), int(world.first_vertex[index + 1]))


def _faces(world: World, index: int) -> slice:
    return slice(int(world.first_face[index]), int(world.first_face[index + 1]))


def _length(span: slice) -> int:
    return int(span.stop - span.start)
