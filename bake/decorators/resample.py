"""Reads baked AO off the surface within small spheres (Sloan et al. 2013, section 2.2.1).

Rays run from the boundary of a sphere towards its centre. What they strike is the *baked* surface: its AO, interpolated
at the hit, weighted by the hit's distance from the boundary, so that surface near the centre counts most. No occlusion
is traced again. Of several surfaces on one ray the last before the centre counts, the one that the centre sees: a clump
of grass on a slab takes the slab's top and not its underside, which a ray from below meets first.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from bake.geometry import OFFSET_ULPS
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array, VertexField, World

BATCH_RAYS = 1 << 18
"""Rays at a time: some 30 MB, and an answer to Cancel several times a second."""

MAX_LAYERS = 16
"""Most surfaces that one ray passes on its way to the centre."""

LEAST_WEIGHT = 1e-6
"""Weight, in radii, of a hit on the very boundary: it still is a hit."""

Admission = Callable[[Int64Array, Int64Array], BoolArray]
"""Given spheres and the faces that their rays struck, shape (n,) each: which of the hits count."""


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


@dataclass(frozen=True, slots=True)
class BakedSurface:
    """The faces that carry baked AO at all three corners.

    Attributes:
        faces: Shape (m, 3), int32: all faces of the world.
        carries: Shape (m,), bool.
        ao: Shape (n, k), float32: AO at the vertices; NaN where there is none.
    """

    faces: Int32Array
    carries: BoolArray
    ao: Float32Array

    @staticmethod
    def of(world: World, field: VertexField) -> BakedSurface:
        """The surface of a bake."""
        known = field.ao.sum(axis=1)  # not a number where one of its values is not
        return BakedSurface(world.faces, np.isfinite(known[world.faces].sum(axis=1)), field.ao)

    def interpolated(self, face: NDArray[Any], weights: NDArray[Any]) -> Float64Array:
        """AO inside faces, shape (n, k), float64, in [0, 1]; `weights` belong to corners 0 and 1."""
        first = np.clip(weights.astype(np.float64), 0.0, 1.0)
        phi = np.concatenate([first, np.maximum(1.0 - first.sum(axis=1, keepdims=True), 0.0)], axis=1)
        phi /= phi.sum(axis=1, keepdims=True)
        return np.einsum("ij,ijk->ik", phi, self.ao[self.faces[face]].astype(np.float64))


@dataclass(frozen=True, slots=True)
class Resampled:
    """What the spheres found.

    Attributes:
        ao: Shape (n, k), float64, in [0, 1]; 1 where nothing was found.
        hits: Shape (n,), int64: rays that met a surface that counts.
        rays: Rays traced, those that went on behind a surface included.
    """

    ao: Float64Array
    hits: Int64Array
    rays: int


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


def resample(
    surface: BakedSurface,
    caster: RayCaster,
    centres: Float64Array,
    radii: Float64Array,
    *,
    rays: int,
    admits: Admission | None = None,
) -> Resampled:
    """Weighted means of the baked AO within spheres; at most `BATCH_RAYS` rays should be asked for at once.

    Args:
        surface: What carries AO.
        caster: Finds hits on any faces; those that carry no AO, or are not admitted, are passed.
        centres: Shape (n, 3), metres from the world's origin.
        radii: Shape (n,), metres, above 0.
        rays: Rays a sphere.
        admits: Which hits count; all by default.
    """
    outward = np.tile(sphere_directions(rays), (len(centres), 1))
    sphere = np.repeat(np.arange(len(centres)), rays)
    # What rounding of a point to float32 and the tracer's arithmetic may shift a hit by: how far a ray looks beyond
    # the centre, where a surface through the centre lies, and how far behind a surface it goes on.
    slack = (OFFSET_ULPS * 2.0**-24 * (np.abs(centres).max(axis=1, initial=0.0) + radii))[sphere]
    radius = radii[sphere]
    start = centres[sphere] + radius[:, None] * outward
    last_face = np.full(len(sphere), -1, np.int64)
    last_weights = np.zeros((len(sphere), 2), np.float32)
    travelled, depth = np.zeros(len(sphere)), np.zeros(len(sphere))
    active, traced = np.arange(len(sphere)), 0
    for _ in range(MAX_LAYERS):
        if not len(active):
            break
        towards = -outward[active]
        origins = start[active] + travelled[active, None] * towards
        left = radius[active] + slack[active] - travelled[active]
        hits = caster.nearest(origins.astype(np.float32), towards.astype(np.float32), float(left.max()))
        traced += len(active)
        struck = np.flatnonzero((hits.face >= 0) & (hits.distance <= left))
        active, face = active[struck], hits.face[struck].astype(np.int64)
        reached = travelled[active] + hits.distance[struck]
        counts = surface.carries[face]
        if admits is not None:
            counts &= admits(sphere[active], face)
        last_face[active[counts]] = face[counts]
        last_weights[active[counts]] = hits.weights[struck][counts]
        depth[active[counts]] = reached[counts]
        travelled[active] = reached + slack[active]
        active = active[travelled[active] < radius[active]]
    return _weighted(surface, last_face, last_weights, np.clip(depth / radius, LEAST_WEIGHT, 1.0), rays, traced)


def _weighted(
    surface: BakedSurface, face: Int64Array, weights: Float32Array, depth: Float64Array, rays: int, traced: int
) -> Resampled:
    found = face >= 0
    value = np.zeros((len(face), surface.ao.shape[1]))
    value[found] = surface.interpolated(face[found], weights[found])
    weight = np.where(found, depth, 0.0)
    total = weight.reshape(-1, rays).sum(axis=1)
    summed = (value * weight[:, None]).reshape(len(total), rays, value.shape[1]).sum(axis=1)
    mean = summed / np.where(total > 0.0, total, 1.0)[:, None]
    ao = np.where(total[:, None] > 0.0, np.clip(mean, 0.0, 1.0), 1.0)
    return Resampled(ao, found.reshape(-1, rays).sum(axis=1), traced)
