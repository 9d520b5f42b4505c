"""Boxes around the objects of a world."""

from __future__ import annotations

import numpy as np

from bake.types import Float64Array, World

_ABREAST = 64
"""Points compared side by side: long rows are read as fast as memory gives them, single axes a tenth as fast."""


def box_around(positions: Float64Array) -> Float64Array:
    """Lowest and highest corner of points of shape (n, 3), shape (2, 3)."""
    whole = len(positions) // _ABREAST * _ABREAST
    if not whole or not positions.flags.c_contiguous:
        return np.array([[axis.min() for axis in positions.T], [axis.max() for axis in positions.T]])
    rows, rest = positions[:whole].reshape(-1, 3 * _ABREAST), positions[whole:]
    low = np.concatenate((rows.min(axis=0).reshape(-1, 3), rest)).min(axis=0)
    return np.stack((low, np.concatenate((rows.max(axis=0).reshape(-1, 3), rest)).max(axis=0)))


def object_boxes(world: World) -> Float64Array:
    """Lowest and highest corner of every object, shape (o, 2, 3), metres from the origin; NaN without vertices."""
    boxes = np.full((world.object_count, 2, 3), np.nan)
    used = np.flatnonzero(np.diff(world.first_vertex) > 0)
    if len(used):
        first = np.asarray(world.first_vertex)[used]
        positions = np.asarray(world.positions)[: world.first_vertex[-1]]
        boxes[used, 0] = np.minimum.reduceat(positions, first)
        boxes[used, 1] = np.maximum.reduceat(positions, first)
    return boxes


def moved_boxes(boxes: Float64Array, before: World, now: World) -> Float64Array:
    """The boxes of `object_boxes` after objects of the same number and size went elsewhere; only those are looked at.

    Args:
        boxes: Those of `before`.
        before, now: Worlds whose objects are numbered alike.
    """
    boxes = boxes.copy()
    for index, (then, digest) in enumerate(zip(before.object_hash, now.object_hash, strict=True)):
        first, end = int(now.first_vertex[index]), int(now.first_vertex[index + 1])
        if then != digest and end > first:
            boxes[index] = box_around(np.asarray(now.positions)[first:end])
    return boxes
