"""Scene → World once more after an edit: only what changed is expanded anew, the rest is taken over to the bit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.scene.flatten import flatten, flatten_about, origin_of
from bake.settings import BakeSettings
from bake.types import Float64Array, Int64Array, Scene, SceneObject, World


def reflatten(world: World, before: Scene, scene: Scene, settings: BakeSettings) -> World:
    """What `flatten(scene, settings)` makes, in a fraction of its time after a small edit.

    Objects count as unchanged by the identity of their meshes and materials, as `SceneReader` keeps it, and by the
    values of all else.

    Args:
        world: What `before` was flattened to, with the same settings.
        before: The scene before the edit.
        scene: The scene now.
        settings: `ground` and `alpha_lookup` matter.

    Raises:
        SceneError: as `flatten`.
    """
    same_materials = len(before.materials) == len(scene.materials) and all(
        a is b for a, b in zip(before.materials, scene.materials, strict=True)
    )
    known = {item.path: number for number, item in enumerate(before.objects)}
    old = np.array([_unchanged(known, before, scene, item) for item in scene.objects], np.int64)
    whole = settings.ground is not None or not same_materials or world.object_count != len(before.objects)
    if whole or (old < 0).all():
        return flatten(scene, settings)
    if np.array_equal(old, np.arange(world.object_count)):
        return world
    fresh: World | None = None
    anew = np.flatnonzero(old < 0)
    if len(anew):
        part = replace(scene, objects=tuple(scene.objects[number] for number in anew), regions=(), findings=())
        fresh = flatten_about(part, settings, world.origin)
    result = _joined(world, fresh, old, scene)
    return result if _origin_stays(result) else flatten(scene, settings)


def _unchanged(known: dict[str, int], before: Scene, scene: Scene, item: SceneObject) -> int:
    number = known.get(item.path, -1)
    if number < 0:
        return -1
    other = before.objects[number]
    same = (
        before.meshes[other.mesh] is scene.meshes[item.mesh]
        and other.role is item.role
        and other.keys == item.keys
        and np.array_equal(other.transform, item.transform)
    )
    return number if same else -1


def _joined(world: World, fresh: World | None, old: Int64Array, scene: Scene) -> World:
    """The objects of two worlds in the order of the scene; `old` tells the first world's, the others come in order."""
    sources = (world, fresh if fresh is not None else world)
    place = np.where(old >= 0, old, np.cumsum(old < 0) - 1)
    runs = _runs(place, old < 0)
    numbers: list[tuple[int, int]] = np.stack((old, place), axis=1).tolist()
    owners = [(sources[1] if number < 0 else sources[0], at) for number, at in numbers]
    vertex_counts = [int(source.first_vertex[at + 1] - source.first_vertex[at]) for source, at in owners]
    face_counts = [int(source.first_face[at + 1] - source.first_face[at]) for source, at in owners]
    first_vertex, first_face = _offsets(vertex_counts), _offsets(face_counts)

    def vertices(name: str) -> NDArray[Any]:
        return np.concatenate([_piece(sources[is_new], name, "first_vertex", run) for run, is_new, _ in runs])

    def faces(name: str) -> NDArray[Any]:
        return np.concatenate([_piece(sources[is_new], name, "first_face", run) for run, is_new, _ in runs])

    corners = [
        _piece(sources[is_new], "faces", "first_face", run)
        + np.int32(first_vertex[begin] - sources[is_new].first_vertex[run.start])
        for run, is_new, begin in runs
    ]
    return replace(
        world,
        positions=vertices("positions"),
        normals=vertices("normals"),
        faces=np.concatenate(corners),
        face_object=np.repeat(np.arange(len(old), dtype=np.int32), face_counts),
        face_casts=faces("face_casts"),
        face_samples=faces("face_samples"),
        face_two_sided=faces("face_two_sided"),
        face_openness=faces("face_openness"),
        first_vertex=first_vertex,
        first_face=first_face,
        object_paths=tuple(item.path for item in scene.objects),
        object_roles=tuple(item.role for item in scene.objects),
        object_keys=tuple(item.keys for item in scene.objects),
        object_hash=tuple(source.object_hash[at] for source, at in owners),
        vertex_uv=None if world.vertex_uv is None else vertices("vertex_uv"),
        face_texture=None if world.face_texture is None else faces("face_texture"),
    )


def _runs(place: Int64Array, is_new: NDArray[np.bool_]) -> list[tuple[slice, bool, int]]:
    """Objects that follow each other in their world as well: their span there, whether it is the new one, and the
    first one's place in the result."""
    breaks = np.flatnonzero((np.diff(place) != 1) | (is_new[1:] != is_new[:-1])) + 1
    begins, ends = [0, *breaks.tolist()], [*breaks.tolist(), len(place)]
    return [
        (slice(int(place[begin]), int(place[end - 1]) + 1), bool(is_new[begin]), begin)
        for begin, end in zip(begins, ends, strict=True)
    ]


def _offsets(counts: Sequence[int]) -> Int64Array:
    return np.concatenate(([0], np.cumsum(counts, dtype=np.int64))).astype(np.int64)


def _piece(world: World, name: str, offsets: str, run: slice) -> NDArray[Any]:
    first = getattr(world, offsets)
    return getattr(world, name)[first[run.start] : first[run.stop]]


def _origin_stays(world: World) -> bool:
    """Whether `flatten` would choose the world's origin too."""
    held = np.diff(world.first_vertex)
    starts = world.first_vertex[:-1][held > 0]
    low: Float64Array = np.minimum.reduceat(world.positions, starts, axis=0) + world.origin
    high: Float64Array = np.maximum.reduceat(world.positions, starts, axis=0) + world.origin
    roles = [role for role, count in zip(world.object_roles, held, strict=True) if count > 0]
    return np.array_equal(origin_of(roles, low, high, held[held > 0]), world.origin)
