"""One value for each small decorator: the baked AO of the surface it stands on (Sloan et al. 2013, section 2.2.1)."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from bake.decorator_types import SmallScalars
from bake.decorators.resample import BakedSurface, RayCaster, sphere_reader, spheres_of
from bake.settings import BakeSettings
from bake.types import Finding, Float64Array, Int32Array, Progress, Role, World

RAYS = 128
"""Rays a decorator: the even spread makes the weighted mean settle to about a hundredth."""

REACH = 1.25
"""Radius in half diagonals of the decorator's box: a quarter beyond it, so that the ground below it is within."""

LEAST_RADIUS = 0.05
"""Radius in metres of decorators that are no larger than a point."""


@dataclass(frozen=True, slots=True)
class SmallBake:
    """What became of small decorators; None where there are none.

    Attributes:
        shrubs: Of the objects of role `shrub`.
        small: Of those of role `small`.
        findings: Decorators that found no surface.
        rays: Rays traced.
    """

    shrubs: SmallScalars | None
    small: SmallScalars | None
    findings: tuple[Finding, ...]
    rays: int


def objects_of(world: World, *roles: Role) -> Int32Array:
    """Indices of the objects with one of these roles, in scene order."""
    return np.flatnonzero([role in roles for role in world.object_roles]).astype(np.int32)


def spheres(world: World, objects: Int32Array, radius: float | None) -> tuple[Float64Array, Float64Array]:
    """Centres, shape (d, 3), and radii, shape (d,), in metres: about the boxes of what the objects' faces use.

    Args:
        world: The flattened scene.
        objects: Shape (d,).
        radius: The same for all; by default `REACH` half diagonals of each box.
    """
    low, high = np.zeros((len(objects), 3)), np.zeros((len(objects), 3))
    for row, number in enumerate(objects.tolist()):
        faces = world.faces[world.first_face[number] : world.first_face[number + 1]]
        if len(faces):
            first, last = world.first_vertex[number : number + 2].tolist()
            used = world.positions[first:last]
            if int(np.count_nonzero(np.bincount(faces.ravel() - first, minlength=last - first))) < last - first:
                used = world.positions[np.unique(faces)]
            low[row], high[row] = used.min(axis=0), used.max(axis=0)
    natural = np.maximum(0.5 * REACH * np.linalg.norm(high - low, axis=1), LEAST_RADIUS)
    return 0.5 * (low + high), natural if radius is None else np.full(len(objects), radius)


def bake_small(
    world: World, surface: BakedSurface, settings: BakeSettings, caster: RayCaster
) -> Generator[Progress, None, SmallBake]:
    """Resamples the baked surface around every object of role `small` and `shrub`.

    A decorator whose sphere meets no baked surface gets 1, open, and is counted in a finding.

    Args:
        world: The flattened scene.
        surface: Its baked surface.
        settings: `decorator_radius` matters.
        caster: Finds hits on `world.faces`; what carries no AO is passed.
    """
    objects = objects_of(world, Role.SHRUB, Role.SMALL)
    centres, radii = spheres(world, objects, settings.decorator_radius)
    ao = np.ones((len(objects), surface.ao.shape[1]), np.float32)
    found = np.zeros(len(objects), np.bool_)
    reader, traced = sphere_reader(surface, caster, rays=RAYS), 0
    for begin in range(0, len(objects), reader.at_once):
        part = slice(begin, begin + reader.at_once)
        around = reader.read(spheres_of(centres[part], radii[part]))
        ao[part], found[part] = around.ao, around.hits > 0
        traced += around.rays
        yield Progress("decorators", min(part.stop, len(objects)) * RAYS, len(objects) * RAYS)
    made: dict[Role, SmallScalars | None] = {}
    findings: list[Finding] = []
    for role in (Role.SHRUB, Role.SMALL):
        own = np.array([world.object_roles[number] is role for number in objects.tolist()], np.bool_)
        made[role] = SmallScalars(objects[own], ao[own], found[own]) if own.any() else None
        findings += lost_findings(world, objects[own & ~found], role)
    return SmallBake(made[Role.SHRUB], made[Role.SMALL], tuple(findings), traced)


def lost_findings(world: World, objects: Int32Array, role: Role) -> list[Finding]:
    """What to tell of decorators of one role, shape (d,), that found no surface."""
    if not len(objects):
        return []
    more = f" It is the first of {len(objects)} such objects of role {role}." if len(objects) > 1 else ""
    detail = f"No baked surface lies around it, so that it counts as open.{more}"
    return [Finding(world.object_paths[int(objects[0])], "no-surface-around", len(objects), detail)]
