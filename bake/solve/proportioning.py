"""Conjugate gradients under bounds that never leave the box: slow but sure.

*Modified proportioning with reduced gradient projections*: conjugate gradients on the vertices inside the bounds, a
projected gradient step where a step would leave the box, and a step along the chopped gradient where the bounds hold
vertices back too firmly. Each meeting with a bound ends a run of conjugate gradients, and on large components some
vertex meets one at nearly every step; `bake.solve.face_descent` needs far fewer products. This is for components
where that finds no way down, as it converges whatever the system.

Reference: Dostál and Schöberl 2005, "Minimizing quadratic functions over non-negative cone with the rate of convergence
and finite termination" (Computational Optimization and Applications 30(1)), algorithm MPRGP.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.solve.box_part import BoxPart
from bake.solve.scatter import scatter_add
from bake.types import BoolArray, Float64Array, Int64Array


@dataclass(slots=True)
class ProportioningState:
    """Where the iteration stands; vectors are in scaled unknowns."""

    x: Float64Array
    gradient: Float64Array
    free: Float64Array  # the gradient of unknowns strictly inside the bounds, 0 at the others
    direction: Float64Array
    goal: Float64Array
    free_norm: Float64Array  # squared, per component
    chopped_norm: Float64Array  # squared, of the part of the gradient that leads from a bound into the box
    step: Float64Array  # length of a gradient step that cannot raise the energy, per component
    products: Int64Array  # with the matrix, per component
    stuck: BoolArray  # never: it always finds a way down

    @staticmethod
    def begin(
        part: BoxPart, x: Float64Array, gradient: Float64Array, goal: Float64Array, products: Int64Array
    ) -> ProportioningState:
        """At some values within the box.

        Args:
            part: What is solved.
            x, gradient: Shape (n,): scaled values and Ax - b there.
            goal: Shape (c,): measure at which a component is done.
            products: Shape (c,): those that went before.
        """
        stuck = np.zeros(len(goal), np.bool_)
        row_sums = np.add.reduceat(np.abs(part.matrix.data), part.matrix.indptr[:-1])  # each row has its diagonal
        step = 1.0 / np.maximum.reduceat(row_sums, part.begin)  # below 2 / norm, by Gershgorin
        state = ProportioningState(x, gradient, gradient, gradient, goal, goal, goal, step, products, stuck)
        state.split(part)
        state.direction = state.free
        return state

    def only(self, components: BoolArray, unknowns: BoolArray) -> ProportioningState:
        """What is left when other components are done."""
        return ProportioningState(
            self.x[unknowns],
            self.gradient[unknowns],
            self.free[unknowns],
            self.direction[unknowns],
            self.goal[components],
            self.free_norm[components],
            self.chopped_norm[components],
            self.step[components],
            self.products[components],
            self.stuck[components],
        )

    def measure(self, part: BoxPart) -> Float64Array:
        """Norm of the projected gradient of each component, or its largest entry over the reach."""
        if part.reach is None:
            return np.sqrt(self.free_norm + self.chopped_norm)
        projected = np.abs(self.free)
        released, pull = self._released(part)
        projected[released] = np.abs(pull)
        return np.maximum.reduceat(projected * part.reach, part.begin)

    def split(self, part: BoxPart) -> None:
        """Renews what follows from `x` and `gradient`."""
        self.free = self.gradient * ((self.x > 0) & (self.x < part.scale))
        self.free_norm = part.sum(self.free * self.free)
        released, pull = self._released(part)
        self.chopped_norm = scatter_add(part.component[released], pull * pull, len(self.goal))

    def advance(self, part: BoxPart, working: BoolArray, inside: BoolArray, most: int) -> None:
        """One step of every working component, in place: two products at most, whatever `most` is."""
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
        self.products += working
        curvature = part.sum(d * product)
        bends = curvature > 0
        curvature[~bends] = 1.0
        length = np.where(bends, part.sum(d * self.gradient) / curvature, 0.0)
        expands = self._move(part, d, product, length) & working & proportional
        if expands.any():
            uphill = self.gradient * ((self.x > 0) & (self.x < part.scale)) * part.spread(expands * self.step)
            projected = np.clip(self.x - uphill, 0.0, part.scale)
            self.gradient += part.matrix @ (projected - self.x)
            self.x = projected
            self.products += expands
        self.split(part)
        conjugate = np.where(working & proportional & ~expands, part.sum(self.free * product) / curvature, 0.0)
        self.direction = self.free - part.spread(conjugate) * d

    def _move(self, part: BoxPart, d: Float64Array, product: Float64Array, length: Float64Array) -> BoolArray:
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

    def _released(self, part: BoxPart) -> tuple[Int64Array, Float64Array]:
        """Unknowns at a bound that the energy pulls into the box, and their gradients."""
        at_bound = np.flatnonzero((self.x <= 0) | (self.x >= part.scale))
        pull = self.gradient[at_bound]
        into = np.where(self.x[at_bound] <= 0, pull < 0, pull > 0)
        return at_bound[into], pull[into]
