"""Levels of detail: which objects stand for which, and what is visible at a level."""

from __future__ import annotations

import numpy as np

from bake.types import BoolArray, Role, World


def lod_levels(world: World) -> dict[str, list[int]]:
    """Lower levels by the path of their finest one, in scene order: the first is level 1."""
    levels: dict[str, list[int]] = {}
    for index, (role, keys) in enumerate(zip(world.object_roles, world.object_keys, strict=True)):
        if role is Role.LOD and keys.of is not None:
            levels.setdefault(keys.of, []).append(index)
    return levels


def finest_objects(world: World, of: str) -> list[int]:
    """Objects of a finest level: that of the path, or all below it."""
    return [
        index
        for index, path in enumerate(world.object_paths)
        if (path == of or path.startswith(of + "/")) and world.object_roles[index] is not Role.LOD
    ]


def level_count(world: World) -> int:
    """Most lower levels that anything has."""
    return max((len(found) for found in lod_levels(world).values()), default=0)


def at_level(world: World, visible: BoolArray, level: int) -> BoolArray:
    """What is visible once everything with LODs shows one level: 0 the finest, its coarsest where it has too few.

    Args:
        world: The geometry.
        visible: Shape (o,): what is visible now; objects without LODs stay as they are.
        level: From 0.
    """
    changed = visible.copy()
    for of, lower in lod_levels(world).items():
        changed[finest_objects(world, of)] = level == 0
        changed[lower] = False
        if level > 0:
            changed[lower[min(level, len(lower)) - 1]] = True
    return changed


def shown_level(world: World, visible: BoolArray) -> int:
    """The level that `visible` shows everywhere; -1 if there is no such level."""
    for level in range(level_count(world) + 1):
        if np.array_equal(at_level(world, visible, level), visible):
            return level
    return -1
