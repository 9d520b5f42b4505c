"""What differs between two worlds, found by their content: no event can be missed, an undo changes nothing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bake.change_types import WorldChange
from bake.types import BoolArray, Float32Array, Float64Array, Int64Array, ObjectKeys, Role, World

_RAY_KEYS: tuple[Callable[[ObjectKeys], object], ...] = (lambda keys: keys.offset, lambda keys: keys.transmission)
_RECEIVER_KEYS: tuple[Callable[[ObjectKeys], object], ...] = (
    lambda keys: keys.samples,
    lambda keys: keys.alpha,
    lambda keys: keys.weld,
)


def compare(old: World, new: World) -> WorldChange:
    """How `new` follows from `old`; both must have the same origin.

    Objects are matched by path. Equal content hashes tell that everything is equal; of other objects the arrays are
    compared face by face. Trees count as casting: they dim rays.
    """
    number_of = {path: number for number, path in enumerate(old.object_paths)}
    old_object = np.array([number_of.get(path, -1) for path in new.object_paths], np.int64).reshape(-1)
    new_object = np.full(old.object_count, -1, np.int64)
    matched = np.flatnonzero(old_object >= 0)
    new_object[old_object[matched]] = matched
    old_face = _spans(new.first_face, old.first_face, old_object)
    old_vertex = _spans(new.first_vertex, old.first_vertex, old_object)
    receives_anew = np.zeros(new.object_count, np.bool_)
    for number, before in enumerate(old_object.tolist()):
        if before < 0:
            receives_anew[number] = new.object_roles[number].receives_per_vertex
        elif old.object_hash[before] != new.object_hash[number]:
            same = _same_faces(old, before, new, number)
            own = slice(int(new.first_face[number]), int(new.first_face[number + 1]))
            old_face[own] = np.where(same, old_face[own], -1)
            receives_anew[number] = _receives_anew(old, before, new, number, bool(same.all()))
    new_face = np.full(old.face_count, -1, np.int32)
    carried = np.flatnonzero(old_face >= 0)
    new_face[old_face[carried]] = carried
    return WorldChange(
        old_face=old_face.astype(np.int32),
        new_face=new_face,
        old_vertex=old_vertex.astype(np.int32),
        old_object=old_object,
        new_object=new_object,
        object_casts_anew=_owners(new, ray_faces(new) & (old_face < 0)),
        object_cast_before=_owners(old, ray_faces(old) & (new_face < 0)),
        object_receives_anew=receives_anew,
    )


def ray_faces(world: World) -> BoolArray:
    """Faces that rays notice, shape (m,): those that cast, and those of trees, which dim."""
    trees = np.array([role is Role.TREE for role in world.object_roles], np.bool_)
    return world.face_casts | trees[world.face_object] if trees.any() else np.asarray(world.face_casts)


def changed_objects(old: World, new: World) -> tuple[str, ...]:
    """Paths of what differs: objects that changed or are new, in scene order, then those that are gone."""
    before = dict(zip(old.object_paths, old.object_hash, strict=True))
    now = [
        path for path, digest in zip(new.object_paths, new.object_hash, strict=True) if before.get(path, "") != digest
    ]
    there = set(new.object_paths)
    return (*now, *(path for path in old.object_paths if path not in there))


def _spans(first: Int64Array, former: Int64Array, old_object: Int64Array) -> Int64Array:
    """For objects with as many items in both worlds the old number of each item, elsewhere -1, shape (items,)."""
    counts = np.diff(first)
    known = np.maximum(old_object, 0)
    there = old_object >= 0
    if len(former) > 1:
        there = there & (np.diff(former)[known] == counts)
    shift = (former[known] - first[:-1]).astype(np.int64)
    items: Int64Array = np.arange(int(first[-1]), dtype=np.int64)
    items += np.repeat(shift, counts)
    items[np.repeat(~there, counts)] = -1
    return items


def _same_faces(old: World, before: int, new: World, number: int) -> BoolArray:
    """Faces of an object at which rays see no difference, shape (faces of the new object,)."""
    then = slice(int(old.first_face[before]), int(old.first_face[before + 1]))
    now = slice(int(new.first_face[number]), int(new.first_face[number + 1]))
    count = now.stop - now.start
    if then.stop - then.start != count:
        return np.zeros(count, np.bool_)
    keys, former = new.object_keys[number], old.object_keys[before]
    roles = new.object_roles[number], old.object_roles[before]
    dims = roles[0] is Role.TREE, roles[1] is Role.TREE
    if dims[0] != dims[1] or any(key(keys) != key(former) for key in _RAY_KEYS):
        return np.zeros(count, np.bool_)
    if new.face_texture is not None and (new.face_texture[now] >= 0).any():
        return np.zeros(count, np.bool_)  # a texture may differ where its openness shows it nowhere else
    same = np.asarray(old.face_casts[then] == new.face_casts[now])
    same &= old.face_two_sided[then] == new.face_two_sided[now]
    same &= old.face_openness[then] == new.face_openness[now]
    for corner in range(3):
        if not same.any():
            break
        a, b = old.faces[then, corner], new.faces[now, corner]
        same &= _equal(old.positions, a, new.positions, b) & _equal(old.normals, a, new.normals, b)
    return same


def _equal(
    old: Float64Array | Float32Array, a: np.ndarray, new: Float64Array | Float32Array, b: np.ndarray
) -> BoolArray:
    return np.asarray((old[a] == new[b]).all(axis=1))


def _receives_anew(old: World, before: int, new: World, number: int, same: bool) -> bool:
    """Whether an object whose content differs has to be traced and solved for anew."""
    if not new.object_roles[number].receives_per_vertex:
        return False
    if not same or not old.object_roles[before].receives_per_vertex:
        return True
    then = slice(int(old.first_face[before]), int(old.first_face[before + 1]))
    now = slice(int(new.first_face[number]), int(new.first_face[number + 1]))
    if not np.array_equal(old.face_samples[then], new.face_samples[now]):
        return True
    keys, former = new.object_keys[number], old.object_keys[before]
    return any(key(keys) != key(former) for key in _RECEIVER_KEYS)


def _owners(world: World, faces: BoolArray) -> BoolArray:
    """Objects that have some of the faces, shape (o,)."""
    found = np.zeros(world.object_count, np.bool_)
    found[world.face_object[faces]] = True
    return found
