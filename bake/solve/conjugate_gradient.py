"""Least squares under bounds, every connected component on its own step lengths.

Minimises ½ xᵀAx - bᵀx over the box 0 ≤ x ≤ 1 by conjugate gradients on one face of the box after another
(`bake.solve.face_descent`), and where that finds no way down by steps that never leave it
(`bake.solve.proportioning`). Values lie within the bounds by construction, not by clamping a finished answer: the
neighbours of a vertex at a bound are optimal for it being there.

The matrix is scaled to a unit diagonal, which is Jacobi preconditioning and leaves the box a box.

Components do not touch each other, so each has its own step lengths, its own face, its own count of products and its
own end: a small component is exact after as many iterations as it has vertices, whatever the large ones need, and one
that cannot be solved is known by its own residual.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from bake.solve.box_part import BoxPart
from bake.solve.face_descent import FaceState
from bake.solve.proportioning import ProportioningState
from bake.types import BoolArray, Float64Array, Int64Array

WORTHWHILE = 0.6
"""The system is cut down to what is not yet solved once that is less than this share of it."""

HELD = 1e-4
"""How far, judged by the gradient, a value must want to leave the box to count as held back."""


@dataclass(frozen=True, slots=True)
class BoxSolution:
    """What `solve_in_box` found.

    Attributes:
        x: Shape (n,), float64, in [0, 1].
        iterations: Products with the matrix, most of any component.
        residual: Shape (c,), float64: per component the norm of the projected gradient over that of the right-hand
            side, both in the scaled unknowns, 0 where both vanish; or the largest share of `within`.
        converged: Shape (c,), bool.
        held: Shape (n,), bool: at 0 or 1 because of the bounds: without them the value would leave by more than `HELD`.
        gradient: Shape (n,), float64: Ax - b over the diagonal: by how much each value misses its own row.
    """

    x: Float64Array
    iterations: int
    residual: Float64Array
    converged: BoolArray
    held: BoolArray
    gradient: Float64Array


class BoxSolver:
    """The scaled matrix of one system, for any number of right-hand sides.

    Args:
        matrix: Shape (n, n), symmetric positive definite, unknowns of a component contiguous. Its data is overwritten.
        first: Shape (c + 1,), int64: component i owns unknowns `first[i]:first[i + 1]`, none empty.
    """

    def __init__(self, matrix: csr_array, first: Int64Array) -> None:
        diagonal: Float64Array = matrix.diagonal()
        scale = np.sqrt(diagonal)
        inverse = 1.0 / scale
        matrix.data *= inverse[matrix.indices]
        matrix.data *= np.repeat(inverse, np.diff(matrix.indptr))
        row_sums = np.add.reduceat(np.abs(matrix.data), matrix.indptr[:-1])  # no row is empty: it has its diagonal
        step = 1.0 / np.maximum.reduceat(row_sums, first[:-1])  # below 2 / norm, by Gershgorin
        sizes = np.diff(first)
        component = np.repeat(np.arange(len(sizes)), sizes)
        self._whole = BoxPart(matrix, scale, first[:-1], sizes, component, step)

    def size(self, component: int) -> int:
        """How many unknowns a component has."""
        return int(self._whole.sizes[component])

    def component(self, component: int) -> tuple[csr_array, Float64Array, slice]:
        """Its matrix scaled to a unit diagonal, the root of the diagonal it had, and where its unknowns lie."""
        begin = int(self._whole.begin[component])
        own = slice(begin, begin + self.size(component))
        return self._whole.matrix[own][:, own], self._whole.scale[own], own

    def solve(
        self,
        rhs: Float64Array,
        start: Float64Array,
        *,
        tolerance: float = 1e-8,
        within: Float64Array | None = None,
        most_iterations: int = 200,
    ) -> BoxSolution:
        """Solves for one right-hand side.

        Args:
            rhs: Shape (n,), float64.
            start: Shape (n,), float64: first guess; clipped to the box.
            tolerance: Relative projected residual at which a component is done.
            within: Shape (n,), float64: in place of `tolerance`: a component is done when the projected gradient of
                every unknown is at most this, in the unit of the right-hand side.
            most_iterations: Products with the matrix after which a component is given up.
        """
        part = self._whole
        b = rhs / part.scale
        norm = np.sqrt(part.sum(b * b))
        goal = tolerance * norm
        if within is not None:
            part, goal = replace(part, reach=part.scale / within), np.ones(len(norm))
        found = _Found.none(len(b), len(norm))
        state: FaceState | ProportioningState
        state = FaceState.begin(part, b, np.clip(start, 0.0, 1.0) * part.scale, goal)
        _iterate(part, state, most_iterations, found, np.arange(len(b)), np.arange(len(norm)))
        if found.stuck.any():
            components, unknowns = found.stuck, part.spread(found.stuck)
            here = part.only(components, unknowns)
            products = found.products[components]
            state = ProportioningState.begin(
                here, found.x[unknowns], found.gradient[unknowns], goal[components], products
            )
            _iterate(here, state, most_iterations, found, np.flatnonzero(unknowns), np.flatnonzero(components))
        converged = found.measure <= goal
        residual = found.measure / (np.where(norm > 0, norm, 1.0) if within is None else 1.0)
        return solution_of(found.x / part.scale, found.gradient / part.scale, found.products, residual, converged)


def solution_of(
    x: Float64Array, gradient: Float64Array, products: Int64Array, residual: Float64Array, converged: BoolArray
) -> BoxSolution:
    """A solution with what follows from it: values clipped by the last bit, and which of them are held."""
    x = np.clip(x, 0.0, 1.0)
    held = ((x <= 0) & (gradient > HELD)) | ((x >= 1) & (gradient < -HELD))
    return BoxSolution(x, int(products.max(initial=0)), residual, converged, held, gradient)


@dataclass(frozen=True, slots=True)
class _Found:
    """Where each component ended, in scaled unknowns."""

    x: Float64Array
    gradient: Float64Array
    measure: Float64Array
    products: Int64Array
    stuck: BoolArray

    @staticmethod
    def none(unknowns: int, components: int) -> _Found:
        return _Found(
            np.empty(unknowns), np.empty(unknowns), np.zeros(components), np.zeros(components, np.int64),
            np.zeros(components, np.bool_),
        )  # fmt: skip


def _iterate(
    part: BoxPart,
    state: FaceState | ProportioningState,
    most: int,
    found: _Found,
    unknowns: Int64Array,
    components: Int64Array,
) -> None:
    """Goes on until every component is done, stuck or out of products; writes where each ended."""
    while True:
        measure = state.measure(part)
        found.measure[components], found.products[components] = measure, state.products
        found.stuck[components] = state.stuck
        working = (measure > state.goal) & ~state.stuck & (state.products + 2 <= most)
        stop = not working.any()
        inside = part.spread(working)
        if stop or np.count_nonzero(inside) < WORTHWHILE * len(inside):
            found.x[unknowns], found.gradient[unknowns] = state.x, state.gradient
            if stop:
                return
            part, state = part.only(working, inside), state.only(working, inside)
            unknowns, components = unknowns[inside], components[working]
            working, inside = working[working], inside[inside]
        state.advance(part, working, inside, most)
