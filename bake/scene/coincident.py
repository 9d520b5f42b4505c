"""Faces that lie exactly on one another: copies, and cards doubled in place to be seen from both sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.equal_rows import mixed_keys, stable_order
from bake.in_parts import in_parts
from bake.scene.remembered import remembered
from bake.scene.weld import known_places
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array


@dataclass(frozen=True, slots=True)
class CoincidentFaces:
    """Which faces of a mesh share all three corner positions with another one.

    Attributes:
        duplicate: Shape (m,): an earlier face has the same corners and looks the same way.
        opposed: Shape (m,): another face has the same corners and looks the opposite way.
        repeated: Shape (m,): an earlier face has the same corners, whichever way it looks.
    """

    duplicate: BoolArray
    opposed: BoolArray
    repeated: BoolArray


@remembered
def find_coincident(positions: Float64Array, faces: Int32Array) -> CoincidentFaces:
    """Finds coincident faces by position, whatever their vertex indices; faces with equal corners are left out.

    The arrays are a mesh's, which stay as they are.
    """
    return coincident_of_welded(known_places(positions)[faces])


def coincident_of_welded(welded: Int64Array) -> CoincidentFaces:
    """Like `find_coincident`, for faces over welded vertices, shape (m, 3)."""
    count = len(welded)
    duplicate, opposed, repeated = (np.zeros(count, np.bool_) for _ in range(3))
    keys, is_proper = np.empty(count, np.uint64), np.empty(count, np.bool_)

    def prepare(begin: int, end: int) -> None:
        low, middle, high = _sorted_columns(welded[begin:end])
        is_proper[begin:end] = (low != middle) & (middle != high)
        keys[begin:end] = mixed_keys((low, middle, high))

    in_parts(prepare, count)
    proper = np.flatnonzero(is_proper)
    keys = keys if len(proper) == count else keys[proper]
    ascending = np.sort(keys)
    if not (ascending[1:] == ascending[:-1]).any():  # most meshes
        return CoincidentFaces(duplicate, opposed, repeated)
    triples = np.sort(welded[proper], axis=1)
    # The upper bits of a key tell almost all triples apart, and leave room to sort places along with them.
    shift = np.uint64(len(keys).bit_length())
    order = stable_order(keys >> shift, (1 << (64 - int(shift))) - 1)
    sorted_triples = triples[order]
    repeats: BoolArray = np.all(sorted_triples[1:] == sorted_triples[:-1], axis=1)
    upper = (keys >> shift)[order]
    if ((upper[1:] == upper[:-1]) & ~repeats).any():
        order = np.argsort(keys, kind="stable")
        sorted_triples = triples[order]
        repeats = np.all(sorted_triples[1:] == sorted_triples[:-1], axis=1)
    if not repeats.any():
        return CoincidentFaces(duplicate, opposed, repeated)
    group = np.concatenate(([0], np.cumsum(~repeats)))
    face = proper[order]
    repeated[face[1:][repeats]] = True
    odd = _is_odd(welded[face])
    side = 2 * group + odd
    first_of_side = np.unique(side, return_index=True)[1]
    is_first = np.zeros(len(face), np.bool_)
    is_first[first_of_side] = True
    duplicate[face[~is_first]] = True
    sides = np.bincount(side, minlength=2 * (int(group[-1]) + 1)).reshape(-1, 2)
    both: BoolArray = np.all(sides > 0, axis=1)
    opposed[face] = both[group]
    return CoincidentFaces(duplicate, opposed, repeated)


def _sorted_columns(corners: Int64Array) -> tuple[Int64Array, Int64Array, Int64Array]:
    """The three columns of `np.sort(corners, axis=1)`."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    low, high = np.minimum(a, b), np.maximum(a, b)
    return np.minimum(low, c), np.maximum(low, np.minimum(high, c)), np.maximum(high, c)


def _is_odd(corners: Int64Array) -> BoolArray:
    """Whether sorting the three different corners takes an odd permutation: tells the two windings apart."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    return np.logical_xor(np.logical_xor(a > b, b > c), a > c)
