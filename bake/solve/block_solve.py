"""The values of a block whose equations changed: as few of them as the tolerance allows.

At the values x of before, every row of the changed equations A x = b is missed by a gradient g = A x - b. As A is at
least the mass matrix and the prior, with lumped masses m and weights p, a value is at most about |g| / (m / `AMPLIFIED`
+ p) away from where it belongs, wherever meshes are not extreme, and |g| / p where samples are too few. Only values
that miss more than the tolerance allows are solved for, with a few rings around them and everything beyond held where
it is. That moves the rows just outside; where they then miss too much, the next patch lies there. What is left is known
for every row and kept: small changes that are passed over add up in the gradient until they count.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from bake.settings import BakeSettings, MappingKind
from bake.solve.block import Block, entries_of
from bake.solve.box_choice import box_solver
from bake.solve.conjugate_gradient import HELD, BoxSolution, BoxSolver, Columns
from bake.solve.direct import finished
from bake.solve.mass import FaceMoments, square_error
from bake.solve.starved import rows_of, settle_starved
from bake.solve.system import Equations
from bake.types import BoolArray, Float64Array, Int64Array

AMPLIFIED = 8.0
"""How much farther from its place a value may be than its row's mass alone tells. On a regular mesh it is 4, as the
smallest eigenvalue of its mass matrix is a quarter of the lumped mass; on real levels up to 8 was seen."""

RINGS = 6
"""Rings of faces around values that miss too much."""

MOST_PATCHES = 12
"""After so many patches one after another the block is solved whole."""

WORTHWHILE = 0.3
"""Share of the unknowns beyond which the block is solved whole."""

EASED = 0.3
"""How much closer than asked for a patch is solved, so that its own rows need no second one."""

WHOLE_TOLERANCE = 1e-11
ACCEPTABLE = 1e-4
MOST_ITERATIONS = 200


@dataclass(frozen=True, slots=True)
class Solved:
    """A block with its new values.

    Attributes:
        block: It.
        iterations: Most that any solve took.
        residual: Largest relative residual of components solved whole.
        unknowns: How many were solved for.
        missed: Estimate of how far any value is from its place, in AO.
    """

    block: Block
    iterations: int = 0
    residual: float = 0.0
    unknowns: int = 0
    missed: float = 0.0


def solve_block(
    block: Block,
    equations: Equations,
    moments: FaceMoments,
    zone: Int64Array,
    faces: Int64Array,
    *,
    alpha: float,
    mapping: MappingKind,
    tolerance: float,
    columns: Columns,
    device: str,
) -> Solved:
    """Solves what has to be.

    Args:
        block: As it was: its values belong to its own equations.
        equations, moments: As they are now.
        zone: Shape (z,), int64: unknowns whose rows differ otherwise than in the pull to the average.
        faces: Shape (f,), int64: faces whose sums differ.
        alpha, mapping: As before.
        tolerance: In AO; 0 for a whole solve to the end.
        columns: How distances are gone through.
        device: Where to, as the settings name it.
    """
    after = replace(block, equations=equations, moments=moments, tolerance=tolerance)
    if mapping is MappingKind.AVERAGE or tolerance <= 0.0 or len(zone) > WORTHWHILE * len(block.values):
        return solve_whole(after, alpha, mapping, tolerance, columns, device)
    pull = equations.pull(alpha)
    gradient = _gradient(block, equations, zone, alpha, pull)
    weight = _weight(equations, alpha, pull)
    after = replace(after, pull=pull, gradient=gradient)
    ignored = np.repeat(block.failed, np.diff(block.surface.first)) if block.failed.any() else None
    if ignored is not None and ignored[zone].any():
        return solve_whole(after, alpha, mapping, tolerance, columns, device)
    x, held = block.values, block.held
    touched = np.zeros(len(x), np.bool_)
    iterations = 0
    for _ in range(MOST_PATCHES):
        miss = AMPLIFIED * _miss(gradient, x) / weight
        if ignored is not None:
            miss[ignored] = 0.0
        seeds = np.flatnonzero(miss > tolerance)
        if not len(seeds):
            if len(faces) or iterations:
                error = _moved_error(block, moments, x, touched, faces)
                after = replace(after, values=x, held=held, held_vertices=_vertices(block, held), square_error=error)
            return Solved(after, iterations, 0.0, int(np.count_nonzero(touched)), float(miss.max(initial=0.0)))
        members = block.rings(seeds, RINGS)
        if np.count_nonzero(members) > WORTHWHILE * len(x):
            break
        if x is block.values:
            x, held = x.copy(), held.copy()
        touched |= members
        within = EASED * tolerance / AMPLIFIED * weight
        patch = np.flatnonzero(members)
        iterations = max(iterations, _patch(patch, equations, alpha, x, gradient, held, within, columns))
    return solve_whole(replace(after, values=x), alpha, mapping, tolerance, columns, device)


def _miss(gradient: Float64Array, x: Float64Array) -> Float64Array:
    """Magnitude of the part of the gradient that the bounds let count, the largest over the distances, shape (u,)."""
    largest = np.zeros(len(x))
    for k in range(x.shape[1]):
        part = np.where(x[:, k] <= 0.0, np.minimum(gradient[:, k], 0.0), gradient[:, k])
        np.maximum(part, 0.0, out=part, where=x[:, k] >= 1.0)
        np.maximum(largest, np.abs(part), out=largest)
    return largest


def _weight(equations: Equations, alpha: float, pull: Float64Array) -> Float64Array:
    """What a row's gradient is measured by, shape (u,), m²: `AMPLIFIED` times what surely holds the value in its place.

    That is the prior, and a share of the mass where the faces have samples enough to fix three corners. With fewer, and
    without smoothing, the prior is all there is, a fiftieth of the mass.
    """
    weight = equations.mass * np.clip(equations.trust.count - 3.0, 0.0, 1.0) + AMPLIFIED * pull
    starved = np.flatnonzero(equations.starved)
    if len(starved):
        weight[starved] += 0.1 * equations.main_diagonal(alpha)[starved]
    return weight


def _vertices(block: Block, held: BoolArray) -> Int64Array:
    """Vertices of the world whose value is held, per distance."""
    counts = np.zeros(held.shape[1], np.int64)
    if held.any():
        unknown = block.surface.unknown
        for k in range(len(counts)):
            counts[k] = np.count_nonzero(held[:, k][unknown] & (unknown >= 0))
    return counts


def _gradient(block: Block, equations: Equations, zone: Int64Array, alpha: float, pull: Float64Array) -> Float64Array:
    """The gradient of the block's values under other equations, shape (u, k), m²."""
    old, average, x = block.pull, block.equations.average, block.values
    if equations.average is average:
        gradient = block.gradient + (pull - old)[:, None] * (x - average)
    else:
        gradient = block.gradient + (pull - old)[:, None] * x
        gradient -= pull[:, None] * equations.average - old[:, None] * average
    if len(zone):
        start, column, entry = rows_of(equations, alpha, zone)
        rows = csr_array((entry, column, start), shape=(len(zone), len(x)))
        gradient[zone] = rows @ x - (equations.data[zone] + pull[zone, None] * equations.average[zone])
    return gradient


