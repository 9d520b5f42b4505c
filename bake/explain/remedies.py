"""Remedies at work: on a scene in memory, on the side file, and taken back."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from bake.errors import SceneError
from bake.explain.cause_types import Remedy
from bake.scene.object_keys import check_keys
from bake.scene.side_file_writer import SideFileEdit, apply_edit, edit_side_file, plan_edit
from bake.settings import BakeSettings
from bake.types import Role, Scene, SceneObject


def apply_remedy(scene_path: Path, remedy: Remedy) -> SideFileEdit:
    """Writes a remedy into the scene's side file; every other line stays as it is.

    Args:
        scene_path: The scene file.
        remedy: One that writes (`Remedy.writes`).

    Returns:
        What was done, for `undo`.

    Raises:
        SceneError: the remedy has nothing to write, or the side file cannot be read or edited.
        StorageError: the side file could not be written; it is as it was.
    """
    _check_writes(remedy)
    return edit_side_file(scene_path, remedy.objects, remedy.options or None)


def plan_remedy(scene_path: Path, remedy: Remedy) -> SideFileEdit:
    """What `apply_remedy` would do, without doing it: its bytes can be shown, or applied by `apply_edit`.

    Raises:
        SceneError: as there.
    """
    _check_writes(remedy)
    return plan_edit(scene_path, remedy.objects, remedy.options or None)


def undo(edit: SideFileEdit) -> None:
    """Puts the side file's former bytes back.

    Raises:
        StorageError: it has been changed since, or could not be written; it stays as it is.
    """
    apply_edit(edit.reversed())


def remedied(scene: Scene, remedy: Remedy) -> Scene:
    """The scene as it would be read with the remedy in its side file.

    Raises:
        SceneError: a key or value that no side file may have.
    """
    said = {path: check_keys(keys, path) for path, keys in remedy.objects.items()}
    unknown = set(said) - {item.path for item in scene.objects}
    if unknown:
        raise SceneError("no such object", where=min(unknown), remedy="bake the scene again")
    objects = tuple(_with_keys(item, said[item.path]) if item.path in said else item for item in scene.objects)
    return dataclasses.replace(scene, objects=objects)


def remedied_settings(settings: BakeSettings, remedy: Remedy) -> BakeSettings:
    """The settings with the remedy's options.

    Raises:
        SettingsError: an option is unknown or out of its bounds.
    """
    if not remedy.options:
        return settings
    return BakeSettings.from_options({**settings.to_json(), **remedy.options})


def _with_keys(item: SceneObject, said: dict[str, Any]) -> SceneObject:
    keys = {name: value for name, value in said.items() if name != "role"}
    role: Role = said.get("role", item.role)
    return dataclasses.replace(item, role=role, keys=dataclasses.replace(item.keys, **keys))


def _check_writes(remedy: Remedy) -> None:
    if not remedy.writes:
        raise SceneError("no side file can say this", where=remedy.text, remedy="change the model")
