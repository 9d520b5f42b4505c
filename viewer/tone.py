"""From baked AO to what the game shows: blend of distances, remap curve, storage in a few bits with dither."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bake.types import Float32Array, Int32Array

SHORT_SHARE = 0.03
"""Share of the shortest distance in the shipped blend; the longest has the other 97 % (Sloan et al. 2013)."""

GAME_BITS = 5
"""Bits of AO in the game's G-buffer (Sloan et al. 2013)."""

BAYER = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]], np.int32)
"""Order in which the 16 pixels of a 4 × 4 block switch on (Bayer 1973)."""


@dataclass(frozen=True, slots=True)
class RemapCurve:
    """The artist's curve on the blended value: straight lines through points, then a power.

    Attributes:
        points: Pairs (in, out), both in [0, 1], sorted by `in`; the first has in = 0, the last in = 1.
        exponent: Power applied to the result: above 1 darkens, below 1 brightens.

    Raises:
        ValueError: points out of order or range, or an exponent that is not positive.
    """

    points: tuple[tuple[float, float], ...] = ((0.0, 0.0), (1.0, 1.0))
    exponent: float = 1.0

    def __post_init__(self) -> None:
        xs = [x for x, _ in self.points]
        if len(xs) < 2 or xs[0] != 0.0 or xs[-1] != 1.0:
            raise ValueError("a remap curve runs from in = 0 to in = 1")
        if any(right <= left for left, right in itertools.pairwise(xs)):
            raise ValueError("the points of a remap curve must be sorted by their input")
        if any(not 0.0 <= y <= 1.0 for _, y in self.points):
            raise ValueError("a remap curve stays within 0 and 1")
        if not 0.0 < self.exponent < 100.0:
            raise ValueError("the exponent must lie between 0 and 100")

    @property
    def is_identity(self) -> bool:
        """Whether the curve leaves every value as it is."""
        return self.exponent == 1.0 and all(x == y for x, y in self.points)

    def __call__(self, values: Float32Array) -> Float32Array:
        """The remapped values, any shape, float32; NaN stays NaN."""
        if self.is_identity:
            return values
        xs, ys = zip(*self.points, strict=True)
        return (np.interp(values, xs, ys) ** self.exponent).astype(np.float32)


def blend(ao: Float32Array, distances: Sequence[float], short_share: float = SHORT_SHARE) -> Float32Array:
    """Mixes the longest and the shortest distance (Sloan et al. 2013, section 2).

    Args:
        ao: Shape (n, k), in [0, 1], one column a distance.
        distances: The k distances in metres, in any order.
        short_share: Weight of the shortest distance, in [0, 1].

    Returns:
        Shape (n,), float32, in [0, 1].
    """
    short, long = int(np.argmin(distances)), int(np.argmax(distances))
    return (np.float32(short_share) * ao[:, short] + np.float32(1.0 - short_share) * ao[:, long]).astype(np.float32)


def dither_thresholds(rows: int, columns: int) -> Float32Array:
    """What is added before rounding down, shape (rows, columns), float32, in (0, 1), averaging ½ over a block."""
    row, column = np.arange(rows)[:, None] % 4, np.arange(columns)[None, :] % 4
    return ((BAYER[row, column] + 0.5) / 16.0).astype(np.float32)


def quantise(values: Float32Array, bits: int = GAME_BITS, thresholds: Float32Array | float = 0.5) -> Int32Array:
    """The stored codes of values.

    Args:
        values: Any shape, in [0, 1]; what lies outside is clamped.
        bits: Bits of the code.
        thresholds: What is added before rounding down: ½ rounds to nearest, `dither_thresholds` dithers.

    Returns:
        Same shape, int32, 0 to 2^bits - 1.
    """
    top = (1 << bits) - 1
    return np.clip(np.floor(np.clip(values, 0.0, 1.0) * top + thresholds), 0, top).astype(np.int32)
