"""What differs between two worlds: what the stages need to know to carry over what an edit did not touch."""

from __future__ import annotations

from dataclasses import dataclass

from bake.arrays import BoolArray, Int32Array, Int64Array


@dataclass(frozen=True, slots=True)
class WorldChange:
    """How an edited world follows from the one before it. Both have the same origin.

    A face is *carried* if its object has the same path, and its corners lie where they lay, to the bit, with the same
    shading normals, casting flag, sides, openness and offset: rays see no difference. Whether an object *receives* as
    before (role, samples and alpha keys, welds) is told apart.

    Attributes:
        old_face: Shape (m,), int32: the old world's face of each new one; -1 where it is not carried.
        new_face: Shape (m_old,), int32: the inverse.
        old_vertex: Shape (n,), int32: the old world's vertex of each new one, of objects that both have with as many
            vertices, wherever they lie now; -1 elsewhere.
        old_object: Shape (o,), int64: the old world's object of each new one, by path; -1 if there was none.
        new_object: Shape (o_old,), int64: the inverse.
        object_casts_anew: Shape (o,), bool: some of its faces are not carried, and cast now.
        object_cast_before: Shape (o_old,), bool: some of its faces are not carried, and cast before.
        object_receives_anew: Shape (o,), bool: its samples have to be traced whole, and its values solved for anew.
    """

    old_face: Int32Array
    new_face: Int32Array
    old_vertex: Int32Array
    old_object: Int64Array
    new_object: Int64Array
    object_casts_anew: BoolArray
    object_cast_before: BoolArray
    object_receives_anew: BoolArray
