"""Levels of detail: which objects stand for which, what is visible at a level, and how far levels are apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.types import BoolArray, Float32Array, Float64Array, Int64Array, Role, World
from viewer.histogram import vertex_areas

_NEIGHBOURS = 8


@dataclass(frozen=True, slots=True)
class Levels:
    """What stands for one thing at different distances.

    Attributes:
        of: Path of the finest level.
        finest: Objects of the finest level.
        lower: Lower levels, the finer first.
    """

    of: str
    finest: tuple[int, ...]
    lower: tuple[int, ...]

    def shown(self, most: int) -> list[tuple[int, ...]]:
        """Objects of each of the first levels, the finest first."""
        return [self.finest, *((index,) for index in self.lower)][:most]


def levels_of(world: World, index: int) -> Levels | None:
    """The levels that an object is one of; None if it has none."""
    for of, lower in lod_levels(world).items():
        finest = finest_objects(world, of)
        if finest and (index in finest or index in lower):
            return Levels(of, tuple(finest), tuple(lower))
    return None


def vertices_of(world: World, objects: tuple[int, ...]) -> Int64Array:
    """The vertices of some objects, one after the other."""
    spans = [np.arange(world.first_vertex[i], world.first_vertex[i + 1], dtype=np.int64) for i in objects]
    return np.concatenate(spans)


def level_differences(world: World, ao: Float32Array, levels: Levels) -> list[Float64Array]:
    """How far the AO of each lower level is from that of the finest one.

    Args:
        world: The geometry.
        ao: Shape (n, k): all vertex values.
        levels: Of one thing.

    Returns:
        Per lower level the root of the mean square of the differences, weighted by area, shape (k,): at each of its
        vertices to the nearest vertex of the finest level that faces the same way, or the nearest if none does.
    """
    from scipy.spatial import cKDTree

    finest = vertices_of(world, levels.finest)
    finest = finest[np.isfinite(ao[finest]).all(axis=1)]
    found: list[Float64Array] = []
    tree = cKDTree(world.positions[finest]) if len(finest) else None
    for index in levels.lower:
        own = vertices_of(world, (index,))
        faces = world.faces[world.first_face[index] : world.first_face[index + 1]] - np.int32(own[0])
        area = vertex_areas(world.positions[own], faces)
        if tree is None:
            found.append(np.full(ao.shape[1], np.nan))
            continue
        near = np.asarray(tree.query(world.positions[own], k=min(_NEIGHBOURS, len(finest)))[1]).reshape(len(own), -1)
        agrees = np.einsum("ik,ijk->ij", world.normals[own], world.normals[finest[near]]) > 0.0
        best = finest[near[np.arange(len(near)), agrees.argmax(axis=1)]]
        squares: Float64Array = (ao[own].astype(np.float64) - ao[best]) ** 2
        weight = np.where(np.isfinite(squares).all(axis=1), area, 0.0)
        total = weight.sum()
        mean = (weight[:, None] * np.nan_to_num(squares)).sum(axis=0) / (total if total > 0.0 else np.nan)
        found.append(np.sqrt(mean))
    return found


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
