"""The fit around one spot again, for other samples: the same equations, assembled for a patch of the surface.

The patch holds every vertex whose samples the spot depends on; vertices outside keep their values, and how much the
spot would follow them is known from the patch's own matrix, so the patch grows until that is next to nothing.

One thing about a value is not local: how noisy the samples of the whole scene are, which is pooled with what is seen
around a vertex (`bake/solve/prior.py`). Unless it is given, it is taken as unchanged; a survey of some faces all over
the scene tells whether that is so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from bake.explain.adjoint import Adjoint
from bake.explain.greens import Greens
from bake.settings import BakeSettings, MappingKind
from bake.solve.conjugate_gradient import BoxSolver
from bake.solve.mapper import VertexMapper
from bake.solve.mass import at_corners, face_moments, right_hand_side
from bake.solve.part import SurfacePart, part_of
from bake.solve.prior import SceneScatter, scene_scatter
from bake.solve.system import Equations, build_equations
from bake.types import BoolArray, Float32Array, Float64Array, Int64Array, SampleSet, Tally

LEAK = 1e-4
"""Bound on what the value may follow the vertices outside the patch, in AO for a change of 1 there."""

SMALLEST_RINGS = 3
MORE_RINGS = 4
LARGEST = 60_000
"""Unknowns beyond which a patch is not grown."""

SURVEYED = 1000
"""Faces all over the scene whose samples tell whether it changes as a whole."""

NEAREST_TRIED = 64
"""Vertices in space that a component without samples may take its average from, where the nearest lost theirs too."""

Retrace = Callable[[Int64Array], Tally]
"""Tallies of the samples at some rows, as they are to be."""


@dataclass(frozen=True, slots=True)
class LocalValue:
    """A spot's value under other samples.

    Attributes:
        value: Shape (k,), float64, in [0, 1].
        rows: Shape (n,), int64: the samples that were looked at.
        tally: What was found for them.
        complete: Whether the patch holds all that matters.
    """

    value: Float64Array
    rows: Int64Array
    tally: Tally
    complete: bool


class LocalSolver:
    """Solves patches of one bake.

    Args:
        mapper: Over the scene and its samples.
        samples: All of them.
        tally: As stored.
        adjoint: Of the stored values.
        settings: Mapping, alpha and back-face threshold.
    """

    def __init__(
        self, mapper: VertexMapper, samples: SampleSet, tally: Tally, adjoint: Adjoint, settings: BakeSettings
    ) -> None:
        self._mapper, self._samples, self._tally = mapper, samples, tally
        self._adjoint, self._settings = adjoint, settings
        self._valid = tally.valid(settings.back_face_threshold)
        moments = mapper.moments(tally.ao, self._valid)
        self._scene: SceneScatter = scene_scatter(moments)
        shown = np.flatnonzero(moments.count > 0)
        survey = np.sort(np.random.default_rng(1).permutation(shown)[:SURVEYED])
        self._survey: Int64Array = adjoint.all_samples_on(survey)
        self._places: cKDTree | None = None

    def survey(self, retrace: Retrace) -> float:
        """Share of the faces all over the scene that have other samples then, in [0, 1]."""
        found = retrace(self._survey)
        changed = (found.ao != self._tally.ao[self._survey]).any(axis=1)
        face = self._samples.face[self._survey]
        return len(np.unique(face[changed])) / max(len(np.unique(face)), 1)

    def value(
        self, unknowns: Int64Array, shares: Float64Array, retrace: Retrace, scene: SceneScatter | None = None
    ) -> LocalValue:
        """A weighted mean of unknowns under other samples.

        Args:
            unknowns: Shape (m,), int64, distinct.
            shares: Shape (m,), float64, adding up to 1.
            retrace: Asked once for each sample of the patch.
            scene: The scene's mean scatter then; that of the stored samples if None.
        """
        seen = _Seen(self._tally.ao.shape[1])
        members = self._adjoint.reach(unknowns, shares, LEAK)
        members = np.union1d(members, self._adjoint.rings(unknowns, SMALLEST_RINGS))
        while True:
            value, leak, starved = self._attempt(members, unknowns, shares, seen, retrace, scene or self._scene)
            complete = leak <= LEAK and not starved
            grown = members if complete else np.union1d(members, self._adjoint.rings(members, MORE_RINGS))
            if complete or len(members) > LARGEST or len(grown) == len(members):
                return LocalValue(value, seen.rows, seen.tally, complete or len(grown) == len(members))
            members = grown

    def _attempt(
        self,
        members: Int64Array,
        unknowns: Int64Array,
        shares: Float64Array,
        seen: _Seen,
        retrace: Retrace,
        scene: SceneScatter,
    ) -> tuple[Float64Array, float, bool]:
        """Value, leak, and whether the spot is starved and its fill may come from outside the patch."""
        part, inner = self._part(members)
        rows = self._adjoint.all_samples_on(inner)
        seen.add(rows, retrace)
        here = self._adjoint.all_samples_on(part.rows)
        ao, valid = self._tally.ao[here].copy(), self._valid[here]
        at = np.searchsorted(here, seen.rows)
        ao[at], valid[at] = seen.tally.ao, seen.tally.valid(self._settings.back_face_threshold)
        moments = face_moments(part.surface, self._samples.only(here), ao, valid)
        equations = build_equations(part.surface, moments, self._mapper.own_alpha[part.rows], scene)
        spot, own = part.local(unknowns), part.local(members)
        region = _starved_around(part, equations, spot)
        inside = np.zeros(len(part.unknowns), np.bool_)
        inside[own] = True
        open_ended = bool((region & ~inside).any())
        if region.any() and not open_ended and not (_rim(part, region) & ~equations.starved).any():
            equations = self._from_afar(part, equations, region, retrace)
        if self._settings.mapping is MappingKind.AVERAGE or self._adjoint.averaged[unknowns].all():
            return shares @ equations.average[spot], 0.0, open_ended
        value, leak = self._solved(part, equations, own, spot, shares)
        return value, leak, open_ended

    def _from_afar(self, part: SurfacePart, equations: Equations, lost: BoolArray, retrace: Retrace) -> Equations:
        """The same, where a component without any valid sample takes the average of the nearest vertices in space."""
        position = self._adjoint.surface.position
        if self._places is None:
            self._places = cKDTree(position)
        average = equations.average.copy()
        waiting, tried = np.flatnonzero(lost), NEAREST_TRIED
        while len(waiting):
            tried = min(tried, len(position))
            query = self._places.query(part.surface.position[waiting], tried)
            apart: Float64Array = np.asarray(query[0], np.float64).reshape(len(waiting), -1)
            near: Int64Array = np.asarray(query[1], np.int64).reshape(len(waiting), -1)
            candidates = np.unique(near)
            mass, value = self._averages(candidates, retrace)
            has = mass[np.searchsorted(candidates, near)] > 0.0
            found = has.any(axis=1)
            closest = np.where(has, apart, np.inf).min(axis=1)
            equal = has & (apart <= closest[:, None] * (1.0 + 1e-9))
            first = np.where(equal, near, len(position)).min(axis=1)[found]
            average[waiting[found]] = value[np.searchsorted(candidates, first)]
            waiting = waiting[~found]
            if tried == len(position):
                break
            tried *= 8
        return replace(equations, average=average)

    def _averages(self, unknowns: Int64Array, retrace: Retrace) -> tuple[Float64Array, Float64Array]:
        """Lumped mass, shape (n,), and weighted average, (n, k), at some unknowns under other samples."""
        part = part_of(self._adjoint.surface, self._adjoint.faces_around(unknowns))
        rows = self._adjoint.all_samples_on(part.rows)
        found = retrace(rows)
        valid = found.valid(self._settings.back_face_threshold)
        moments = face_moments(part.surface, self._samples.only(rows), found.ao, valid)
        at = part.local(unknowns)
        mass = at_corners(part.surface, moments.mass)[at]
        data = right_hand_side(part.surface, moments)[at]
        return mass, np.clip(data / np.where(mass > 0.0, mass, 1.0)[:, None], 0.0, 1.0)

    def _part(self, members: Int64Array) -> tuple[SurfacePart, Int64Array]:
        """The faces that the members' equations are made of; and those whose samples enter them, rows of the whole."""
        corners = self._adjoint.surface.corners
        first = self._adjoint.faces_around(members)
        second = self._adjoint.faces_around(np.unique(corners[first]))
        third = self._adjoint.faces_around(np.unique(corners[second]))
        return part_of(self._adjoint.surface, third), second

    def _solved(
        self, part: SurfacePart, equations: Equations, own: Int64Array, spot: Int64Array, shares: Float64Array
    ) -> tuple[Float64Array, float]:
        system = equations.system(self._settings.alpha)
        rows = system.matrix[own]
        square, beyond = rows[:, own], np.ones(len(part.unknowns), np.bool_)
        beyond[own] = False
        outside = rows[:, np.flatnonzero(beyond)]
        old = self._adjoint.values[part.unknowns]
        rhs = system.rhs[own] - outside @ old[beyond]
        column = Greens(square.tocsr().copy())
        place = np.searchsorted(own, spot)
        weights = column.column(place, shares, tolerance=1e-9)
        gain = np.zeros(len(own))
        gain[weights.unknowns] = weights.values
        leak = float(np.abs(outside.T @ gain).sum())
        solver = BoxSolver(square.tocsr(), np.array([0, len(own)]))
        value = np.empty(rhs.shape[1])
        for k in range(rhs.shape[1]):
            solution = solver.solve(rhs[:, k], old[own, k], tolerance=1e-10, most_iterations=500)
            value[k] = shares @ solution.x[place]
        return value, leak