def _patch(
    members: Int64Array,
    equations: Equations,
    alpha: float,
    x: Float64Array,
    gradient: Float64Array,
    held: BoolArray,
    within: Float64Array,
    columns: Columns,
) -> int:
    """Solves for some values, the others held, in place; returns the iterations."""
    start, column, entry = rows_of(equations, alpha, members)
    slot = np.full(len(x), -1, np.int64)
    slot[members] = np.arange(len(members))
    inner = slot[column]
    row = np.repeat(np.arange(len(members)), np.diff(start))
    inside = inner >= 0
    size = len(members)
    begin = np.concatenate([[0], np.cumsum(np.bincount(row[inside], minlength=size))]).astype(np.int64)
    square = csr_array((entry[inside], inner[inside], begin), shape=(size, size))
    pieces, label = connected_components(square, directed=False)
    order = np.arange(size)
    if pieces > 1:
        order = np.argsort(label, kind="stable")
        turned = np.empty(size, np.int64)
        turned[order] = np.arange(size)
        places = entries_of(begin, order)
        begin = np.concatenate([[0], np.cumsum(np.diff(begin)[order])]).astype(np.int64)
        square = csr_array((square.data[places], turned[square.indices[places]], begin), shape=(size, size))
    first = np.concatenate([[0], np.cumsum(np.bincount(label, minlength=pieces))]).astype(np.int64)
    diagonal = np.asarray(square.diagonal(), np.float64)
    own = members[order]
    before = x[own]
    # what the rows ask for, given all beyond the patch: b - A_out x_out = A_in x_in - g
    rhs = square @ before - gradient[own]
    solver = BoxSolver(square, first)

    def solve(k: int) -> BoxSolution:
        found = solver.solve(rhs[:, k], before[:, k], within=within[own], most_iterations=MOST_ITERATIONS)
        return finished(solver, rhs[:, k], found)

    iterations = 0
    for k, solution in enumerate(columns(solve, range(x.shape[1]))):
        x[own, k], held[own, k] = solution.x, solution.held
        gradient[own, k] = solution.gradient * diagonal
        iterations = max(iterations, solution.iterations)
    outside = np.flatnonzero(~inside)
    at = column[outside]
    step = np.empty(before.shape)
    step[order] = x[own] - before
    change = step[row[outside]] * entry[outside, None]
    reached, back = np.unique(at, return_inverse=True)
    for k in range(x.shape[1]):
        gradient[reached, k] += np.bincount(back, change[:, k], minlength=len(reached))
    return iterations


