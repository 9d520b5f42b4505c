"""Explains spots of one result: loads what that takes once, then answers in milliseconds."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Generator
from types import TracebackType
from typing import Self

import numpy as np

from bake.errors import SettingsError
from bake.explain.adjoint import Adjoint, Weights
from bake.explain.counterfactual import surface_without
from bake.explain.local_solve import LocalSolver
from bake.explain.retrace import trace_again, tracer_like
from bake.explain.shares import carried_from, roll_up
from bake.explain.spot import face_spot, nearest_spot, vertex_spot
from bake.explain.types import Explanation, Held, Spot, SpotWithout, SurfaceWithout, WeighedSamples
from bake.explain.without import Without
from bake.geometry import as_traced, face_normals, shading_normals
from bake.setting_fields import option_name
from bake.settings import BakeSettings
from bake.solve import VertexMapper
from bake.solve.prior import SceneScatter
from bake.stages import drained
from bake.trace import Tracer
from bake.types import BakeResult, BoolArray, Float64Array, Int64Array, Progress, VertexField

UNTRACED = 2e-4
"""Samples are traced again until those that are not weigh less than this together."""

MOST_TRACED = 8192
"""And at most so many, the heaviest first."""

FEW = 0.005
"""Share of the scene's faces that an object may change without changing what is known of the scene's noise."""

MOST_HELD = 32
"""Held vertices that an explanation lists."""


class Explainer:
    """Explains values of one bake; close it, or use it in a `with` statement.

    Args:
        result: A bake.
        settings: Other settings of the mapping (those that affect "solve") to explain the values under; the result's
            own if None.

    Raises:
        SettingsError: the settings ask for other rays than those of the bake.

    Attributes:
        result, settings: As given.
        field: The values that are explained.
    """

    def __init__(self, result: BakeResult, settings: BakeSettings | None = None) -> None:
        self.result = result
        self.settings = result.settings if settings is None else settings
        if changed := _differing(result.settings, self.settings, "trace"):
            raise SettingsError(
                "the stored samples were traced with another value",
                where=f"--{changed[0]}",
                remedy="bake again, or explain with the result's own settings",
            )
        self.valid: BoolArray = result.tally.valid(self.settings.back_face_threshold)
        self.mapper = VertexMapper(result.world, result.samples, self.settings)
        self.field: VertexField = result.field
        if _differing(result.settings, self.settings, "solve"):
            self.field = self.mapper.solve(result.tally.ao, self.valid)
        self.adjoint = Adjoint(self.mapper, result.samples, result.tally.ao, self.valid, self.field, self.settings)
        self._tracer: Tracer | None = None
        self._solver: LocalSolver | None = None
        self._scatter: dict[int, SceneScatter] = {}  # of the scene without an object, once that is known
        self._seen_by: dict[int, float] = {}  # share of the scene's faces that an object changes

    @property
    def solver(self) -> LocalSolver:
        """What solves for the surroundings of a spot again, made when it is first needed."""
        if self._solver is None:
            result = self.result
            self._solver = LocalSolver(self.mapper, result.samples, result.tally, self.adjoint, self.settings)
        return self._solver

    @property
    def tracer(self) -> Tracer:
        """The bake's tracer, made when it is first needed."""
        if self._tracer is None:
            self._tracer = tracer_like(self.result)
        return self._tracer

    def explain_vertex(self, vertex: int) -> Explanation:
        """Why a vertex has its value.

        Args:
            vertex: Index into `World.positions`.

        Raises:
            InputError: it has no value of its own.
        """
        return self.explain(vertex_spot(self.result, vertex))

    def explain_point(self, point: Float64Array) -> Explanation:
        """Why the surface has its value where it is nearest to a point, shape (3,), relative to `World.origin`.

        Raises:
            InputError: the point is not finite, or nothing has values.
        """
        return self.explain(nearest_spot(self.result.world, np.asarray(point, np.float64)))

    def explain_face(self, face: int, weights: Float64Array) -> Explanation:
        """Why a point of a face has its value; `weights`, shape (3,), are barycentric.

        Raises:
            InputError: no such face, or its object has no values per vertex.
        """
        return self.explain(face_spot(self.result.world, face, np.asarray(weights, np.float64)))

    def explain(self, spot: Spot) -> Explanation:
        """Why a spot has its value.

        Raises:
            DeviceError: nothing here can trace.
        """
        begin = time.perf_counter()
        unknowns, shares = self._unknowns(spot)
        weights = self.adjoint.weights(unknowns, shares)
        samples = self._weighed(spot, unknowns, weights)
        again = samples.index[: samples.traced]
        rays = trace_again(self.tracer, self.result.samples, again, self.result.tally.rays[again])
        value: Float64Array = shares @ self.adjoint.values[unknowns]
        traced_ao = rays.open_share.mean(axis=1, dtype=np.float64)
        apart = np.abs(traced_ao - samples.ao[: samples.traced])
        return Explanation(
            spot=spot,
            distances=self.settings.column_distances,
            value=value,
            mapping=self.settings.mapping,
            filled=bool(self.adjoint.starved[unknowns].any()),
            samples=samples,
            rays=rays,
            shares=roll_up(self.result.world, spot, value, samples, rays, weights.effect.sum(axis=0)),
            carried=carried_from(samples),
            held=self._held(weights),
            unbounded=weights.weight @ self.result.tally.ao[weights.sample].astype(np.float64) + weights.constant,
            weight_sum=float(weights.weight.sum()) + weights.constant,
            cut_off=weights.cut_off,
            retrace_error=float(apart.max(initial=0.0)),
            seconds=time.perf_counter() - begin,
        )

    def spot_without(self, spot: Spot, wanted: int) -> SpotWithout:
        """The value of a spot if an object did not cast.

        Args:
            spot: As in `Explanation.spot`.
            wanted: Index into `World.object_paths`; it goes on receiving.

        Raises:
            InputError: no such object.
        """
        begin = time.perf_counter()
        scene = Without(self.result, self.tracer, wanted)
        unknowns, shares = self._unknowns(spot)
        before: Float64Array = shares @ self.adjoint.values[unknowns]
        if not scene.casts:
            return SpotWithout(wanted, before, before, 0, 0, 0, is_estimate=False, seconds=time.perf_counter() - begin)
        scatter = self._scatter.get(wanted)
        found = self.solver.value(unknowns, shares, scene.tally, scatter)
        if scatter is None and wanted not in self._seen_by:
            self._seen_by[wanted] = self.solver.survey(scene.tally)
        threshold = self.settings.back_face_threshold
        now, then = found.tally.valid(threshold), self.valid[found.rows]
        return SpotWithout(
            object=wanted,
            before=before,
            after=found.value,
            samples=int((found.tally.ao != self.result.tally.ao[found.rows]).any(axis=1).sum()),
            became_valid=int((now & ~then).sum()),
            became_invalid=int((then & ~now).sum()),
            is_estimate=not found.complete or (scatter is None and self._seen_by[wanted] > FEW),
            seconds=time.perf_counter() - begin,
        )

    def without_object(self, wanted: int) -> SurfaceWithout:
        """All values if an object did not cast; seconds on a large level.

        Raises:
            InputError: no such object.
        """
        return drained(self.without_steps(wanted))

    def without_steps(self, wanted: int) -> Generator[Progress, None, SurfaceWithout]:
        """The same step by step; close the generator to cancel."""
        scene = Without(self.result, self.tracer, wanted)
        found, scatter = yield from surface_without(self.result, self.field, scene, wanted, self.mapper, self.settings)
        if scatter is not None:
            self._scatter[wanted] = scatter
        return found

    def close(self) -> None:
        """Frees the tracer."""
        if self._tracer is not None:
            self._tracer.close()
            self._tracer = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _unknowns(self, spot: Spot) -> tuple[Int64Array, Float64Array]:
        """The unknowns behind a spot, distinct, and what each counts for."""
        unknown, at = np.unique(self.adjoint.surface.unknown[spot.vertices], return_inverse=True)
        return unknown, np.bincount(at, spot.weights, minlength=len(unknown)).astype(np.float64)

    def _weighed(self, spot: Spot, unknowns: Int64Array, weights: Weights) -> WeighedSamples:
        heavy = np.argsort(-np.abs(weights.weight), kind="stable")
        index, weight = weights.sample[heavy], weights.weight[heavy]
        behind = np.cumsum(np.abs(weight)[::-1])[::-1]  # weight of a sample and all lighter ones
        traced = min(int(np.count_nonzero(behind > UNTRACED)), MOST_TRACED)

        world, samples = self.result.world, self.result.samples
        face = samples.face[index]
        two = samples.barycentric[index].astype(np.float64)
        barycentric = np.column_stack([two, 1.0 - two.sum(axis=1)])
        corner = as_traced(world.positions[world.faces[face]]).astype(np.float64)
        position = np.einsum("ij,ijk->ik", barycentric, corner)
        normals = face_normals(corner.reshape(-1, 3), np.arange(3 * len(face)).reshape(-1, 3))[0]
        if spot.is_vertex:
            own = np.asarray(
                np.isin(self.adjoint.surface.corners[self.adjoint.surface.row[face]], unknowns).any(axis=1)
            )
        else:
            own = face == spot.face
        return WeighedSamples(
            index=index,
            weight=weight,
            ao=self.result.tally.ao[index],
            position=position,
            normal=shading_normals(world.normals[world.faces[face]], barycentric, normals),
            face=face,
            object=world.face_object[face],
            distance=np.linalg.norm(position - spot.position, axis=1),
            own=own,
            traced=traced,
        )

    def _held(self, weights: Weights) -> tuple[Held, ...]:
        strongest = np.argsort(-np.abs(weights.effect).max(axis=1), kind="stable")[:MOST_HELD]
        found: list[Held] = []
        for row in strongest:
            unknown, effect = weights.held[row], weights.effect[row]
            bound = np.where(effect != 0.0, np.round(self.adjoint.values[unknown]), np.nan)
            found.append(Held(int(self.adjoint.vertex[unknown]), bound, effect))
        return tuple(found)


def _differing(baked: BakeSettings, wanted: BakeSettings, stage: str) -> list[str]:
    """Long options of the settings that affect a stage and differ."""
    return [
        option_name(item.name)
        for item in dataclasses.fields(BakeSettings)
        if item.metadata["affects"] == stage
        and item.name != "quality"
        and getattr(baked, item.name) != getattr(wanted, item.name)
    ]
