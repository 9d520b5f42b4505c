"""Components that conjugate gradients give up: factorised, and solved under bounds by a primal-dual active set.

Where alpha is so large that the regulariser outweighs the data a thousandfold, the system's condition grows with it and
no number of iterations that anyone would wait for suffices. A sparse factorisation does not care. The bounds come in by
guessing which values sit at 0 or 1, solving for the rest, and guessing again from where the answer and the multipliers
point; the guess repeats after a few rounds, and then all optimality conditions hold.

Reference: Hintermüller, Ito and Kunisch 2002, "The primal-dual active set strategy as a semismooth Newton method" (SIAM
Journal on Optimization 13(3)).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csc_array, csr_array

from bake.solve.conjugate_gradient import HELD, BoxSolution, BoxSolver
from bake.types import Float64Array

LARGEST = 100_000
"""Unknowns of a component up to which it is factorised: some seconds, and a gigabyte at most."""

_ROUNDS = 30
_REFINEMENTS = 2


def finished(solver: BoxSolver, rhs: Float64Array, solution: BoxSolution) -> BoxSolution:
    """The solution with every component of at most `LARGEST` unknowns that did not converge solved directly.

    Args:
        solver: What made `solution`.
        rhs: Shape (n,), float64: its right-hand side.
        solution: Where the iteration ended. Components whose active set does not settle stay as they are.
    """
    open_ones = [int(i) for i in np.flatnonzero(~solution.converged) if solver.size(int(i)) <= LARGEST]
    if not open_ones:
        return solution
    x, held, gradient = solution.x.copy(), solution.held.copy(), solution.gradient.copy()
    residual, converged = solution.residual.copy(), solution.converged.copy()
    for number in open_ones:
        matrix, scale, own = solver.component(number)
        b = rhs[own] / scale
        found = _active_set(matrix, b, scale, x[own] * scale)
        if found is None:
            continue
        x[own] = np.clip(found / scale, 0.0, 1.0)
        slope = matrix @ (x[own] * scale) - b
        gradient[own] = slope / scale
        held[own] = ((x[own] <= 0) & (gradient[own] > HELD)) | ((x[own] >= 1) & (gradient[own] < -HELD))
        outward = ((x[own] <= 0) & (slope > 0)) | ((x[own] >= 1) & (slope < 0))
        norm = float(np.linalg.norm(b))
        residual[number] = float(np.linalg.norm(np.where(outward, 0.0, slope))) / (norm if norm > 0 else 1.0)
        converged[number] = True
    return replace(solution, x=x, held=held, gradient=gradient, residual=residual, converged=converged)


def _active_set(matrix: csr_array, b: Float64Array, upper: Float64Array, x: Float64Array) -> Float64Array | None:
    """The minimum over 0 ≤ x ≤ upper, or None if the guesses went in circles."""
    low, high = x <= 0, x >= upper
    for _ in range(_ROUNDS):
        x = np.where(high, upper, 0.0)
        free = ~(low | high)
        if free.any():
            x[free] = _solved(matrix[free][:, free], (b - matrix @ x)[free])
        multiplier = b - matrix @ x
        multiplier[free] = 0.0
        # the system's diagonal is 1: a multiplier and a step of the same size weigh the same
        next_low = x + multiplier < 0
        next_high = x + multiplier > upper
        next_low |= low & (multiplier < 0)
        next_high |= high & (multiplier > 0)
        if np.array_equal(next_low, low) and np.array_equal(next_high, high):
            return x
        low, high = next_low, next_high
    return None


def _solved(matrix: csr_array, b: Float64Array) -> Float64Array:
    """The solution of a symmetric positive definite system, refined twice."""
    from scipy.sparse.linalg import splu

    factor = splu(csc_array(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    x: Float64Array = factor.solve(b)
    for _ in range(_REFINEMENTS):
        x = x + factor.solve(b - matrix @ x)
    return x
