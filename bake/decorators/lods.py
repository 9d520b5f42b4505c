"""Lower levels of detail take on the AO of the finest one (Sloan et al. 2013, section 2.2.1).

Samples on the lower level's own surface read the finest level's baked AO in small spheres; the least-squares fit then
brings them to the vertices. Nothing is occluded anew, so that levels never darken each other.

A sphere begins as wide as the piece of surface that its sample stands for, and doubles until enough of its rays meet
the finest level: it ends as wide as the two levels lie apart there.
"""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.spatial import cKDTree

from bake.decorator_types import ReadingSpheres
from bake.decorators.resample import BakedSurface, RayCaster, sphere_reader
from bake.decorators.small import REACH, objects_of, spheres
from bake.errors import SceneError
from bake.geometry import as_traced
from bake.settings import BakeSettings
from bake.types import (
    BoolArray,
    Finding,
    Float32Array,
    Float64Array,
    Int32Array,
    Int64Array,
    ObjectKeys,
    Progress,
    Role,
    SampleSet,
    SolveReport,
    VertexField,
    VertexState,
    World,
)

RAYS = 32
"""Rays a sphere: the fit averages over the samples around each vertex."""

Sampler = Callable[[World, BakeSettings], SampleSet]
"""Places surface samples; see `bake.samples.place_samples`."""

Samplable = Callable[[Float64Array, Int32Array, Int32Array, Float64Array], BoolArray]
"""Tells which faces are no points or slivers; see `bake.scene.surface.samplable_faces`."""


class Mapper(Protocol):
    """Maps samples to vertices; see `bake.solve.map_to_vertices`."""

    def __call__(
        self, world: World, samples: SampleSet, ao: Float32Array, valid: BoolArray, settings: BakeSettings, /
    ) -> VertexField:
        """Values at the vertices of the objects that receive."""
        ...


@dataclass(frozen=True, slots=True)
class LodBake:
    """What became of the lower levels of detail.

    Attributes:
        field: The bake's field, with AO at the lower levels' vertices too; its report is still the bake's.
        report: How their own solve went.
        findings: Levels that had to take AO from elsewhere.
        samples: Number of samples on them.
        rays: Rays traced.
    """

    field: VertexField
    report: SolveReport
    findings: tuple[Finding, ...]
    samples: int
    rays: int


def bake_lods(
    world: World,
    surface: BakedSurface,
    field: VertexField,
    settings: BakeSettings,
    caster: RayCaster,
    *,
    sampler: Sampler,
    mapper: Mapper,
    samplable: Samplable,
) -> Generator[Progress, None, LodBake]:
    """Bakes all objects of role `lod` from what is baked already.

    Raises:
        SceneError: an object's finest level does not exist.
    """
    lods = objects_of(world, Role.LOD)
    finest = finest_levels(world, lods)
    alone = lod_world(world, lods, samplable)
    own = settings.replaced(weld_instances=False)
    samples = sampler(alone, own)
    search = FinestSearch(world, surface, caster, samples, lods, finest)
    yield from search.run()
    solved = mapper(alone, samples, search.ao, search.found, own)
    ao, state = field.ao.copy(), field.state.copy()
    for number in lods.tolist():
        part = slice(int(world.first_vertex[number]), int(world.first_vertex[number + 1]))
        ao[part], state[part] = solved.ao[part], solved.state[part]
    merged = VertexField(ao, state, field.report)
    findings = (*search.findings(), *_unfilled(world, lods, solved))
    return LodBake(merged, solved.report, findings, len(samples), search.rays)


