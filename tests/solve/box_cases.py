"""Bounded least squares problems: dense blocks against which SciPy can be held, and grids like those of the mapping."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array


def blocks(rng: np.random.Generator, sizes: list[int], stiffness: float) -> tuple[list[np.ndarray], np.ndarray]:
    """Factors J of the blocks Jᵀ J, one a component, and data that pull many values out of the box."""
    factors = [rng.normal(size=(n + 2, n)) * 10.0 ** rng.uniform(-stiffness, stiffness, n) for n in sizes]
    return factors, np.concatenate([f @ rng.uniform(-1.0, 2.0, f.shape[1]) for f in factors])


def grids(
    rng: np.random.Generator, sides: list[int], columns: int, *, smoothing: float = 1.0
) -> tuple[csr_array, np.ndarray, np.ndarray]:
    """Noisy waves on square grids, one a component: mass plus a Laplacian; matrix, right-hand sides, component bounds.

    Some unknowns weigh a millionth of the others, as those without samples do.
    """
    first = np.cumsum([0, *(side * side for side in sides)])
    size = int(first[-1])
    row, column, weight = [], [], []
    for side, begin in zip(sides, first[:-1], strict=True):
        number = begin + np.arange(side * side).reshape(side, side)
        for a, b in ((number[1:], number[:-1]), (number[:, 1:], number[:, :-1])):
            row.append(a.ravel())
            column.append(b.ravel())
            weight.append(rng.uniform(0.1, 1.0, a.size))
    ends, others, w = np.concatenate(row), np.concatenate(column), np.concatenate(weight)
    mass = np.where(rng.random(size) < 0.05, 1e-6, rng.uniform(0.2, 2.0, size))
    w = smoothing * w * np.minimum(mass[ends], mass[others])
    diagonal = mass + np.bincount(ends, w, size) + np.bincount(others, w, size)
    every = np.arange(size)
    matrix = coo_array(
        (
            np.concatenate([-w, -w, diagonal]),
            (np.concatenate([ends, others, every]), np.concatenate([others, ends, every])),
        )
    )
    wave = (
        0.5
        + 0.8 * np.sin(0.37 * every[:, None] / np.sqrt(size) + np.arange(columns))
        + rng.normal(0, 0.4, (size, columns))
    )
    return csr_array(matrix.tocsr()), mass[:, None] * wave, first.astype(np.int64)