def solve_whole(
    block: Block, alpha: float, mapping: MappingKind, tolerance: float, columns: Columns, device: str
) -> Solved:
    """Solves for all values of a block, from those it has; arguments as for `solve_block`."""
    first = block.surface.first
    x, held = block.values.copy(), block.held.copy()
    if mapping is MappingKind.AVERAGE:
        return Solved(
            _finished(block, block.equations.average, np.zeros(x.shape), held & False, None, 0.0, np.zeros(len(x)))
        )
    system = block.equations.system(alpha)
    diagonal = system.matrix.diagonal()
    solver = box_solver(system.matrix, first, device)
    pull = block.equations.pull(alpha)
    weight = _weight(block.equations, alpha, pull)
    within = EASED * tolerance / AMPLIFIED * weight if tolerance > 0.0 else None

    gradient = np.empty(x.shape)
    failed = np.zeros(len(first) - 1, np.bool_)
    iterations, residual = 0, 0.0
    values = x.copy()
    solutions = solver.solve_all(
        system.rhs, x, tolerance=WHOLE_TOLERANCE, within=within, most_iterations=MOST_ITERATIONS, columns=columns
    )
    for k, found in enumerate(solutions):
        solution = finished(solver, system.rhs[:, k], found)
        values[:, k], held[:, k] = solution.x, solution.held
        gradient[:, k] = solution.gradient * diagonal
        iterations = max(iterations, solution.iterations)
        bad = ~solution.converged & ~(solution.residual <= (ACCEPTABLE if within is None else 1e3))
        failed |= bad
        if within is None:
            residual = max(residual, float(np.where(bad, 0.0, solution.residual).max(initial=0.0)))
    back = np.repeat(failed, np.diff(first))
    values[back], held[back], gradient[back] = system.average[back], False, 0.0
    if within is None:
        settle_starved(
            block.equations,
            alpha,
            values,
            held,
            gradient,
            but=back,
            tolerance=WHOLE_TOLERANCE,
            most_iterations=MOST_ITERATIONS,
            device=device,
        )
    done = _finished(block, values, gradient, held, failed, tolerance, pull)
    if within is None:
        return Solved(done, iterations, residual, len(x))
    miss = AMPLIFIED * _miss(gradient, values) / weight
    return Solved(done, iterations, residual, len(x), float(miss[~back].max(initial=0.0)))


def begin_values(block: Block, values: Float64Array, settings: BakeSettings, *, averaged: bool) -> Block:
    """A block with values that were solved for elsewhere.

    Args:
        block: With its equations.
        values: Shape (u, k), float64.
        settings: What they were solved for.
        averaged: Whether some components may not have converged and keep their average.
    """
    if settings.mapping is MappingKind.AVERAGE:
        return solve_whole(block, settings.alpha, settings.mapping, 0.0, map, settings.device).block
    first = block.surface.first
    system = block.equations.system(settings.alpha)
    gradient = system.matrix @ values - system.rhs
    failed = np.zeros(len(first) - 1, np.bool_)
    if averaged:
        apart = np.maximum.reduceat(np.abs(values - system.average).max(axis=1), first[:-1])
        failed = (apart < 1e-6) & (np.diff(first) > 1)
        gradient[np.repeat(failed, np.diff(first))] = 0.0
    wants_out = gradient / system.matrix.diagonal()[:, None]
    held = ((values <= 0.0) & (wants_out > HELD)) | ((values >= 1.0) & (wants_out < -HELD))
    return _finished(block, values, gradient, held, failed, 0.0, block.equations.pull(settings.alpha))


def _finished(
    block: Block,
    values: Float64Array,
    gradient: Float64Array,
    held: BoolArray,
    failed: BoolArray | None,
    tolerance: float,
    pull: Float64Array,
) -> Block:
    return replace(
        block,
        values=values,
        gradient=gradient,
        held=held,
        held_vertices=_vertices(block, held),
        pull=pull,
        failed=np.zeros(len(block.failed), np.bool_) if failed is None else failed,
        square_error=square_error(block.surface.corners, values, block.moments),
        tolerance=tolerance,
    )


def _moved_error(
    block: Block, moments: FaceMoments, x: Float64Array, touched: BoolArray, faces: Int64Array
) -> Float64Array:
    """The squares of the differences, of which only those on faces that changed are summed anew."""
    corners = block.surface.corners
    seen = np.zeros(len(corners), np.bool_)
    seen[faces] = True
    seen[block.faces_of(np.flatnonzero(touched))] = True
    rows = np.flatnonzero(seen)
    if not len(rows):
        return block.square_error
    before = square_error(corners[rows], block.values, block.moments.only(rows))
    return block.square_error - before + square_error(corners[rows], x, moments.only(rows))
