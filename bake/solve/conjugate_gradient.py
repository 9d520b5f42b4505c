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

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from bake.in_parts import in_parts
from bake.solve.box_part import BoxPart
from bake.solve.face_descent import FaceState
from bake.solve.proportioning import ProportioningState
from bake.types import BoolArray, Float64Array, Int64Array

WORTHWHILE = 0.6
"""The system is cut down to what is not yet solved once that is less than this share of it."""

HELD = 1e-4
"""How far, judged by the gradient, a value must want to leave the box to count as held back."""


Columns = Callable[[Callable[[int], "BoxSolution"], Iterable[int]], Iterator["BoxSolution"]]
"""Does the same for each right-hand side, side by side or one after another."""


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
        sizes = np.diff(first)

        def rows(begin: int, end: int) -> None:
            here = slice(int(matrix.indptr[begin]), int(matrix.indptr[end]))
            data = matrix.data[here]
            data *= inverse[matrix.indices[here]]
            data *= np.repeat(inverse[begin:end], np.diff(matrix.indptr[begin : end + 1]))

        in_parts(rows, len(scale))
        component = np.repeat(np.arange(len(sizes)), sizes)
        self._whole = BoxPart(matrix, scale, first[:-1], sizes, component)

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
        asked = self.asked(rhs, tolerance, within)
        found = Found.none(len(rhs), len(asked.goal))
        x = np.clip(start, 0.0, 1.0) * asked.part.scale
        state = FaceState.begin(asked.part, asked.b, x, asked.goal)
        _iterate(asked.part, state, most_iterations, found, np.arange(len(x)), np.arange(len(asked.goal)))
        return self.told(asked, found, most_iterations)

    def solve_all(
        self,
        rhs: Float64Array,
        start: Float64Array,
        *,
        tolerance: float = 1e-8,
        within: Float64Array | None = None,
        most_iterations: int = 200,
        columns: Columns = map,
    ) -> Iterator[BoxSolution]:
        """Solves for right-hand sides of shape (n, k); arguments as for `solve`, and how they are gone through."""

        def column(k: int) -> BoxSolution:
            return self.solve(
                rhs[:, k], start[:, k], tolerance=tolerance, within=within, most_iterations=most_iterations
            )

        return columns(column, range(rhs.shape[1]))

    def asked(self, rhs: Float64Array, tolerance: float, within: Float64Array | None) -> Asked:
        """One right-hand side in the scaled unknowns, with the goal of each component."""
        part = self._whole
        b = rhs / part.scale
        norm = np.sqrt(part.sum(b * b))
        if within is None:
            return Asked(part, b, tolerance * norm, np.where(norm > 0, norm, 1.0))
        return Asked(replace(part, reach=part.scale / within), b, np.ones(len(norm)), np.ones(len(norm)))

    def told(self, asked: Asked, found: Found, most_iterations: int) -> BoxSolution:
        """The solution, once components that are stuck on their faces have been solved for within the box."""
        part = asked.part
        if found.stuck.any():
            components, unknowns = found.stuck.copy(), part.spread(found.stuck)
            here = part.only(components, unknowns)
            state = ProportioningState.begin(
                here, found.x[unknowns], found.gradient[unknowns], asked.goal[components], found.products[components]
            )
            _iterate(here, state, most_iterations, found, np.flatnonzero(unknowns), np.flatnonzero(components))
        x, gradient = np.clip(found.x / part.scale, 0.0, 1.0), found.gradient / part.scale
        return BoxSolution(
            x=x,
            iterations=int(found.products.max(initial=0)),
            residual=found.measure / asked.norm,
            converged=found.measure <= asked.goal,
            held=((x <= 0) & (gradient > HELD)) | ((x >= 1) & (gradient < -HELD)),
            gradient=gradient,
        )


@dataclass(frozen=True, slots=True)
class Asked:
    """One right-hand side in the scaled unknowns.

    Attributes:
        part: All components, with what their gradients are held against.
        b: Shape (n,), float64.
        goal: Shape (c,), float64: measure at which a component is done.
        norm: Shape (c,), float64: what a measure is told in.
    """

    part: BoxPart
    b: Float64Array
    goal: Float64Array
    norm: Float64Array


@dataclass(frozen=True, slots=True)
class Found:
    """Where each component ended, in scaled unknowns.

    Attributes:
        x, gradient: Shape (n,), float64.
        measure: Shape (c,), float64: what is held against the goal.
        products: Shape (c,), int64.
        stuck: Shape (c,), bool: no projection from a face was good enough.
    """

    x: Float64Array
    gradient: Float64Array
    measure: Float64Array
    products: Int64Array
    stuck: BoolArray

    @staticmethod
    def none(unknowns: int, components: int) -> Found:
        """Room for so many."""
        return Found(
            np.empty(unknowns),
            np.empty(unknowns),
            np.zeros(components),
            np.zeros(components, np.int64),
            np.zeros(components, np.bool_),
        )


def _iterate(
    part: BoxPart,
    state: FaceState | ProportioningState,
    most: int,
    found: Found,
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
