"""Equal rows of large tables, found by sorting one mixed key a row instead of the rows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.arrays import BoolArray, Int64Array
from bake.in_parts import in_parts

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
    count = len(columns[0])
    keys = np.empty(count, np.uint64)

    def mix(begin: int, end: int) -> None:
        positive = [column[begin:end] + 0.0 for column in columns]  # -0.0 has other bits than 0.0
        keys[begin:end] = mixed_keys([column.view(np.uint64) for column in positive])

    in_parts(mix, count)
    # The upper bits of a key tell almost all rows apart, and leave room to sort the rows' places along with them.
    upper = keys >> np.uint64(count.bit_length())
    order, is_new, told_apart = _new_rows(columns, *sorted_with_places(upper, (1 << (64 - count.bit_length())) - 1))
    if not told_apart:
        order = np.argsort(keys, kind="stable")
        order, is_new, told_apart = _new_rows(columns, keys[order], order)
    if not told_apart:  # two rows with one 64-bit key: never seen, still handled
        order = np.lexsort([column + 0.0 for column in columns])
        order, is_new, _ = _new_rows(columns, np.zeros(count, np.uint64), order)
    number = np.empty(count, np.int64)
    number[order] = np.cumsum(is_new) - 1
    return number, order[is_new]


def _new_rows(
    columns: Sequence[NDArray[np.float64]], keys: UInt64Array, order: Int64Array
) -> tuple[Int64Array, BoolArray, bool]:
    """The order, which rows in it differ from the one before, shape (n,); and whether their ascending keys do too."""
    is_new = np.ones(len(order), np.bool_)
    is_new[1:] = keys[1:] != keys[:-1]
    alike = np.flatnonzero(~is_new)  # others differ already by their keys
    here, before = order[alike], order[alike - 1]
    for column in columns:
        is_new[alike] |= column[here] != column[before]
    return order, is_new, not is_new[alike].any()


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
    """`np.argsort(keys, kind="stable")` for keys up to `most`, several times as fast where they leave room."""
    return sorted_with_places(keys, most)[1]


def sorted_with_places(
    keys: UInt64Array, most: int, dtype: type[np.int32 | np.int64] = np.int64
) -> tuple[UInt64Array, NDArray[Any]]:
    """Keys up to `most` in ascending order, and where each was, equal ones in their order; each shape (n,).

    Numbers are sorted many times faster than their places: each key takes its place along in its low bits if there is
    room.

    Args:
        keys: Shape (n,).
        most: The largest that a key may be.
        dtype: Of the places.
    """
    bits = len(keys).bit_length()
    if most.bit_length() + bits > 64:
        order = np.argsort(keys, kind="stable")
        return keys[order], order.astype(dtype, copy=False)
    shift, places = np.uint64(bits), np.uint64((1 << bits) - 1)
    packed = np.empty(len(keys), np.uint64)

    def pack(begin: int, end: int) -> None:
        packed[begin:end] = (keys[begin:end] << shift) | np.arange(begin, end, dtype=np.uint64)

    in_parts(pack, len(keys))
    packed.sort()
    order = np.empty(len(keys), dtype)

    def unpack(begin: int, end: int) -> None:
        order[begin:end] = packed[begin:end] & places
        packed[begin:end] >>= shift

    in_parts(unpack, len(keys))
    return packed, order
