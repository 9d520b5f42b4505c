"""Which objects' surfaces an edit leaves as they are, and which it only moves."""

from __future__ import annotations

import enum

import numpy as np

from bake.change_types import WorldChange
from bake.types import Float64Array, Int64Array, World

SHAPE = 1e-9
"""By how much of its size a moved object may differ from its shape before: rounding stays far below."""

TURNED = 1e-3
"""How far its normals, which are stored in less precision, may be from where the motion takes them."""


class Match(enum.Enum):
    """What became of an object's surface."""

    SAME = enum.auto()
    MOVED = enum.auto()  # as a rigid body: areas, angles and creases are those of before
    OTHER = enum.auto()


def receivers(world: World) -> Int64Array:
    """The objects that have faces and receive per vertex, ascending."""
    wanted = np.array([role.receives_per_vertex for role in world.object_roles], np.bool_)
    return np.flatnonzero(wanted & (np.diff(world.first_face) > 0))


def joiners(world: World, weld_instances: bool) -> set[int]:
    """The receiving objects that share vertices with others they touch."""
    return {i for i in map(int, receivers(world)) if _joins(world, i, weld_instances)}


def _joins(world: World, number: int, weld_instances: bool) -> bool:
    own = world.object_keys[number].weld
    return weld_instances if own is None else own


def match_objects(old: World, new: World, change: WorldChange, *, weld_instances: bool) -> list[Match]:
    """What became of each object of the new world, as a surface to solve on; new ones are `OTHER`."""
    gone = np.bincount(new.face_object[change.old_face < 0], minlength=new.object_count) > 0
    before = change.old_object
    found = [Match.SAME if number >= 0 else Match.OTHER for number in before]
    for number in map(int, np.flatnonzero((before >= 0) & (gone | change.object_receives_anew))):
        rigid = not _joins(new, number, weld_instances)
        found[number] = _match(old, int(before[number]), new, number, may_move=rigid)
    for number, at in enumerate(map(int, before)):
        if at >= 0 and old.object_roles[at].receives_per_vertex != new.object_roles[number].receives_per_vertex:
            found[number] = Match.OTHER
    return found


def _match(old: World, before: int, new: World, after: int, *, may_move: bool) -> Match:
    v, w = slice(*old.first_vertex[before : before + 2]), slice(*new.first_vertex[after : after + 2])
    f, g = slice(*old.first_face[before : before + 2]), slice(*new.first_face[after : after + 2])
    if v.stop - v.start != w.stop - w.start or f.stop - f.start != g.stop - g.start:
        return Match.OTHER
    if old.object_keys[before].weld != new.object_keys[after].weld:
        return Match.OTHER
    if not np.array_equal(old.faces[f] - v.start, new.faces[g] - w.start):
        return Match.OTHER
    if not np.array_equal(old.face_samples[f], new.face_samples[g]):
        return Match.OTHER
    from_, to = old.positions[v], new.positions[w]
    old_normals, new_normals = old.normals[v].astype(np.float64), new.normals[w].astype(np.float64)
    if np.array_equal(from_, to) and np.array_equal(old_normals, new_normals):
        return Match.SAME
    if may_move and _rigid(from_, to, old_normals, new_normals):
        return Match.MOVED
    return Match.OTHER


def _rigid(from_: Float64Array, to: Float64Array, old_normals: Float64Array, new_normals: Float64Array) -> bool:
    """Whether a rotation and a translation take the points, and their normals, to where they are."""
    if not len(from_):
        return False
    start, end = from_ - from_.mean(axis=0), to - to.mean(axis=0)
    size = float(np.abs(start).max())
    if size <= 0.0:
        return False
    u, _, vt = np.linalg.svd(start.T @ end)
    u[:, -1] *= np.sign(np.linalg.det(u @ vt))
    turn = u @ vt
    apart = float(np.abs(start @ turn - end).max())
    return apart <= SHAPE * size and float(np.abs(old_normals @ turn - new_normals).max()) <= TURNED
