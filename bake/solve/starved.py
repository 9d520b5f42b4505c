"""The last word on vertices without samples, once all others have their values.

Their rows weigh a millionth of the others', so that a residual over a whole component tells nothing of them: they stay
where the iteration began, or at a bound that it once met. Given the others they are solved for again, each patch of
them to its own scale. What that moves back among the others is a millionth of it.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from bake.solve.box_choice import box_solver
from bake.solve.direct import finished
from bake.solve.system import Equations
from bake.types import BoolArray, Float64Array, Int64Array


def settle_starved(
    equations: Equations,
    alpha: float,
    values: Float64Array,
    held: BoolArray,
    gradient: Float64Array | None = None,
    *,
    but: BoolArray | None = None,
    tolerance: float,
    most_iterations: int,
    device: str,
) -> None:
    """Solves for the unknowns without samples, all others held, in place.

    Args:
        equations: Of some components.
        alpha: For objects that have none of their own.
        values: Shape (u, k), float64: a solution.
        held: Shape (u, k), bool: values that the bounds hold back.
        gradient: Shape (u, k), float64, m²: Ax - b, if it is to follow.
        but: Shape (u,), bool: unknowns that are left alone.
        tolerance: Relative projected residual at which a patch is done.
        most_iterations: For each distance.
        device: Where to, as the settings name it.
    """
    lost = np.flatnonzero(equations.starved if but is None else equations.starved & ~but)
    if not len(lost):
        return
    start, column, entry = rows_of(equations, alpha, lost)
    slot = np.full(len(values), -1, np.int64)
    slot[lost] = np.arange(len(lost))
    row = np.repeat(np.arange(len(lost)), np.diff(start))
    inside = slot[column] >= 0
    shape = (len(lost), len(lost))
    square = csr_array((entry[inside], (row[inside], slot[column[inside]])), shape=shape)
    pieces, label = connected_components(square, directed=False)
    order = np.argsort(label, kind="stable")
    square = csr_array(square[order][:, order])
    first = np.concatenate([[0], np.cumsum(np.bincount(label, minlength=pieces))]).astype(np.int64)
    solver = box_solver(square, first, device)
    diagonal = equations.main_diagonal(alpha)[lost]
    across = csr_array((entry[~inside], (row[~inside], column[~inside])), shape=(len(lost), len(values)))
    rhs = equations.data[lost] + equations.pull(alpha)[lost, None] * equations.average[lost] - across @ values
    before = values[lost]
    asked = rhs[order]
    solutions = solver.solve_all(asked, before[order], tolerance=tolerance, most_iterations=most_iterations)
    for k, solution in enumerate(solutions):
        found = finished(solver, asked[:, k], solution)
        values[lost[order], k], held[lost[order], k] = found.x, found.held
        if gradient is not None:
            gradient[lost[order], k] = found.gradient * diagonal[order]
    if gradient is not None:
        gradient += across.T @ (values[lost] - before)


def rows_of(equations: Equations, alpha: float, members: Int64Array) -> tuple[Int64Array, Int64Array, Float64Array]:
    """Row pointers, columns and entries of some rows of the matrix."""
    surface = equations.surface
    count = np.diff(surface.indptr)[members].astype(np.int64)
    start = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    places = np.repeat(surface.indptr[members].astype(np.int64) - start[:-1], count) + np.arange(int(start[-1]))
    return start, surface.indices[places].astype(np.int64), equations.entries(alpha, places)
