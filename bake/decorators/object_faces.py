"""The faces of some objects as one list."""

from __future__ import annotations

import numpy as np

from bake.arrays import Int32Array, Int64Array
from bake.types import World


def faces_of(world: World, number: Int32Array) -> tuple[Int64Array, Int64Array, Int64Array]:
    """Faces of objects, shape (f,), object after object, with each object's first place in it and count, shape (b,)."""
    first = world.first_face[number]
    count = world.first_face[number + 1] - first
    start = np.cumsum(count) - count
    face = np.arange(int(count.sum()), dtype=np.int64) - np.repeat(start - first, count)
    return face, start, count
