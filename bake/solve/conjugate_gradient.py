"""Conjugate gradients under bounds, every connected component on its own step lengths.

Minimises ½ xᵀAx - bᵀx over the box 0 ≤ x ≤ 1 by *modified proportioning with reduced gradient projections*: conjugate
gradients on the vertices inside the bounds, a projected gradient step where a step would leave the box, and a step
along the chopped gradient where the bounds hold vertices back too firmly. Values lie within the bounds by construction,
not by clamping a finished answer: the neighbours of a vertex at a bound are optimal for it being there.

The matrix is scaled to a unit diagonal, which is Jacobi preconditioning and leaves the box a box.

Components do not touch each other, so each has its own step lengths, its own mode and its own end: a small component is
exact after as many iterations as it has vertices, whatever the large ones need, and one that cannot be solved is known
by its own residual.

Reference: Dostál and Schöberl 2005, "Minimizing quadratic functions over non-negative cone with the rate of convergence
and finite termination" (Computational Optimization and Applications 30(1)), algorithm MPRGP.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from bake.types import BoolArray, Float64Array, Int64Array


@dataclass(frozen=True, slots=True)
class BoxSolution:
    """What `solve_in_box` found.

    Attributes:
        x: Shape (n,), float64, in [0, 1].
        iterations: Products with the matrix.
        residual: Shape (c,), float64: per component the norm of the projected gradient over that of the right-hand
            side, both in the scaled unknowns; 0 where both vanish.
        converged: Shape (c,), bool.
    """

    x: Float64Array
    iterations: int
    residual: Float64Array
    converged: BoolArray


class BoxSolver:
    """The scaled matrix of one system, for any number of right-hand sides.

    Args:
        matrix: Shape (n, n), symmetric positive definite, unknowns of a component contiguous. Its data is overwritten.
        first: Shape (c + 1,), int64: component i owns unknowns `first[i]:first[i + 1]`, none empty.
    """

    def __init__(self, matrix: csr_array, first: Int64Array) -> None:
        self._first = np.asarray(first)[:-1]
        self._sizes = np.diff(first)
        diagonal = matrix.diagonal()
        self._scale = np.sqrt(diagonal)
        inverse = 1.0 / self._scale
        matrix.data *= inverse[matrix.indices]
        matrix.data *= np.repeat(inverse, np.diff(matrix.indptr))
        self._matrix = matrix
        row_sums = np.add.reduceat(np.abs(matrix.data), matrix.indptr[:-1])  # no row is empty: it has its diagonal
        self._step = 1.0 / np.maximum.reduceat(row_sums, self._first)  # below 2 / norm, by Gershgorin

    def solve(
        self, rhs: Float64Array, start: Float64Array, *, tolerance: float = 1e-8, most_iterations: int = 200
    ) -> BoxSolution:
        """Solves for one right-hand side.

        Args:
            rhs: Shape (n,), float64.
            start: Shape (n,), float64: first guess; clipped to the box.
            tolerance: Relative projected residual at which a component is done.
            most_iterations: Products with the matrix after which components are given up.
        """
        a, top = self._matrix, self._scale
        b = rhs / self._scale
        goal = tolerance * np.sqrt(self._sum(b * b))
        x = np.clip(start, 0.0, 1.0) * self._scale
        gradient = a @ x - b
        iterations = 1
        direction = self._free(x, gradient)
        measure = np.zeros(len(self._first))
        while True:
            free = self._free(x, gradient)
            chopped = np.where(x <= 0, np.minimum(gradient, 0), np.where(x >= top, np.maximum(gradient, 0), 0))
            free_norm, chopped_norm = self._sum(free * free), self._sum(chopped * chopped)
            measure = np.sqrt(free_norm + chopped_norm)
            open_ = measure > goal
            if not open_.any() or iterations >= most_iterations:
                break
            proportional = chopped_norm <= free_norm
            d = np.where(self._spread(proportional), direction, chopped)
            d[~self._spread(open_)] = 0.0
            product = a @ d
            iterations += 1
            curvature = self._sum(d * product)
            safe = np.where(curvature > 0, curvature, 1.0)
            length = np.where(curvature > 0, self._sum(d * gradient) / safe, 0.0)
            room = self._room(x, d)
            step = np.minimum(length, room)
            moved = self._spread(step)
            x -= moved * d
            np.clip(x, 0.0, top, out=x)
            gradient -= moved * product
            expands = open_ & proportional & (length > room)
            if expands.any():
                change = np.where(self._spread(expands), self._free(x, gradient) * self._spread(self._step), 0.0)
                change = np.clip(x - change, 0.0, top) - x
                x += change
                gradient += a @ change
                iterations += 1
            free = self._free(x, gradient)
            conjugate = open_ & proportional & ~expands
            weight = np.where(conjugate, self._sum(free * product) / safe, 0.0)
            direction = free - self._spread(weight) * d
        norm = np.sqrt(self._sum(b * b))
        residual = np.where(norm > 0, measure / np.where(norm > 0, norm, 1.0), measure)
        return BoxSolution(np.clip(x / self._scale, 0.0, 1.0), iterations, residual, measure <= goal)

    def _sum(self, values: Float64Array) -> Float64Array:
        return np.add.reduceat(values, self._first)

    def _spread(self, per_component: np.ndarray) -> np.ndarray:
        return np.repeat(per_component, self._sizes)

    def _free(self, x: Float64Array, gradient: Float64Array) -> Float64Array:
        return np.where((x > 0) & (x < self._scale), gradient, 0.0)

    def _room(self, x: Float64Array, d: Float64Array) -> Float64Array:
        """Longest step along -d that stays in the box, per component."""
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(d > 0, x / d, np.where(d < 0, (x - self._scale) / d, np.inf))
        return np.minimum.reduceat(room, self._first)
