"""Points of the unit square by which an integral is estimated: the usual ways, beside the one that bakes take."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from bake.low_discrepancy import owen_sobol, reverse_bits, second_dimension_reversed
from bake.types import Float64Array

_PLASTIC = 1.32471795724474602596
_GOLDEN = (1.0 + math.sqrt(5.0)) / 2.0

PointSet = Callable[[int, int, int], Float64Array]
"""From points in a set, number of sets and seed to sets of points, shape (sets, points, 2), in [0, 1)."""


def random_points(points: int, sets: int, seed: int) -> Float64Array:
    """Independent and uniform."""
    return np.random.default_rng(seed).random((sets, points, 2))


def jittered(points: int, sets: int, seed: int) -> Float64Array:
    """One at random in each cell of a grid; `points` is a square (Cook 1986)."""
    edge = math.isqrt(points)
    if edge * edge != points:
        raise ValueError(f"{points} is no square")
    cell = np.stack(np.divmod(np.arange(points), edge), axis=1)
    return (cell + np.random.default_rng(seed).random((sets, points, 2))) / edge


def additive_recurrence(points: int, sets: int, seed: int) -> Float64Array:
    """R2, the additive recurrence of the plastic number (Roberts 2018), each set shifted at random."""
    step = np.array([1.0 / _PLASTIC, 1.0 / _PLASTIC**2])
    one: Float64Array = 0.5 + np.arange(points, dtype=np.float64)[:, None] * step
    return _shifted(one, sets, seed)


def golden_lattice(points: int, sets: int, seed: int) -> Float64Array:
    """The rank-1 lattice whose generator is the odd number next to points / φ, each set shifted at random."""
    generator = 2 * round((points / _GOLDEN - 1.0) / 2.0) + 1
    index = np.arange(points)
    return _shifted(np.stack([index / points, index * generator % points / points], axis=1), sets, seed)


def shifted_sobol(points: int, sets: int, seed: int) -> Float64Array:
    """Sobol's first two dimensions, each set shifted at random."""
    index = np.arange(points, dtype=np.uint32)
    pair = np.stack([reverse_bits(index), reverse_bits(second_dimension_reversed(index))], axis=1)
    return _shifted(pair.astype(np.float64) * 2.0**-32, sets, seed)


def scrambled_sobol(points: int, sets: int, seed: int) -> Float64Array:
    """Sobol's first two dimensions, each set Owen-scrambled: what bakes take (`bake/low_discrepancy.py`)."""
    seeds = np.random.default_rng(seed).integers(0, 2**32, sets, dtype=np.uint32)
    index = np.tile(np.arange(points), sets)
    return np.stack(owen_sobol(index, np.repeat(seeds, points)), axis=1).reshape(sets, points, 2)


def _shifted(one: Float64Array, sets: int, seed: int) -> Float64Array:
    """Copies of a set, each moved by a random vector on the torus (Cranley and Patterson 1976)."""
    return (one + np.random.default_rng(seed).random((sets, 1, 2))) % 1.0


POINT_SETS: Mapping[str, PointSet] = {
    "random": random_points,
    "stratified jitter": jittered,
    "R2, shifted": additive_recurrence,
    "golden lattice, shifted": golden_lattice,
    "Sobol, shifted": shifted_sobol,
    "Sobol, Owen-scrambled": scrambled_sobol,
}
