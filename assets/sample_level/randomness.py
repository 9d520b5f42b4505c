"""Random numbers and noise that are the same on every machine and with every NumPy.

The level must come out bit for bit the same wherever it is built, and NumPy does not promise that of its own
generators across versions.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)


def hashed(counter: NDArray[np.uint64], seed: int) -> NDArray[np.uint64]:
    """SplitMix64 of each counter (Steele, Lea and Flood 2014), same shape."""
    with np.errstate(over="ignore"):
        z = counter * _GOLDEN + np.uint64(seed) * np.uint64(0xD1342543DE82EF95) + _GOLDEN
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


class Random:
    """A stream of numbers that its seed alone decides."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._next = 0

    def uniform(self, low: float, high: float, *shape: int) -> NDArray[np.float64]:
        """Numbers in [low, high), of the given shape."""
        count = int(np.prod(shape, dtype=int))
        counter = np.arange(self._next, self._next + count, dtype=np.uint64)
        self._next += count
        unit = (hashed(counter, self._seed) >> np.uint64(11)).astype(np.float64) * 2.0**-53
        return (low + (high - low) * unit).reshape(shape)

    def number(self, low: float, high: float) -> float:
        """One number in [low, high)."""
        return float(self.uniform(low, high, 1)[0])


def value_noise(points: NDArray[np.float64], seed: int) -> NDArray[np.float64]:
    """Smooth noise in [-1, 1] with features of about one unit.

    Args:
        points: Shape (n, 3).
        seed: Which noise.

    Returns:
        Shape (n,).
    """
    cell = np.floor(points).astype(np.int64)
    t = points - cell
    t = t * t * (3.0 - 2.0 * t)
    total = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        index = (cell + corner).astype(np.uint64)
        with np.errstate(over="ignore"):
            key = (
                index[:, 0] * np.uint64(73856093)
                ^ index[:, 1] * np.uint64(19349663)
                ^ index[:, 2] * np.uint64(83492791)
            )
        value = (hashed(key, seed) >> np.uint64(11)).astype(np.float64) * 2.0**-52 - 1.0
        weight = np.prod(np.where(np.array(corner) == 1, t, 1.0 - t), axis=1)
        total += weight * value
    return total
