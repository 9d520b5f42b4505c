"""Conjugate gradients under bounds, one face of the box after another.

A face fixes the values that sit at a bound and are pulled outwards. On it conjugate gradients run as if there were no
bounds, out of the box too, until the gradient has fallen to `DROP` of what it was. Then all values outside are put on
their bounds at once, and the next face begins there: values may come to a bound or leave it by the hundred, where a
method that never leaves the box stops at the first of them. A handful of faces is enough on real levels, and the last
is solved to the end without a break.

That it converges: the first step on a face goes down the whole projected gradient, so the energy that the conjugate
gradients promise to save is at least in proportion to its square. A projection that keeps at least `SUFFICIENT` of the
promise therefore drives the projected gradient to zero. One that keeps less is taken back, and the component is left
to `bake.solve.proportioning`: on real levels some dozens of the smallest ones, of four to sixteen values.

Reference: the alternation is that of Moré and Toraldo 1991, "On the solution of large quadratic programming problems
with bound constraints" (SIAM Journal on Optimization 1(1)), with a projection of the whole step in place of their
searches along it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.solve.box_part import BoxPart
from bake.solve.scatter import scatter_add
from bake.types import BoolArray, Float64Array, Int64Array

DROP = 0.2
"""A face is left for the box at this share of the gradient it began with: between 0.1 and 0.4 all do as well."""

SETTLED = 0.5
"""A face is left for the box at this share of the goal, too."""

SUFFICIENT = 0.01
"""Least share of the energy promised on a face that its projection into the box must save."""


@dataclass(slots=True)
class FaceState:
    """Where the iteration stands; vectors are in scaled unknowns, norms are squared and per component."""

    x: Float64Array
    gradient: Float64Array
    face: BoolArray  # values that move: those not at a bound and pulled outwards when the face began
    direction: Float64Array
    x_before: Float64Array  # when the face began
    gradient_before: Float64Array
    goal: Float64Array
    norm: Float64Array  # of the gradient on the face
    norm_before: Float64Array
    promised: Float64Array  # energy saved since then if there were no bounds
    measured: Float64Array  # what is held against the goal; infinite outside the box
    products: Int64Array
    stuck: BoolArray

    @staticmethod
    def begin(part: BoxPart, b: Float64Array, x: Float64Array, goal: Float64Array) -> FaceState:
        """At some values within the box.

        Args:
            part: What is solved.
            b, x: Shape (n,): scaled right-hand side and values.
            goal: Shape (c,): measure at which a component is done.
        """
        gradient = part.matrix @ x - b
        face = _face(part, x, gradient)
        direction = gradient * face
        norm = part.sum(direction * direction)
        state = FaceState(
            x, gradient, face, direction, x.copy(), gradient.copy(), goal, norm, norm.copy(), np.zeros(len(goal)),
            norm, np.ones(len(goal), np.int64), np.zeros(len(goal), np.bool_),
        )  # fmt: skip
        state.measured = state.measure_of(part, direction, norm)
        return state

    def only(self, components: BoolArray, unknowns: BoolArray) -> FaceState:
        """What is left when other components are done."""
        return FaceState(
            self.x[unknowns],
            self.gradient[unknowns],
            self.face[unknowns],
            self.direction[unknowns],
            self.x_before[unknowns],
            self.gradient_before[unknowns],
            self.goal[components],
            self.norm[components],
            self.norm_before[components],
            self.promised[components],
            self.measured[components],
            self.products[components],
            self.stuck[components],
        )

    def measure(self, part: BoxPart) -> Float64Array:
        """Norm of the projected gradient of each component, or its largest entry over the reach; infinite outside."""
        return self.measured

    def measure_of(self, part: BoxPart, projected: Float64Array, norm: Float64Array) -> Float64Array:
        """What is held against the goal for some gradient with the squared norm `norm`."""
        if part.reach is None:
            return np.sqrt(norm)
        return np.maximum.reduceat(np.abs(projected) * part.reach, part.begin)

    def advance(self, part: BoxPart, working: BoolArray, inside: BoolArray, most: int) -> None:
        """One step of every working component, in place: a product, and a second where a face ends outside the box."""
        still = not working.all()
        d = self.direction * inside if still else self.direction
        product = part.matrix @ d
        self.products += working
        curvature = part.sum(d * product)
        bends = curvature > 0
        length = np.where(bends, self.norm / np.where(bends, curvature, 1.0), 0.0)
        if still:
            length[~working] = 0.0
        spread = part.spread(length)
        self.x -= spread * d
        self.gradient -= spread * product
        self.promised += 0.5 * length * self.norm
        on_face = self.gradient * self.face
        norm = part.sum(on_face * on_face)
        left = np.flatnonzero((self.x < 0) | (self.x > part.scale))
        outside = np.zeros(len(working), np.bool_)
        outside[part.component[left]] = True
        pulled, pulls = self._pulled(part)
        pull = scatter_add(part.component[pulled], pulls * pulls, len(norm))

        reached = self.measure_of(part, on_face, norm) <= SETTLED * self.goal
        spent = self.products + 2 > most
        ends = outside & ((norm <= DROP * DROP * self.norm_before) | reached | spent)
        ends |= ~outside & (pull > norm)
        ends &= working
        if len(pulled):
            projected = on_face.copy()
            projected[pulled] = pulls
            measured = self.measure_of(part, projected, norm + pull)
        else:
            measured = self.measure_of(part, on_face, norm)
        self.measured = np.where(working, np.where(outside, np.inf, measured), self.measured)
        conjugate = np.where(working & ~ends & (self.norm > 0), norm / np.where(self.norm > 0, self.norm, 1.0), 0.0)
        self.direction = on_face + part.spread(conjugate) * d
        self.norm = norm
        if ends.any():
            self._turn(part, ends, outside & ends)

    def _turn(self, part: BoxPart, ends: BoolArray, projects: BoolArray) -> None:
        """Puts values on their bounds where a face ended outside, and begins new faces."""
        here = np.flatnonzero(part.spread(ends))
        if projects.any():
            step = np.zeros(len(self.x))
            step[here] = np.clip(self.x[here], 0.0, part.scale[here]) - self.x[here]
            self.gradient += part.matrix @ step
            self.x += step
            self.x[here] = np.clip(self.x[here], 0.0, part.scale[here])
            self.products += projects
            slope = (self.gradient[here] + self.gradient_before[here]) * (self.x_before[here] - self.x[here])
            saved = 0.5 * scatter_add(part.component[here], slope, len(ends))
            stuck = projects & ~(saved >= SUFFICIENT * self.promised)
            if stuck.any():
                back = part.spread(stuck)
                self.x[back], self.gradient[back] = self.x_before[back], self.gradient_before[back]
                self.stuck |= stuck
        x, gradient = self.x[here], self.gradient[here]
        face = ~(((x <= 0) & (gradient >= 0)) | ((x >= part.scale[here]) & (gradient <= 0)))
        self.face[here] = face
        self.direction[here] = gradient * face
        self.x_before[here], self.gradient_before[here] = x, gradient
        norm = scatter_add(part.component[here], self.direction[here] ** 2, len(ends))
        self.norm = np.where(ends, norm, self.norm)
        self.norm_before = np.where(ends, norm, self.norm_before)
        self.promised[ends] = 0.0
        on_faces = self.direction * part.spread(ends) if part.reach is not None else self.direction
        self.measured = np.where(ends, self.measure_of(part, on_faces, norm), self.measured)

    def _pulled(self, part: BoxPart) -> tuple[Int64Array, Float64Array]:
        """Values held by the face that are pulled into the box by now, and their gradients."""
        held = np.flatnonzero(~self.face)
        pull = self.gradient[held]
        into = np.where(self.x[held] <= 0, pull < 0, pull > 0)
        return held[into], pull[into]


def _face(part: BoxPart, x: Float64Array, gradient: Float64Array) -> BoolArray:
    """Values that are not at a bound and pulled outwards."""
    return ~(((x <= 0) & (gradient >= 0)) | ((x >= part.scale) & (gradient <= 0)))
