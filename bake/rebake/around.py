"""Small decorators and lower levels of detail after an edit: read anew where the surface near them is another one."""

from __future__ import annotations

import dataclasses
from collections.abc import Generator

import numpy as np

from bake.decorator_types import SmallScalars
from bake.decorators.lods import finest_levels
from bake.decorators.resampling import Resampling, resample_surfaces
from bake.decorators.small import lost_findings, spheres
from bake.devices import Device
from bake.pipeline import open_tracer
from bake.rebake.setting_changes import SAMPLES, SMALL, SOLVE
from bake.rebake.state import Edit, State
from bake.samples import place_samples
from bake.scene import samplable_faces
from bake.solve import map_to_vertices
from bake.stages import StageClock
from bake.types import BoolArray, Finding, Float64Array, Int32Array, Int64Array, Progress, Role, VertexField, World

ROLES = (Role.SMALL, Role.SHRUB, Role.LOD)
_NOT_REACHED = "carried: no surface near them changed"
_MOST_PAIRS = 1 << 25  # objects times faces that are held against each other; beyond it all objects are read anew


def rebaked_around(
    state: State, edit: Edit, solved: VertexField, shown: Int64Array, *, device: Device, clock: StageClock
) -> Generator[Progress, None, Resampling]:
    """What reads the baked surface: anew where a value within reach changed, else carried.

    Args:
        state: Before the edit.
        edit: What differs.
        solved: The values of what receives.
        shown: Shape (v,): vertices whose value changed.
        device: Where to trace.
        clock: Gets the rows `decorators` and `lods`.
    """
    world = edit.world
    there = np.array([role in ROLES for role in world.object_roles], np.bool_)
    for role, skip in ((Role.SMALL, "decorators"), (Role.SHRUB, "decorators"), (Role.LOD, "lods")):
        if skip in edit.settings.skip:
            there &= np.array([own is not role for own in world.object_roles], np.bool_)
    wanted = _wanted(state, edit, shown, there)
    if not wanted.any():
        for name in ("decorators", "lods"):
            clock.skipped(name, _NOT_REACHED if there.any() else "none in the scene")
        anew = Resampling(solved, None, None, ())
    else:
        roles = tuple(
            Role.IGNORE if role in ROLES and not wanted[number] else role
            for number, role in enumerate(world.object_roles)
        )
        near = _near_faces(world, np.flatnonzero(wanted).astype(np.int32), edit)
        anew = yield from resample_surfaces(
            dataclasses.replace(world, object_roles=roles),
            solved,
            edit.settings,
            clock,
            caster=lambda baked: open_tracer(
                dataclasses.replace(baked, face_casts=baked.face_casts & near), edit.settings, device
            ),
            sampler=place_samples,
            mapper=map_to_vertices,
            samplable=samplable_faces,
        )
    old = state.result.decorators
    shrubs = _merged(edit, Role.SHRUB, there, anew.shrub_scalars, None if old is None else old.shrub_scalars)
    small = _merged(edit, Role.SMALL, there, anew.small_scalars, None if old is None else old.small_scalars)
    levels = there & np.array([role is Role.LOD for role in world.object_roles], np.bool_) & ~wanted
    return Resampling(
        _with_levels(state, edit, anew.field, np.flatnonzero(levels)),
        shrubs,
        small,
        _findings(state, edit, anew, levels, shrubs, small),
    )


def _wanted(state: State, edit: Edit, shown: Int64Array, there: BoolArray) -> BoolArray:
    """Objects to be read anew, shape (o,)."""
    world, before, change = edit.world, state.result.world, edit.change
    wanted = there.copy()
    objects = np.flatnonzero(there).astype(np.int32)
    if not len(objects) or edit.settings_change.any_of(SMALL, SOLVE, SAMPLES):
        return wanted
    old = change.old_object[objects]
    same = np.array(
        [
            former >= 0 and before.object_hash[former] == world.object_hash[number]
            for number, former in zip(objects.tolist(), old.tolist(), strict=True)
        ],
        np.bool_,
    )
    same &= _had_values(state, edit, objects)
    low, high = _changed_boxes(state, edit, shown)
    if len(objects) * len(low) > _MOST_PAIRS:
        return wanted
    centre, radius = _reach(world, objects, edit)
    for row, number in enumerate(objects.tolist()):
        gap = np.maximum(np.maximum(low - centre[row], centre[row] - high), 0.0)
        near = bool((np.square(gap).sum(axis=1) <= radius[row] ** 2).any()) if len(low) else False
        wanted[number] = near or not same[row]
    lods = objects[[world.object_roles[number] is Role.LOD for number in objects.tolist()]]
    if len(lods):
        moved = np.zeros(world.object_count, np.bool_)
        moved[np.searchsorted(world.first_vertex, shown, side="right") - 1] = True
        wanted[lods] |= (finest_levels(world, lods) & moved).any(axis=1) | _lost_finest(state, edit, lods)
        if len(low):
            far = {item.object for item in state.result.findings if item.what == "far-from-finest-level"}
            wanted[lods] |= np.array([world.object_paths[number] in far for number in lods.tolist()], np.bool_)
        wanted[lods] = wanted[lods].any()  # their fit pools the noise of all of them
    return wanted


def _lost_finest(state: State, edit: Edit, lods: Int32Array) -> BoolArray:
    """Lower levels of detail whose finest level lost an object, wherever that lay, shape (l,)."""
    gone = edit.change.new_object < 0
    former = edit.change.old_object[lods]
    lost = np.zeros(len(lods), np.bool_)
    before = state.result.world
    known = np.array([number >= 0 and before.object_roles[number] is Role.LOD for number in former.tolist()], np.bool_)
    if gone.any() and known.any():
        lost[known] = (finest_levels(before, former[known].astype(np.int32)) & gone).any(axis=1)
    return lost