def finest_levels(world: World, lods: Int32Array) -> BoolArray:
    """Which objects belong to the finest level of each lower one, shape (lods, objects).

    `of` names an object, all that repeat its name (`#1`, `#2` …), or a node with objects below it.

    Raises:
        SceneError: it names nothing; the nearest path is named.
    """
    paths, roles = world.object_paths, world.object_roles
    may = np.array([role is not Role.LOD for role in roles], np.bool_)
    names: dict[str, list[int]] = {}
    for number, path in enumerate(paths):
        parts = path.rpartition("#")[0].split("/") if _is_repeated(path) else path.split("/")
        above = ["/".join(parts[: i + 1]) for i in range(len(parts))]
        for name in {path, *above}:
            names.setdefault(name, []).append(number)
    belongs = np.zeros((len(lods), len(paths)), np.bool_)
    numbers: list[int] = lods.tolist()
    for row, number in enumerate(numbers):
        of = world.object_keys[number].of or ""
        belongs[row, names.get(of, [])] = True
        belongs[row] &= may
        if not belongs[row].any():
            near = difflib.get_close_matches(of, sorted(names), 1)
            remedy = f"did you mean {near[0]!r}?" if near else 'set of = "path of the finest level"'
            raise SceneError(f"no finest level {of!r}", where=paths[number], remedy=remedy)
    return belongs


def _is_repeated(path: str) -> bool:
    return path.rpartition("#")[2].isdigit() and "#" in path


def lod_world(world: World, lods: Int32Array, samplable: Samplable) -> World:
    """The same world in which the lower levels, and nothing else, receive per vertex, each for itself."""
    receives = np.zeros(world.object_count, np.bool_)
    receives[lods] = True
    diagonals = np.zeros(world.object_count)
    diagonals[lods] = spheres(world, lods, None)[1] * (2.0 / REACH)
    takes = receives[world.face_object]
    chosen = np.flatnonzero(takes)
    takes[chosen] = samplable(world.positions, world.faces[chosen], world.face_object[chosen], diagonals)
    keys = tuple(
        dataclasses.replace(keys, weld=False) if receives[i] else ObjectKeys()
        for i, keys in enumerate(world.object_keys)
    )
    roles = tuple(Role.RECEIVER if own else Role.IGNORE for own in receives.tolist())
    return dataclasses.replace(world, object_roles=roles, object_keys=keys, face_samples=takes)


