"""Reads baked AO off the surface within small spheres (Sloan et al. 2013, section 2.2.1).

Rays run from the boundary of a sphere towards its centre. What they strike is the *baked* surface: its AO, interpolated
at the hit, weighted by the hit's distance from the boundary, so that surface near the centre counts most. No occlusion
is traced again. Of several surfaces on one ray the last before the centre counts, the one that the centre sees: a clump
of grass on a slab takes the slab's top and not its underside, which a ray from below meets first.

A tracer that has a kernel for this makes the reader itself (`bake/kernels/read_spheres.py`); for one that only finds
closest hits the reader here does the same in NumPy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from bake.decorator_types import (
    READ_DOUBLINGS,
    READ_ENOUGH,
    READ_LAYERS,
    READ_LEAST_WEIGHT,
    Readings,
    ReadingSpheres,
)
from bake.geometry import OFFSET_ULPS, as_traced, face_normals
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array, VertexField, World

BATCH_RAYS = 1 << 18
"""Rays at a time in NumPy: some 30 MB, and an answer to Cancel several times a second."""


class RayHits(Protocol):
    """Closest hits, shape (n,) each and (n, 2) weights of corners 0 and 1; face -1 for a miss."""

    @property
    def distance(self) -> Float32Array:
        """Metres; infinite for a miss."""
        ...

    @property
    def face(self) -> Int32Array:
        """Index into the world's faces."""
        ...

    @property
    def weights(self) -> Float32Array:
        """Of corners 0 and 1."""
        ...


class RayCaster(Protocol):
    """What finds closest hits; the tracers do."""

    def nearest(self, origins: Float32Array, directions: Float32Array, t_max: float) -> RayHits:
        """Closest hits of rays within `t_max` metres, shape (n, 3) each; see `bake.trace.Tracer`."""
        ...


class SphereReader(Protocol):
    """Reads one baked surface within spheres."""

    @property
    def at_once(self) -> int:
        """Spheres that a call of `read` handles well."""
        ...

    def read(self, spheres: ReadingSpheres) -> Readings:
        """What the spheres find."""
        ...


@dataclass(frozen=True, slots=True)
class BakedSurface:
    """The faces that carry baked AO at all three corners.

    Attributes:
        world: Whose faces.
        carries: Shape (m,), bool.
        ao: Shape (n, k), float32: AO at the vertices; NaN where there is none.
    """

    world: World
    carries: BoolArray
    ao: Float32Array

    @staticmethod
    def of(world: World, field: VertexField) -> BakedSurface:
        """The surface of a bake."""
        known = field.ao.sum(axis=1)  # not a number where one of its values is not
        return BakedSurface(world, np.isfinite(known[world.faces].sum(axis=1)), field.ao)

    def interpolated(self, face: NDArray[Any], weights: NDArray[Any]) -> Float64Array:
        """AO inside faces, shape (n, k), float64, in [0, 1]; `weights` belong to corners 0 and 1."""
        first = np.clip(weights.astype(np.float64), 0.0, 1.0)
        phi = np.concatenate([first, np.maximum(1.0 - first.sum(axis=1, keepdims=True), 0.0)], axis=1)
        phi /= phi.sum(axis=1, keepdims=True)
        return np.einsum("ij,ijk->ik", phi, self.ao[self.world.faces[face]].astype(np.float64))


def sphere_directions(count: int) -> Float64Array:
    """Unit vectors spread evenly over the sphere, shape (count, 3): a spherical Fibonacci lattice.

    It is turned by half a step, so that none lies in a plane of two axes: levels are full of such planes, and a ray
    inside one strikes a face or passes it as the tracer's boxes happen to be cut.

    References:
        Keinert et al. 2015, "Spherical Fibonacci Mapping", ACM TOG 34(6).
    """
    i = np.arange(count)
    z = 1.0 - (2.0 * i + 1.0) / count
    turn = 2.0 * math.pi * np.mod((i + 0.5) * (math.sqrt(5.0) - 1.0) / 2.0, 1.0)
    radius = np.sqrt(1.0 - z * z)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)


def sphere_reader(
    surface: BakedSurface, caster: RayCaster, *, rays: int, counts: BoolArray | None = None
) -> SphereReader:
    """What reads the surface within spheres.

    Args:
        surface: What carries AO.
        caster: Finds hits on any faces; those that carry no AO, or do not count, are passed.
        rays: Rays a sphere.
        counts: Shape (r, o): which objects count for spheres of row r.
    """
    table = np.zeros((1, 1), np.bool_) if counts is None else counts
    own = getattr(caster, "sphere_reader", None)
    if own is not None:
        return cast("SphereReader", own(surface.ao, surface.carries, table, sphere_directions(rays)))
    return _PlainReader(surface, caster, table, rays)


def spheres_of(centres: Float64Array, radii: Float64Array) -> ReadingSpheres:
    """Spheres of one radius each, shape (n, 3) and (n,), for which all surface counts."""
    every = np.full(len(centres), -1, np.int32)
    return ReadingSpheres(centres, radii, radii, every, every)


