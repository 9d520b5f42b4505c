"""Components that conjugate gradients give up: factorised, and solved under bounds by block pivoting.

Where alpha is so large that the regulariser outweighs the data a thousandfold, the system's condition grows with it and
no number of iterations that anyone would wait for suffices. A sparse factorisation does not care. The bounds come in by
guessing which values sit at 0 or 1, solving for the rest, and guessing again from where the answer and the slopes
point; after a few rounds nothing contradicts the guess, and then all optimality conditions hold.

Reference: block principal pivoting, Júdice and Pires 1994, "A block principal pivoting algorithm for large-scale
strictly monotone linear complementarity problems" (Computers & Operations Research 21(5)).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csc_array, csr_array

from bake.solve.conjugate_gradient import HELD, BoxSolution, BoxSolver
from bake.types import Float64Array

LARGEST = 100_000
"""Unknowns of a component up to which it is factorised: some seconds, and a gigabyte at most."""

_FACTORISED = 400_000  # unknowns in all rounds together
_PATIENCE = 6
_SLACK = 1e-13
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
    """The minimum over 0 ≤ x ≤ upper, or None if the guesses do not settle.

    All values that contradict the guess change sides at once; where that makes no fewer of them for a few rounds, only
    the last one does, which cannot go in circles.
    """
    low, high = x <= 0, x >= upper
    fewest, patience = len(b) + 1, _PATIENCE
    for _ in range(max(30, min(400, _FACTORISED // len(b)))):
        x = np.where(high, upper, 0.0)
        free = ~(low | high)
        if free.any():
            x[free] = _solved(matrix[free][:, free], (b - matrix @ x)[free])
        slope = matrix @ x - b
        # the system's diagonal is 1: a slope and a step of the same size weigh the same
        slack = _SLACK * np.maximum(upper, 1.0)
        below, above = free & (x < -slack), free & (x > upper + slack)
        wrong = below | above | (low & (slope < -slack)) | (high & (slope > slack))
        count = int(np.count_nonzero(wrong))
        if count == 0:
            return x
        if count < fewest:
            fewest, patience = count, _PATIENCE
        elif patience > 0:
            patience -= 1
        else:
            wrong[: np.flatnonzero(wrong)[-1]] = False
        low, high = (low ^ (wrong & low)) | (below & wrong), (high ^ (wrong & high)) | (above & wrong)
    return None


def _solved(matrix: csr_array, b: Float64Array) -> Float64Array:
    """The solution of a symmetric positive definite system, refined twice."""
    from scipy.sparse.linalg import splu

    factor = splu(csc_array(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    x: Float64Array = factor.solve(b)
    for _ in range(_REFINEMENTS):
        x = x + factor.solve(b - matrix @ x)
    return x
