"""Single columns of the inverse of a large sparse matrix, found where they matter.

A value of the fit is `x_v = e_vᵀ A⁻¹ b`, so the row `aᵀ = e_vᵀ A⁻¹` says how much every entry of b counts for it. The
matrix of the fit couples neighbours only and is well conditioned, so `a` falls off within a few rings of faces (Demko,
Moss and Smith 1984). It is therefore solved for on a patch around v alone, with zeros outside, and the patch grows
where that leaves too much behind: with the residual r = e_v - A a,

    x_v - a·b = r·x,

and as 0 ≤ x ≤ 1, the sum of |r| bounds the error that the patch makes, whatever the samples are.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from bake.solve.scatter import scatter_add
from bake.types import BoolArray, Float64Array, Int64Array

FIRST_RINGS = 6
"""Rings of neighbours in the first patch."""

MORE_RINGS = 3
"""Rings by which a patch grows where it leaks."""

MOST_STEPS = 2000

LEAST_AREA = 1e-280
"""Entries of the diagonal, m², below which an unknown has no column that numbers could hold; it counts as cut off."""


@dataclass(frozen=True, slots=True)
class Column:
    """The part of A⁻¹ e that matters.

    Attributes:
        unknowns: Shape (p,), int64, sorted.
        values: Shape (p,), float64, 1/m².
        cut_off: Sum of |e - A a|: bound on what is missing, in AO.
        fixed: Shape (q,), int64: unknowns held constant next to the patch.
        coefficients: Shape (q,), float64: what their values count for.
    """

    unknowns: Int64Array
    values: Float64Array
    cut_off: float
    fixed: Int64Array
    coefficients: Float64Array


@dataclass(frozen=True, slots=True)
class _Patch:
    """Rows of the matrix at some unknowns: the square part, and what reaches out of it."""

    unknowns: Int64Array
    square: csr_array
    row: Int64Array  # of entries that leave the patch
    column: Int64Array
    entry: Float64Array


class Greens:
    """Solves for columns of the inverse of one matrix.

    Args:
        matrix: Shape (n, n), symmetric positive definite; entries may repeat.
    """

    def __init__(self, matrix: csr_array) -> None:
        self._start = matrix.indptr.astype(np.int64)
        self._columns: NDArray[Any] = matrix.indices
        self._entries: Float64Array = matrix.data
        self.diagonal: Float64Array = matrix.diagonal()
        self._slot = np.full(len(self.diagonal), -1, np.int64)

    def column(
        self, unknowns: Int64Array, weights: Float64Array, *, tolerance: float, fixed: BoolArray | None = None
    ) -> Column:
        """A⁻¹ e for the vector e that has `weights` at `unknowns`.

        Args:
            unknowns: Shape (m,), int64, distinct.
            weights: Shape (m,), float64.
            tolerance: Bound on `Column.cut_off`.
            fixed: Shape (n,), bool: unknowns that are constants, not to be solved for; none if absent.
        """
        values = np.zeros(0)
        members = self.rings(unknowns, FIRST_RINGS)
        lost = float(np.abs(weights[self.diagonal[unknowns] < LEAST_AREA]).sum())
        known = np.zeros(0, np.int64)
        while True:
            if fixed is not None:
                members = members[~fixed[members]]
            members = members[self.diagonal[members] >= LEAST_AREA]
            with self._numbered(members):
                start = np.zeros(len(members))
                start[self._slot[known]] = values
                wanted = np.zeros(len(members))
                inside = self._slot[unknowns] >= 0
                wanted[self._slot[unknowns[inside]]] = weights[inside]
                patch = self._patch(members)
            values, left = _conjugate_gradients(patch.square, self.diagonal[members], wanted, start, 0.25 * tolerance)
            known = members
            leaks, at = np.unique(patch.column, return_inverse=True)
            leak = scatter_add(at, patch.entry * values[patch.row], len(leaks))
            held = np.zeros(len(leaks), np.bool_) if fixed is None else fixed[leaks]
            open_leak = np.where(held, 0.0, np.abs(leak))
            cut_off = float(open_leak.sum()) + left + lost
            if cut_off - lost <= tolerance or not open_leak.any():
                return Column(known, values, cut_off, leaks[held], -leak[held])
            worst = leaks[open_leak > 0.25 * tolerance / max(np.count_nonzero(open_leak), 1)]
            members = np.union1d(members, self.rings(worst, MORE_RINGS))

    def rings(self, unknowns: Int64Array, count: int) -> Int64Array:
        """The unknowns within `count` steps, sorted."""
        members = frontier = np.unique(unknowns)
        for _ in range(count):
            reached = np.unique(self._columns[self._entries_of(frontier)[0]]).astype(np.int64)
            frontier = np.setdiff1d(reached, members, assume_unique=True)
            if not len(frontier):
                break
            members = np.union1d(members, frontier)
        return members

    def _entries_of(self, rows: Int64Array) -> tuple[Int64Array, Int64Array]:
        """Places of the entries of some rows, and how many each has."""
        begin = self._start[rows]
        count = self._start[rows + 1] - begin
        shift = np.repeat(begin - (np.cumsum(count) - count), count)
        return shift + np.arange(len(shift)), count

    def _patch(self, members: Int64Array) -> _Patch:
        place, count = self._entries_of(members)
        row = np.repeat(np.arange(len(members)), count)
        column, entry = self._columns[place].astype(np.int64), self._entries[place]
        slot = self._slot[column]
        inside = slot >= 0
        indptr = np.concatenate([[0], np.cumsum(np.bincount(row[inside], minlength=len(members)))])
        square = csr_array((entry[inside], slot[inside], indptr), shape=(len(members), len(members)))
        return _Patch(members, square, row[~inside], column[~inside], entry[~inside])

    @contextmanager
    def _numbered(self, members: Int64Array) -> Generator[None]:
        """Within, `_slot` tells the place of each unknown among the members."""
        self._slot[members] = np.arange(len(members))
        try:
            yield
        finally:
            self._slot[members] = -1


def _conjugate_gradients(
    matrix: csr_array, diagonal: Float64Array, rhs: Float64Array, start: Float64Array, tolerance: float
) -> tuple[Float64Array, float]:
    """Jacobi-preconditioned, until the sum of the residual's magnitudes is within tolerance; returns that sum too."""
    x = start.copy()
    residual = rhs - matrix @ x
    scaled = residual / diagonal
    direction = scaled.copy()
    energy = float(residual @ scaled)
    left = float(np.abs(residual).sum())
    for _ in range(MOST_STEPS):
        if left <= tolerance or energy <= 0.0:
            break
        product = matrix @ direction
        length = energy / float(direction @ product)
        x += length * direction
        residual -= length * product
        scaled = residual / diagonal
        previous, energy = energy, float(residual @ scaled)
        direction = scaled + (energy / previous) * direction
        left = float(np.abs(residual).sum())
    return x, left