class FinestSearch:
    """Looks for baked surface around samples: on the finest level, where it faces the same way; then less choosy.

    Attributes:
        ao: Shape (n, k), float32, in [0, 1]: what was found; 1 where nothing was.
        found: Shape (n,), bool.
        elsewhere: Shape (n,), bool: it was not on the finest level, or not in reach.
        rays: Rays traced so far.
    """

    def __init__(
        self,
        world: World,
        surface: BakedSurface,
        caster: RayCaster,
        samples: SampleSet,
        lods: Int32Array,
        finest: BoolArray,
        *,
        rays_each: int = RAYS,
    ) -> None:
        """Prepares the search.

        Args:
            world: The flattened scene.
            surface: Its baked surface.
            caster: Finds hits on `world.faces`.
            samples: Points on the lower levels; their areas decide how wide spheres begin.
            lods: Shape (l,): the lower levels.
            finest: Shape (l, objects); see `finest_levels`.
            rays_each: Rays a sphere.
        """
        self._rays_each = rays_each
        self._world, self._surface, self._lods, self._finest = world, surface, lods, finest
        self._reader = sphere_reader(surface, caster, rays=rays_each, counts=finest)
        self._positions, self._samples = as_traced(world.positions), samples
        row_of = np.full(world.object_count, -1, np.int32)
        row_of[lods] = np.arange(len(lods))
        self._row = row_of[world.face_object[samples.face]]
        self._most = spheres(world, lods, None)[1]
        self.ao = np.ones((len(samples), surface.ao.shape[1]), np.float32)
        self.found = np.zeros(len(samples), np.bool_)
        self.elsewhere = np.zeros(len(samples), np.bool_)
        self.rays = 0

    def run(self) -> Generator[Progress]:
        """Fills `ao` and `found`."""
        yield from self._read(on_finest=True, same_side=True)
        yield from self._read(on_finest=True, same_side=False)
        self.elsewhere = ~self.found
        yield from self._read(on_finest=False, same_side=False)
        self._take_nearest_vertices()

    def findings(self) -> list[Finding]:
        """Levels with samples that found no finest level around them."""
        counts = np.bincount(self._row[self.elsewhere], minlength=len(self._lods))
        totals = np.bincount(self._row, minlength=len(self._lods))
        found: list[Finding] = []
        for row in np.flatnonzero(counts).tolist():
            path, of = (
                self._world.object_paths[int(self._lods[row])],
                self._world.object_keys[int(self._lods[row])].of,
            )
            detail = (
                f"{counts[row]:,} of {totals[row]:,} samples lie farther from the baked surface of {of} than the "
                "object is wide, and take on what is baked nearest."
            )
            found.append(Finding(path, "far-from-finest-level", int(counts[row]), detail))
        return found

    def _read(self, *, on_finest: bool, same_side: bool) -> Generator[Progress]:
        """Reads the surface around the samples that have found nothing yet."""
        missing = np.flatnonzero(~self.found)
        if not self._surface.carries.any():
            return
        done = len(self.found) - len(missing)
        for begin in range(0, len(missing), self._reader.at_once):
            part = missing[begin : begin + self._reader.at_once]
            around = self._reader.read(self._spheres(part, on_finest=on_finest, same_side=same_side))
            some = around.hits > 0
            self.ao[part[some]], self.found[part[some]] = around.ao[some], True
            self.rays += around.rays
            done += int(np.count_nonzero(some))
            yield Progress("lods", done * self._rays_each, len(self.found) * self._rays_each)

    def _spheres(self, rows: Int64Array, *, on_finest: bool, same_side: bool) -> ReadingSpheres:
        """Spheres around some samples, as wide at first as the piece of surface that each stands for."""
        row, face = self._row[rows], self._samples.face[rows]
        return ReadingSpheres(
            centre=self._points(rows),
            least=np.sqrt(self._samples.area[rows].astype(np.float64)),
            most=self._most[row],
            row=row if on_finest else np.full(len(rows), -1, np.int32),
            own_face=np.where(self._world.face_two_sided[face] | (not same_side), np.int32(-1), face),
        )

    def _points(self, rows: Int64Array) -> Float64Array:
        """Where some samples lie, shape (n, 3)."""
        weights = self._samples.barycentric[rows].astype(np.float64)
        weights = np.concatenate([weights, 1.0 - weights.sum(axis=1, keepdims=True)], axis=1)
        return np.einsum("ij,ijk->ik", weights, self._positions[self._world.faces[self._samples.face[rows]]])

    def _take_nearest_vertices(self) -> None:
        """What is left takes on the baked vertex nearest to it: of the finest level, or of all."""
        if self.found.all():
            return
        world = self._world
        known = np.isfinite(self._surface.ao).all(axis=1)
        owner = np.repeat(np.arange(world.object_count), np.diff(world.first_vertex))
        for row in np.unique(self._row[~self.found]).tolist():
            samples = np.flatnonzero(~self.found & (self._row == row))
            vertices = np.flatnonzero(known & self._finest[row][owner])
            if not len(vertices):
                vertices = np.flatnonzero(known)
            if not len(vertices):
                continue
            _, nearest = cKDTree(world.positions[vertices]).query(self._points(samples))
            self.ao[samples], self.found[samples] = self._surface.ao[vertices[nearest]], True


def _unfilled(world: World, lods: Int32Array, solved: VertexField) -> list[Finding]:
    """Levels with vertices that no sample reached."""
    findings: list[Finding] = []
    numbers: list[int] = lods.tolist()
    for number in numbers:
        part = slice(int(world.first_vertex[number]), int(world.first_vertex[number + 1]))
        count = int(np.count_nonzero(solved.state[part] == VertexState.FILLED))
        if count:
            detail = f"{count:,} vertices had no valid sample and were filled from their neighbours"
            findings.append(Finding(world.object_paths[number], "filled-vertices", count, detail))
    return findings
