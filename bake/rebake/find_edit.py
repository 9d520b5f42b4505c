"""Finds out what an edit is: by comparing the scene as it is now with the bake."""

from __future__ import annotations

import dataclasses

import numpy as np

from bake.decorators.fog import make_fog
from bake.pipeline import versions
from bake.rebake.casters import changed_casters
from bake.rebake.changes import compare
from bake.rebake.setting_changes import FOG, settings_change
from bake.rebake.state import Edit, State
from bake.regions.source_files import region_files
from bake.scene import flatten
from bake.scene.content_hash import ContentHasher
from bake.scene.reflatten import reflatten
from bake.settings import BakeSettings
from bake.types import BakeResult, BoolArray, Int64Array, Role, Scene, World


@dataclasses.dataclass(frozen=True, slots=True)
class NoEdit:
    """Why the scene has to be baked in full.

    Attributes:
        why: As the report says it.
        scene: With all its files named.
    """

    why: str
    scene: Scene


def find_edit(
    state: State,
    scene: Scene,
    settings: BakeSettings,
    *,
    objects: frozenset[str] | None = None,
    faces: Int64Array | None = None,
) -> Edit | NoEdit:
    """What differs, or why a whole bake is needed.

    Args:
        state: Before the edit.
        scene, settings: As wanted now.
        objects, faces: What may change; see `RebakeSession.rebake`.
    """
    result = state.result
    scene = dataclasses.replace(scene, files={**scene.files, **region_files(scene, settings)})
    change = settings_change(result.settings, settings)
    if change.full:
        return NoEdit(f"changed settings: {', '.join(change.full)}", scene)
    if dict(result.versions) != versions():
        return NoEdit("the result was baked by other versions of the program or its libraries", scene)
    if settings.adaptive_error is not None:
        return NoEdit("adaptive rays: how many a sample sends hangs on all others, so they are traced whole", scene)
    world = _flattened(state, scene, settings)
    if not np.array_equal(world.origin, result.world.origin):
        return NoEdit("most of the level stands elsewhere: its origin moves, all positions are rounded anew", scene)
    how = compare(result.world, world)
    fog = state.fog
    if change.any_of(FOG) or world.object_paths != result.world.object_paths or _shrubs(world) != _shrubs(result.world):
        fog = make_fog(world, settings)
    wanted = _wanted_faces(world, objects, faces)
    vertices = np.ones(world.vertex_count, np.bool_)
    if not wanted.all():
        vertices[:] = False
        vertices[world.faces[wanted]] = True
    return Edit(
        scene=scene,
        settings=settings,
        world=world,
        fog=fog,
        change=how,
        casters=changed_casters(result.world, world, how, state.fog, fog),
        settings_change=change,
        wanted=vertices,
        wanted_faces=wanted,
    )


def is_baked_from(result: BakeResult, scene: Scene) -> bool:
    """Whether a scene is what a result was baked from, object by object."""
    hasher, world = ContentHasher(scene), result.world
    count = len(scene.objects)
    return (
        tuple(item.path for item in scene.objects) == world.object_paths[:count]
        and world.object_count - count == (result.settings.ground is not None)
        and tuple(hasher.object_hash(item) for item in scene.objects) == world.object_hash[:count]
    )


def _flattened(state: State, scene: Scene, settings: BakeSettings) -> World:
    """The edited world, as a bake would have it."""
    if state.scene is None:
        return flatten(scene, settings)
    return reflatten(state.result.world, state.scene, scene, settings)


def _wanted_faces(world: World, objects: frozenset[str] | None, faces: Int64Array | None) -> BoolArray:
    if objects is None and faces is None:
        return np.ones(world.face_count, np.bool_)
    chosen = np.zeros(world.face_count, np.bool_)
    if objects is not None:
        chosen |= np.array([path in objects for path in world.object_paths], np.bool_)[world.face_object]
    if faces is not None:
        chosen[faces] = True
    return chosen


def _shrubs(world: World) -> list[tuple[str, str]]:
    rows = zip(world.object_paths, world.object_hash, world.object_roles, strict=True)
    return [(path, digest) for path, digest, role in rows if role is Role.SHRUB]