class _PlainReader:
    """A reader over closest hits."""

    def __init__(self, surface: BakedSurface, caster: RayCaster, counts: BoolArray, rays: int) -> None:
        self._surface, self._caster, self._counts, self._rays = surface, caster, counts, rays
        world = surface.world
        self._normals = face_normals(as_traced(world.positions).astype(np.float64), world.faces)[0]
        self.at_once = max(1, BATCH_RAYS // rays)

    def read(self, spheres: ReadingSpheres) -> Readings:
        """Widens the spheres that have not found enough yet until they do."""
        ao, hits = np.ones((len(spheres), self._surface.ao.shape[1])), np.zeros(len(spheres), np.int32)
        missing, radius = np.arange(len(spheres)), np.minimum(spheres.least, spheres.most)
        traced = 0
        for _ in range(READ_DOUBLINGS):
            around = self._within(spheres, missing, radius)
            traced += around.rays
            some = around.hits > 0
            ao[missing[some]], hits[missing[some]] = around.ao[some], around.hits[some]
            wide = (around.hits * READ_ENOUGH >= self._rays) | (radius >= spheres.most[missing])
            missing, radius = missing[~wide], np.minimum(2.0 * radius[~wide], spheres.most[missing[~wide]])
            if not len(missing):
                break
        return Readings(ao, hits, traced)

    def _within(self, spheres: ReadingSpheres, chosen: Int64Array, radii: Float64Array) -> Readings:
        """What some of the spheres find with these radii."""
        outward = np.tile(sphere_directions(self._rays), (len(chosen), 1))
        sphere = np.repeat(chosen, self._rays)
        centres = spheres.centre[chosen]
        # What rounding of a point to float32 and the tracer's arithmetic may shift a hit by: how far a ray looks beyond
        # the centre, where a surface through the centre lies, and how far behind a surface it goes on.
        largest = np.abs(centres).max(axis=1, initial=0.0)
        slack = np.repeat(OFFSET_ULPS * 2.0**-24 * (largest + radii), self._rays)
        radius = np.repeat(radii, self._rays)
        start = np.repeat(centres, self._rays, axis=0) + radius[:, None] * outward
        last_face = np.full(len(sphere), -1, np.int64)
        last_weights = np.zeros((len(sphere), 2), np.float32)
        travelled, depth = np.zeros(len(sphere)), np.zeros(len(sphere))
        active, traced = np.arange(len(sphere)), 0
        for _ in range(READ_LAYERS):
            if not len(active):
                break
            towards = -outward[active]
            origins = start[active] + travelled[active, None] * towards
            left = radius[active] + slack[active] - travelled[active]
            hits = self._caster.nearest(
                origins.astype(np.float32), towards.astype(np.float32), float(left.max(initial=0.0))
            )
            traced += len(active)
            struck = np.flatnonzero((hits.face >= 0) & (hits.distance <= left))
            active, face = active[struck], hits.face[struck].astype(np.int64)
            reached = travelled[active] + hits.distance[struck]
            counts = self._admitted(spheres, sphere[active], face)
            last_face[active[counts]] = face[counts]
            last_weights[active[counts]] = hits.weights[struck][counts]
            depth[active[counts]] = reached[counts]
            travelled[active] = reached + slack[active]
            active = active[travelled[active] < radius[active]]
        weight = np.where(last_face >= 0, np.clip(depth / radius, READ_LEAST_WEIGHT, 1.0), 0.0)
        return self._weighted(last_face, last_weights, weight, traced)

    def _admitted(self, spheres: ReadingSpheres, sphere: Int64Array, face: Int64Array) -> BoolArray:
        """Which hits count: they carry AO, belong to the right object and face the right way."""
        world, row, own = self._surface.world, spheres.row[sphere], spheres.own_face[sphere]
        counts = self._surface.carries[face].copy()
        some = np.flatnonzero(row >= 0)
        counts[some] &= self._counts[row[some], world.face_object[face[some]]]
        some = np.flatnonzero(own >= 0)
        agree = np.einsum("ij,ij->i", self._normals[own[some]], self._normals[face[some]]) > 0.0
        counts[some] &= agree | world.face_two_sided[face[some]]
        return counts

    def _weighted(self, face: Int64Array, weights: Float32Array, weight: Float64Array, traced: int) -> Readings:
        found = face >= 0
        value = np.zeros((len(face), self._surface.ao.shape[1]))
        value[found] = self._surface.interpolated(face[found], weights[found])
        total = weight.reshape(-1, self._rays).sum(axis=1)
        summed = (value * weight[:, None]).reshape(len(total), self._rays, value.shape[1]).sum(axis=1)
        mean = summed / np.where(total > 0.0, total, 1.0)[:, None]
        ao = np.where(total[:, None] > 0.0, np.clip(mean, 0.0, 1.0), 1.0)
        return Readings(ao, found.reshape(-1, self._rays).sum(axis=1, dtype=np.int32), traced)