def _had_values(state: State, edit: Edit, objects: Int32Array) -> BoolArray:
    """Objects that the old result has values of, shape (d,)."""
    decorators, field, world = state.result.decorators, state.result.field, state.result.world
    known: set[int] = set()
    for scalars in () if decorators is None else (decorators.shrub_scalars, decorators.small_scalars):
        known |= set() if scalars is None else set(scalars.object.tolist())
    found = np.zeros(len(objects), np.bool_)
    for row, number in enumerate(objects.tolist()):
        former = int(edit.change.old_object[number])
        if former >= 0 and edit.world.object_roles[number] is Role.LOD:
            own = slice(int(world.first_vertex[former]), int(world.first_vertex[former + 1]))
            found[row] = bool(np.isfinite(field.ao[own]).any())
        else:
            found[row] = former in known
    return found


def _changed_boxes(state: State, edit: Edit, shown: Int64Array) -> tuple[Float64Array, Float64Array]:
    """Boxes of the faces of both worlds that carry another value, or lie elsewhere, shape (c, 3) twice."""
    world, old = edit.world, state.result.world
    hit = np.zeros(world.vertex_count, np.bool_)
    hit[shown] = True
    receiving = np.array([role.receives_per_vertex for role in world.object_roles], np.bool_)
    now = (hit[world.faces].any(axis=1) | (edit.change.old_face < 0)) & receiving[world.face_object]
    former = np.array([role.receives_per_vertex for role in old.object_roles], np.bool_)
    gone = (edit.change.new_face < 0) & former[old.face_object]
    parts = (world.positions[world.faces[now]], old.positions[old.faces[gone]])
    low, high = [part.min(axis=1) for part in parts], [part.max(axis=1) for part in parts]
    return np.concatenate(low), np.concatenate(high)


def _reach(world: World, objects: Int32Array, edit: Edit) -> tuple[Float64Array, Float64Array]:
    """Spheres in which objects read the surface; lower levels do so anywhere on themselves."""
    centre, radius = spheres(world, objects, None)
    if edit.settings.decorator_radius is not None:
        small = np.array([world.object_roles[number] is not Role.LOD for number in objects.tolist()], np.bool_)
        radius = np.where(small, edit.settings.decorator_radius, radius)
    levels = np.array([world.object_roles[number] is Role.LOD for number in objects.tolist()], np.bool_)
    return centre, np.where(levels, 2.0 * radius, radius) * (1.0 + 1e-6) + 1e-4


def _near_faces(world: World, objects: Int32Array, edit: Edit) -> BoolArray:
    """Faces of the objects whose boxes come near those to be read for, shape (m,)."""
    centre, radius = _reach(world, objects, edit)
    low, high = centre - radius[:, None], centre + radius[:, None]
    near = np.zeros(world.object_count, np.bool_)
    for number in range(world.object_count):
        own = world.positions[int(world.first_vertex[number]) : int(world.first_vertex[number + 1])]
        if len(own):
            near[number] = bool(((own.min(axis=0) <= high) & (own.max(axis=0) >= low)).all(axis=1).any())
    return near[world.face_object]


def _merged(
    edit: Edit, role: Role, there: BoolArray, anew: SmallScalars | None, before: SmallScalars | None
) -> SmallScalars | None:
    """One value for each object of a role, new or carried."""
    numbers = [n for n, own in enumerate(edit.world.object_roles) if own is role and there[n]]
    if not numbers:
        return None
    columns = edit.settings.distance_count
    ao, found = np.ones((len(numbers), columns), np.float32), np.zeros(len(numbers), np.bool_)
    new = {} if anew is None else {int(number): row for row, number in enumerate(anew.object)}
    old = {} if before is None else {int(number): row for row, number in enumerate(before.object)}
    for row, number in enumerate(numbers):
        if anew is not None and number in new:
            ao[row], found[row] = anew.ao[new[number]], anew.found[new[number]]
        elif before is not None and (former := int(edit.change.old_object[number])) in old:
            ao[row], found[row] = before.ao[old[former]], before.found[old[former]]
    return SmallScalars(np.array(numbers, np.int32), ao, found)


def _with_levels(state: State, edit: Edit, field: VertexField, levels: Int64Array) -> VertexField:
    """The field with some lower levels of detail as they were."""
    if not len(levels):
        return field
    ao, state_of = field.ao.copy(), field.state.copy()
    for number in levels.tolist():
        own = np.arange(int(edit.world.first_vertex[number]), int(edit.world.first_vertex[number + 1]))
        former = edit.change.old_vertex[own]
        ao[own] = state.result.field.ao[former]
        state_of[own] = state.result.field.state[former]
    return VertexField(ao, state_of, field.report)


def _findings(
    state: State,
    edit: Edit,
    anew: Resampling,
    carried: BoolArray,
    shrubs: SmallScalars | None,
    small: SmallScalars | None,
) -> tuple[Finding, ...]:
    """Those of the levels read anew and of those carried, and of all small decorators."""
    found: list[Finding] = []
    for role, scalars in ((Role.SHRUB, shrubs), (Role.SMALL, small)):
        if scalars is not None:
            found += lost_findings(edit.world, scalars.object[~scalars.found], role)
    found += [item for item in anew.findings if item.what != "no-surface-around"]
    paths = {edit.world.object_paths[number] for number in np.flatnonzero(carried).tolist()}
    kinds = ("far-from-finest-level", "filled-vertices")
    found += [item for item in state.result.findings if item.what in kinds and item.object in paths]
    return tuple(found)
