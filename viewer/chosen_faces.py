"""Chosen triangles: as they are drawn, and as they are carried over to a world with other objects."""

from __future__ import annotations

import numpy as np

from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, UInt8Array, World

_COLOR = (255, 176, 32)


def chosen_shapes(
    positions: Float64Array, faces: Int32Array, chosen: BoolArray
) -> tuple[Float32Array, Int32Array, UInt8Array]:
    """Positions, cells and colours of the chosen triangles, for `ShapesActor.set_shapes`.

    Args:
        positions: Shape (n, 3), metres from the world's origin.
        faces: Shape (m, 3).
        chosen: Shape (m,), bool.
    """
    corners = faces[chosen]
    used = np.zeros(len(positions), np.bool_)
    used[corners] = True
    place = np.cumsum(used, dtype=np.int32) - np.int32(1)
    count = int(used.sum())
    colors = np.broadcast_to(np.array(_COLOR, np.uint8), (count, 3)).copy()
    return positions[used].astype(np.float32), place[corners], colors


def carried_choice(before: World, chosen: BoolArray, after: World) -> BoolArray:
    """The same triangles of the same objects in another world, shape (m,), bool.

    Args:
        before: Where they were chosen.
        chosen: Shape (its faces,), bool.
        after: Where they are wanted; objects that have another number of triangles there, or are gone, have none.
    """
    found = np.zeros(after.face_count, np.bool_)
    place = {path: number for number, path in enumerate(after.object_paths)}
    for number in np.unique(np.asarray(before.face_object)[chosen]).tolist():
        now = place.get(before.object_paths[number], -1)
        if now < 0:
            continue
        own = slice(int(before.first_face[number]), int(before.first_face[number + 1]))
        there = slice(int(after.first_face[now]), int(after.first_face[now + 1]))
        if there.stop - there.start == own.stop - own.start:
            found[there] = chosen[own]
    return found
