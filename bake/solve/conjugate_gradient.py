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

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from bake.solve.scatter import scatter_add
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
        iterations: Products with the matrix.
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
        self._whole = _Part(matrix, scale, first[:-1], sizes, component, step)

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
            most_iterations: Products with the matrix after which components are given up.
        """
        part = self._whole
        b = rhs / part.scale
        norm = np.sqrt(part.sum(b * b))
        goal = tolerance * norm
        if within is not None:
            part, goal = replace(part, reach=part.scale / within), np.ones(len(norm))
        state = _State.begin(part, b, np.clip(start, 0.0, 1.0) * part.scale, goal)
        result, gradient = np.empty(len(b)), np.empty(len(b))
        measure = np.zeros(len(norm))
        unknowns, components = np.arange(len(b)), np.arange(len(norm))
        while True:
            measure[components] = state.measure(part)
            working = measure[components] > state.goal
            stop = not working.any() or state.iterations + 2 > most_iterations
            inside = part.spread(working)
            if stop or np.count_nonzero(inside) < WORTHWHILE * len(inside):
                result[unknowns] = state.x / part.scale
                gradient[unknowns] = state.gradient / part.scale
                if stop:
                    break
                part, state = part.only(working, inside), state.only(working, inside)
                unknowns, components = unknowns[inside], components[working]
                working, inside = working[working], inside[inside]
            state.advance(part, working, inside)
        converged = measure <= goal
        residual = measure / (np.where(norm > 0, norm, 1.0) if within is None else 1.0)
        result = np.clip(result, 0.0, 1.0)
        held = ((result <= 0) & (gradient > HELD)) | ((result >= 1) & (gradient < -HELD))
        return BoxSolution(result, state.iterations, residual, converged, held, gradient)


@dataclass(frozen=True, slots=True)
class _Part:
    """Some whole components of the scaled system."""

    matrix: csr_array
    scale: Float64Array  # root of the diagonal, and thereby the upper bound of a scaled unknown
    begin: Int64Array  # first unknown of each component
    sizes: Int64Array  # unknowns of each component
    component: Int64Array  # of each unknown
    step: Float64Array  # length of a gradient step that cannot raise the energy, per component
    reach: Float64Array | None = None  # one over the gradient at which an unknown counts as solved; by norms if None

    def sum(self, values: Float64Array) -> Float64Array:
        """Sums over each component."""
        return np.add.reduceat(values, self.begin)

    def spread(self, per_component: NDArray[Any]) -> NDArray[Any]:
        """Each component's value at its unknowns."""
        return np.repeat(per_component, self.sizes)

    def only(self, components: BoolArray, unknowns: BoolArray) -> _Part:
        """The part that is left when other components are done."""
        component = (np.cumsum(components) - 1)[self.component[unknowns]]
        return _Part(
            matrix=self.matrix[unknowns][:, unknowns],
            scale=self.scale[unknowns],
            begin=np.cumsum(self.sizes[components]) - self.sizes[components],
            sizes=self.sizes[components],
            component=component,
            step=self.step[components],
            reach=None if self.reach is None else self.reach[unknowns],
        )


@dataclass(slots=True)
class _State:
    """Where the iteration stands; vectors are in scaled unknowns."""

    x: Float64Array
    gradient: Float64Array
    free: Float64Array  # the gradient of unknowns strictly inside the bounds, 0 at the others
    direction: Float64Array
    goal: Float64Array
    free_norm: Float64Array  # squared, per component
    chopped_norm: Float64Array  # squared, of the part of the gradient that leads from a bound into the box
    iterations: int

    @staticmethod
    def begin(part: _Part, b: Float64Array, x: Float64Array, goal: Float64Array) -> _State:
        gradient = part.matrix @ x - b
        state = _State(x, gradient, gradient, gradient, goal, goal, goal, 1)
        state.split(part)
        state.direction = state.free
        return state

    def only(self, components: BoolArray, unknowns: BoolArray) -> _State:
        return _State(
            self.x[unknowns],
            self.gradient[unknowns],
            self.free[unknowns],
            self.direction[unknowns],
            self.goal[components],
            self.free_norm[components],
            self.chopped_norm[components],
            self.iterations,
        )

    def measure(self, part: _Part) -> Float64Array:
        """Norm of the projected gradient of each component, or its largest entry over the reach."""
        if part.reach is None:
            return np.sqrt(self.free_norm + self.chopped_norm)
        projected = np.abs(self.free)
        released, pull = self._released(part)
        projected[released] = np.abs(pull)
        return np.maximum.reduceat(projected * part.reach, part.begin)

    def split(self, part: _Part) -> None:
        """Renews what follows from `x` and `gradient`."""
        self.free = self.gradient * ((self.x > 0) & (self.x < part.scale))
        self.free_norm = part.sum(self.free * self.free)
        released, pull = self._released(part)
        self.chopped_norm = scatter_add(part.component[released], pull * pull, len(self.goal))

    def advance(self, part: _Part, working: BoolArray, inside: BoolArray) -> None:
        """One step of every working component, in place."""
        proportional = self.chopped_norm <= self.free_norm
        d = self.direction
        if not proportional.all():
            d = d * part.spread(proportional)
            released, pull = self._released(part)
            here = ~proportional[part.component[released]]
            d[released[here]] = pull[here]
        if not working.all():
            d = d * inside
        product = part.matrix @ d
        self.iterations += 1
        curvature = part.sum(d * product)
        bends = curvature > 0
        curvature[~bends] = 1.0
        length = np.where(bends, part.sum(d * self.gradient) / curvature, 0.0)
        expands = self._move(part, d, product, length) & working & proportional
        if expands.any():
            uphill = self.gradient * ((self.x > 0) & (self.x < part.scale)) * part.spread(expands * part.step)
            projected = np.clip(self.x - uphill, 0.0, part.scale)
            self.gradient += part.matrix @ (projected - self.x)
            self.x = projected
            self.iterations += 1
        self.split(part)
        conjugate = np.where(working & proportional & ~expands, part.sum(self.free * product) / curvature, 0.0)
        self.direction = self.free - part.spread(conjugate) * d

    def _move(self, part: _Part, d: Float64Array, product: Float64Array, length: Float64Array) -> BoolArray:
        """Goes `length` along -d, or as far as the box allows; returns which components met a bound."""
        spread = part.spread(length)
        move = spread * d
        trial = self.x - move
        outside = np.flatnonzero((trial < 0) | (trial > part.scale))
        met = np.zeros(len(length), np.bool_)
        if len(outside):
            going = move[outside]
            room = np.where(going > 0, self.x[outside], self.x[outside] - part.scale[outside])
            share = np.ones(len(length))
            np.minimum.at(share, part.component[outside], room / going)
            met[part.component[outside]] = True
            shares = part.spread(share)
            trial = np.clip(self.x - shares * move, 0.0, part.scale)
            spread = spread * shares
        self.x = trial
        self.gradient -= spread * product
        return met

    def _released(self, part: _Part) -> tuple[Int64Array, Float64Array]:
        """Unknowns at a bound that the energy pulls into the box, and their gradients."""
        at_bound = np.flatnonzero((self.x <= 0) | (self.x >= part.scale))
        pull = self.gradient[at_bound]
        into = np.where(self.x[at_bound] <= 0, pull < 0, pull > 0)
        return at_bound[into], pull[into]
