"""From sample values to vertex values: what the pipeline and the window call."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from bake.settings import BakeSettings, MappingKind
from bake.solve.ahead import MappingAhead
from bake.solve.averaged import average_to_vertices, refuse_unfinished, sample_rmse
from bake.solve.box_choice import box_solver, prepare
from bake.solve.direct import finished
from bake.solve.mass import FaceMoments, face_moments
from bake.solve.prior import SceneScatter
from bake.solve.starved import settle_starved
from bake.solve.surface import Surface, build_surface
from bake.solve.system import Equations, System, build_equations
from bake.types import (
    BoolArray,
    Float32Array,
    Float64Array,
    SampleSet,
    SolveReport,
    VertexField,
    VertexState,
    World,
)

logger = logging.getLogger(__name__)

TOLERANCE = 1e-11
"""Relative projected residual at which a component counts as solved.

It is a norm over a whole component, which may hide much in one place: at 1e-7 single values on real levels are off by
0.02, at 1e-11 by 5e-6, for half as many iterations again.
"""

ACCEPTABLE = 1e-4
"""Relative residual up to which a component that ran out of iterations is kept; beyond it falls back to the average."""

MOST_ITERATIONS = 200


@dataclass(frozen=True, slots=True)
class _Outcome:
    """Values at the unknowns and which of them the bounds hold back, shape (u, k), and how they were found."""

    values: Float64Array
    held: BoolArray
    iterations: int = 0
    residual: float = 0.0
    limited: int = 0
    averaged: int = 0


class VertexMapper:
    """Maps samples of one scene to its vertices, as often as values, validity or smoothing change.

    Welding, edges and butterflies are found once, on construction. What the samples add up to is kept as long as the
    array of values is the same one and validity is equal, so that a new alpha costs little more than the solve.

    Args:
        world: The flattened scene.
        samples: Where AO was estimated.
        settings: `weld_instances` and `crease_angle` decide the surface; `mapping` and `alpha` are defaults of `solve`.
        scene: The mean scatter of the whole scene, where `world` is a part of it.
        surface: Of the world with these settings, if it is there already.

    Attributes:
        surface: What all solves share.
        own_alpha: Shape (m,), float64: alpha of faces whose object has its own, NaN elsewhere.
    """

    def __init__(
        self,
        world: World,
        samples: SampleSet,
        settings: BakeSettings,
        *,
        scene: SceneScatter | None = None,
        surface: Surface | None = None,
    ) -> None:
        self._scene = scene
        self._world = world
        self._samples = samples
        self._settings = settings
        if settings.mapping is MappingKind.LEAST_SQUARES:
            prepare(world.vertex_count, settings.distance_count, settings.device)
        self.surface = surface or build_surface(
            world, crease_angle=settings.crease_angle, weld_instances=settings.weld_instances
        )
        own = [np.nan if keys.alpha is None else keys.alpha for keys in world.object_keys]
        self.own_alpha = np.array(own, np.float64)[self.surface.owner]
        self._kept: tuple[Float32Array, BoolArray, FaceMoments, Equations] | None = None

    def system(self, ao: Float32Array, valid: BoolArray, *, alpha: float | None = None) -> System:
        """The linear system behind `solve`, for those who explain its values.

        Args:
            ao: Shape (n, k), float32, in [0, 1].
            valid: Shape (n,), bool.
            alpha: Smoothing; the settings' if None. Objects with their own keep it.
        """
        return self._equations(ao, valid)[1].system(self._settings.alpha if alpha is None else alpha)

    def moments(self, ao: Float32Array, valid: BoolArray) -> FaceMoments:
        """Sums of the valid samples face by face; arguments as for `system`."""
        return self._equations(ao, valid)[0]

    def equations(self, ao: Float32Array, valid: BoolArray) -> Equations:
        """What the samples add up to, whatever alpha is; arguments as for `system`."""
        return self._equations(ao, valid)[1]

    def solve(
        self,
        ao: Float32Array,
        valid: BoolArray,
        *,
        alpha: float | None = None,
        mapping: MappingKind | None = None,
        start: Float32Array | None = None,
        on_progress: Callable[[str, float], None] | None = None,
    ) -> VertexField:
        """Values at the vertices.

        Args:
            ao: Shape (n, k), float32, in [0, 1]: AO of the samples.
            valid: Shape (n,), bool: samples to use.
            alpha: Smoothing; the settings' if None. Objects with their own keep it.
            mapping: Least squares or weighted average; the settings' if None.
            start: Shape (vertices, k), float32: a guess, such as the values before a small change; NaN where there is
                none. The weighted average if None.
            on_progress: Told the step and the share done, in [0, 1].

        Raises:
            SolveError: a value that should be used is not finite.
        """
        tell = on_progress or _silent
        refuse_unfinished(ao, valid)
        tell("assemble", 0.0)
        moments, equations = self._equations(ao, valid)
        if (mapping or self._settings.mapping) is MappingKind.AVERAGE:
            outcome = _Outcome(equations.average, np.zeros(equations.average.shape, np.bool_))
        else:
            guess = equations.average if start is None else self._at_unknowns(start, equations.average)
            outcome = self._least_squares(equations, self._settings.alpha if alpha is None else alpha, guess, tell)
        tell("done", 1.0)
        return self._field(outcome, equations.starved, moments)

    def _at_unknowns(self, start: Float32Array, average: Float64Array) -> Float64Array:
        """A guess at the vertices as one at the unknowns; the average where it says nothing, shape (u, k)."""
        guess = average.copy()
        told = np.flatnonzero((self.surface.unknown >= 0) & np.isfinite(start).all(axis=1))
        guess[self.surface.unknown[told]] = start[told]
        return guess

    def _least_squares(
        self, equations: Equations, alpha: float, guess: Float64Array, tell: Callable[[str, float], None]
    ) -> _Outcome:
        first = self.surface.first
        values = equations.average.copy()
        held = np.zeros(values.shape, np.bool_)
        if not len(values):
            return _Outcome(values, held)
        tell("solve", 0.3)
        system = equations.system(alpha)
        solver = box_solver(system.matrix, first, self._settings.device)
        columns = values.shape[1]
        iterations, residual = 0, 0.0
        failed = np.zeros(len(first) - 1, np.bool_)
        # NumPy and SciPy let go of the interpreter while they work: distances are solved side by side
        with ThreadPoolExecutor(min(columns, os.cpu_count() or 1), "solve") as pool:
            solutions = solver.solve_all(
                system.rhs, guess, tolerance=TOLERANCE, most_iterations=MOST_ITERATIONS, columns=pool.map
            )
            for k, found in enumerate(solutions):
                solution = finished(solver, system.rhs[:, k], found)
                values[:, k], held[:, k] = solution.x, solution.held
                iterations = max(iterations, solution.iterations)
                bad = ~solution.converged & ~(solution.residual <= ACCEPTABLE)
                residual = max(residual, float(np.where(bad, 0.0, solution.residual).max(initial=0.0)))
                failed |= bad
                tell("solve", 0.3 + 0.7 * (k + 1) / columns)
        back = np.repeat(failed, np.diff(first))
        if back.any():
            logger.warning("%d components did not converge and keep their average", int(failed.sum()))
            values[back], held[back] = system.average[back], False
        settle_starved(
            equations,
            alpha,
            values,
            held,
            but=back,
            tolerance=TOLERANCE,
            most_iterations=MOST_ITERATIONS,
            device=self._settings.device,
        )
        limited = equations.limited if alpha > 0.0 else 0
        return _Outcome(values, held, iterations, residual, limited, int(np.count_nonzero(back)))

    def _field(self, outcome: _Outcome, starved: BoolArray, moments: FaceMoments) -> VertexField:
        values = outcome.values
        surface = self.surface
        baked = surface.unknown >= 0
        own = surface.unknown[baked]
        ao = np.full((len(surface.unknown), values.shape[1]), np.nan, np.float32)
        ao[baked] = values[own]
        state = np.full(len(ao), VertexState.NOT_BAKED, np.uint8)
        state[~surface.referenced] = VertexState.UNREFERENCED
        state[baked] = np.where(starved[own], VertexState.FILLED, VertexState.BAKED)
        report = SolveReport(
            unknowns=surface.unknown_count,
            components=len(surface.first) - 1,
            iterations=outcome.iterations,
            residual=outcome.residual,
            limited_edges=outcome.limited,
            bounded=tuple(int(n) for n in outcome.held[own].sum(axis=0)),
            rmse=sample_rmse(surface.corners, values, moments),
            averaged=outcome.averaged,
        )
        return VertexField(ao, state, report)

    def _equations(self, ao: Float32Array, valid: BoolArray) -> tuple[FaceMoments, Equations]:
        kept = self._kept
        if kept is not None and kept[0] is ao and np.array_equal(kept[1], valid):
            return kept[2], kept[3]
        moments = face_moments(self.surface, self._samples, ao, valid)
        equations = build_equations(self.surface, moments, self.own_alpha, self._scene)
        self._kept = (ao, valid.copy(), moments, equations)
        return moments, equations


def _silent(step: str, share: float) -> None:
    """Tells nobody."""


def map_to_vertices(
    world: World,
    samples: SampleSet,
    ao: Float32Array,
    valid: BoolArray,
    settings: BakeSettings,
    *,
    ahead: MappingAhead | None = None,
    on_progress: Callable[[str, float], None] | None = None,
) -> VertexField:
    """Maps samples to vertices once; see `VertexMapper` for repeated solves.

    Args:
        world: The flattened scene.
        samples: Where AO was estimated.
        ao: Shape (n, k), float32, in [0, 1].
        valid: Shape (n,), bool: samples to use.
        settings: Mapping, alpha, welding.
        ahead: What `map_ahead` made of the same world and settings, if it did.
        on_progress: Told the step and the share done, in [0, 1].

    Raises:
        SolveError: a value that should be used is not finite.
    """
    if on_progress is not None:
        on_progress("weld", 0.0)
    if settings.mapping is MappingKind.AVERAGE:
        return average_to_vertices(world, samples, ao, valid, settings, ahead.receivers if ahead else None)
    mapper = VertexMapper(world, samples, settings, surface=ahead.surface if ahead else None)
    return mapper.solve(ao, valid, on_progress=on_progress)
