"""Roles and keys: what the file declares, overruled by what the side file says."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from bake.errors import SceneError
from bake.scene.object_keys import check_keys, nearest
from bake.scene.parsed import Placement
from bake.scene.placing import PLACING_KEYS, Placer, placed
from bake.scene.side_file import ObjectRule, SideFile
from bake.types import Finding, Mesh, ObjectKeys, Role, SceneObject


def assign_roles(
    placements: Sequence[Placement], side_file: SideFile, file: str, meshes: Sequence[Mesh]
) -> tuple[list[SceneObject], list[Finding]]:
    """Objects in scene order, with roles and keys.

    Key by key, a later `[[object]]` wins over an earlier one, every one over the file's own extras, and what a
    `[[copy]]` says itself over all of them. A pattern is
    a glob in which `*` also crosses `/`; it may match an object's path with its `#1` or without.

    Args:
        placements: As read, in scene order.
        side_file: Checked.
        file: The scene file, for messages.
        meshes: Of the file.

    Returns:
        The objects, and a finding for each pattern that matches nothing.

    Raises:
        SceneError: extras with an unknown key or role, or a level of detail whose finest level does not exist.
    """
    checked: dict[tuple[tuple[str, str], ...], dict[str, Any]] = {}
    keys: list[dict[str, Any]] = []
    for placement in placements:
        signature = tuple(sorted((name, repr(value)) for name, value in placement.declared.items()))
        if signature not in checked:
            checked[signature] = check_keys(placement.declared, f"{file}: {placement.path}: extras.obscura")
        keys.append(dict(checked[signature]))
    findings: list[Finding] = []
    for rule in side_file.rules:
        matched = _matching(rule, placements)
        for index in matched:
            keys[index].update(rule.keys)
        if not matched:
            detail = f"The pattern {rule.match} of the side file matches no object."
            findings.append(Finding(side_file.name, "pattern-without-match", 1, detail))
    for placement, said in zip(placements, keys, strict=True):
        said.update(placement.own)
    placer = Placer(meshes)
    objects = [_scene_object(placement, said, placer) for placement, said in zip(placements, keys, strict=True)]
    _check_levels(objects, placements, file)
    return objects, findings


def _matching(rule: ObjectRule, placements: Sequence[Placement]) -> list[int]:
    pattern = re.compile(fnmatch.translate(rule.match))
    return [
        index
        for index, item in enumerate(placements)
        # A name that itself contains brackets or stars also matches letter by letter.
        if rule.match in (item.path, item.name_path) or pattern.match(item.path) or pattern.match(item.name_path)
    ]


def _scene_object(placement: Placement, said: dict[str, Any], placer: Placer) -> SceneObject:
    keys = {name: value for name, value in said.items() if name != "role" and name not in PLACING_KEYS}
    placing = placer.placing(placement, said)
    return SceneObject(
        path=placement.path,
        mesh=placement.mesh,
        transform=placed(placement.transform, placing),
        role=said.get("role", Role.STATIC),
        keys=replace(ObjectKeys(), **keys),
        node=placement.node,
        node_instance=placement.node_instance,
        placing=placing,
        copy_of=placement.copy_of,
    )


def _check_levels(objects: Sequence[SceneObject], placements: Sequence[Placement], file: str) -> None:
    """Every `lod` must name its finest level: an object, or a node that has objects below it."""
    levels = [item for item in objects if item.role is Role.LOD]
    if not levels:
        return
    known = {path for item in placements for path in (item.path, item.name_path)}
    for item in levels:
        if item.keys.of is None:
            raise SceneError(
                "its role is lod, but nothing says of what",
                where=f"{file}: {item.path}",
                remedy='add of = "path of the finest level"',
            )
        of = item.keys.of
        if of not in known and not any(path.startswith(of + "/") for path in known):
            raise SceneError(
                f"it is a level of detail of {of!r}, which does not exist",
                where=f"{file}: {item.path}",
                remedy=nearest(of, sorted(known)[:10_000]) if len(known) < 10_000 else "check the path",
            )
