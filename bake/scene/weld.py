"""Which vertices lie at the same place: the connectivity that a file of split vertices does not store."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bake.scene.remembered import remembered
from bake.types import BoolArray, Float64Array, Int64Array

UInt64Array = NDArray[np.uint64]

# Odd multipliers and a final mix after splitmix64 (Steele, Lea, Flood 2014): every bit of a coordinate reaches the key.
_MULTIPLIERS = np.array([0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB], np.uint64)


def weld_positions(positions: Float64Array) -> Int64Array:
    """Numbers the distinct positions; vertices at exactly the same place share a number.

    Args:
        positions: Shape (n, 3), finite.

    Returns:
        Shape (n,), int64, values in [0, number of distinct positions).
    """
    rows = np.ascontiguousarray(positions + 0.0)  # -0.0 is the same place as 0.0
    keys = mixed_keys(rows.view(np.uint64).reshape(-1, 3))
    # The upper bits of a key tell almost all places apart, and leave room to sort vertices along with them.
    shift = np.uint64(len(keys).bit_length())
    order = stable_order(keys >> shift, (1 << (64 - int(shift))) - 1)
    is_new, told_apart = _new_rows(rows, order, (keys >> shift)[order])
    if not told_apart:
        order = np.argsort(keys, kind="stable")
        is_new, told_apart = _new_rows(rows, order, keys[order])
    if not told_apart:  # two places with one 64-bit key: never seen, still handled
        return np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int64)
    welded = np.empty(len(rows), np.int64)
    welded[order] = np.cumsum(is_new) - 1
    return welded


def _new_rows(rows: Float64Array, order: Int64Array, keys: UInt64Array) -> tuple[BoolArray, bool]:
    """Which rows, in an order by their keys, differ from the one before, shape (n,); and whether those keys do."""
    is_new = np.zeros(len(rows), np.bool_)
    is_new[:1] = True
    for axis in range(3):
        column = rows[:, axis].take(order)
        is_new[1:] |= column[1:] != column[:-1]
    return is_new, not (is_new[1:] & (keys[1:] == keys[:-1])).any()


known_places = remembered(weld_positions)
"""The same for the positions of meshes, which stay as they are."""


def mixed_keys(words: UInt64Array) -> UInt64Array:
    """One well-mixed 64-bit key per row, shape (n,); equal rows have equal keys, others almost never.

    Args:
        words: Shape (n, 3).
    """
    with np.errstate(over="ignore"):
        mixed = np.zeros(len(words), np.uint64)
        for column, multiplier in enumerate(_MULTIPLIERS):
            mixed = (mixed ^ words[:, column]) * multiplier
            mixed ^= mixed >> np.uint64(31)
    return mixed


def edge_keys(start: Int64Array, end: Int64Array) -> UInt64Array:
    """One key per undirected edge between welded vertices below 2³², shape as the arguments, uint64."""
    low, high = np.minimum(start, end).astype(np.uint64), np.maximum(start, end).astype(np.uint64)
    return (low << np.uint64(32)) | high


def stable_order(keys: UInt64Array, most: int) -> Int64Array:
    """`np.argsort(keys, kind="stable")` for keys up to `most`, several times as fast where they leave room.

    Numbers are sorted many times faster than their places: each key takes its place along in its low bits.
    """
    bits = len(keys).bit_length()
    if most.bit_length() + bits > 64:
        return np.argsort(keys, kind="stable")
    packed = (keys << np.uint64(bits)) | np.arange(len(keys), dtype=np.uint64)
    packed.sort()
    return (packed & np.uint64((1 << bits) - 1)).astype(np.int64)
