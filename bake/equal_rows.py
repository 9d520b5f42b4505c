"""Equal rows of large tables, found by sorting one mixed key a row instead of the rows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.arrays import BoolArray, Int64Array

UInt64Array = NDArray[np.uint64]

# Odd multipliers and a final mix after splitmix64 (Steele, Lea, Flood 2014): every bit of a number reaches the key.
_MULTIPLIERS = np.array([0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB], np.uint64)


def number_rows(columns: Sequence[NDArray[np.float64]]) -> tuple[Int64Array, Int64Array]:
    """A number for each row, equal for equal rows.

    Args:
        columns: At least one, each shape (n,), float64, finite; -0.0 equals 0.0.

    Returns:
        Shape (n,), int64, in [0, d) for d distinct rows; and the first row of each number, shape (d,), int64.
    """
    positive = [column + 0.0 for column in columns]  # -0.0 has other bits than 0.0
    keys = mixed_keys([column.view(np.uint64) for column in positive])
    # The upper bits of a key tell almost all rows apart, and leave room to sort the rows' places along with them.
    shift = np.uint64(len(keys).bit_length())
    upper = keys >> shift
    order = stable_order(upper, (1 << (64 - int(shift))) - 1)
    is_new, told_apart = _new_rows(positive, order, upper)
    if not told_apart:
        order = np.argsort(keys, kind="stable")
        is_new, told_apart = _new_rows(positive, order, keys)
    if not told_apart:  # two rows with one 64-bit key: never seen, still handled
        order = np.lexsort(positive)
        is_new, _ = _new_rows(positive, order, keys)
    number = np.empty(len(keys), np.int64)
    number[order] = np.cumsum(is_new) - 1
    return number, order[is_new]


def _new_rows(columns: Sequence[NDArray[np.float64]], order: Int64Array, keys: UInt64Array) -> tuple[BoolArray, bool]:
    """Which rows, in an order by their keys, differ from the one before, shape (n,); and whether those keys do."""
    is_new = np.zeros(len(order), np.bool_)
    is_new[:1] = True
    for column in columns:
        values = column.take(order)
        is_new[1:] |= values[1:] != values[:-1]
    sorted_keys = keys.take(order)
    return is_new, not (is_new[1:] & (sorted_keys[1:] == sorted_keys[:-1])).any()


def mixed_keys(columns: Sequence[NDArray[Any]]) -> UInt64Array:
    """One well-mixed 64-bit key per row, shape (n,); equal rows have equal keys, others almost never.

    Args:
        columns: At least one, each shape (n,), of 64 bits.
    """
    with np.errstate(over="ignore"):
        mixed = np.zeros(len(columns[0]), np.uint64)
        for position, column in enumerate(columns):
            mixed ^= column.view(np.uint64)
            mixed *= _MULTIPLIERS[position % len(_MULTIPLIERS)]
            mixed ^= mixed >> np.uint64(31)
    return mixed


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