class _Seen:
    """Samples that were asked for, and what was found, so that none is asked for twice."""

    def __init__(self, columns: int) -> None:
        self.rows = np.zeros(0, np.int64)
        self.tally = Tally.empty(0, columns)

    def add(self, rows: Int64Array, retrace: Retrace) -> None:
        """Asks for those of `rows`, sorted, that are not there yet."""
        new = np.setdiff1d(rows, self.rows, assume_unique=True)
        if not len(new):
            return
        found = retrace(new)
        order = np.argsort(np.concatenate([self.rows, new]), kind="stable")
        self.rows = np.concatenate([self.rows, new])[order]
        old = self.tally
        self.tally = Tally(
            _joined(old.ao, found.ao)[order],
            np.concatenate([old.rays, found.rays])[order],
            np.concatenate([old.hits, found.hits])[order],
            np.concatenate([old.back_faces, found.back_faces])[order],
        )


def _joined(old: Float32Array, new: Float32Array) -> Float32Array:
    return np.concatenate([old, new])


def _starved_around(part: SurfacePart, equations: Equations, spot: Int64Array) -> BoolArray:
    """The connected vertices without samples that the spot is one of, shape (u,); none if it has samples."""
    edges, starved = part.surface.edges, equations.starved
    region = np.zeros(len(part.unknowns), np.bool_)
    region[spot[starved[spot]]] = True
    between = edges[starved[edges].all(axis=1)]
    while True:
        ends = between[region[between].any(axis=1)]
        if region[ends].all():
            return region
        region[ends] = True


def _rim(part: SurfacePart, region: BoolArray) -> BoolArray:
    """The neighbours of a region, shape (u,)."""
    rim = np.zeros(len(region), np.bool_)
    edges = part.surface.edges
    rim[edges[region[edges].any(axis=1)]] = True
    return rim & ~region
