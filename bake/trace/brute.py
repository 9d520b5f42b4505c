"""Every ray against every triangle in NumPy: slow, short, and the oracle for the others.

It follows the same formulas as the fused kernel through `bake/geometry.py`, in float64, so that a disagreement points
at a tracer and not at its input.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bake import geometry, spherical_harmonics
from bake.change_types import WorldChange
from bake.decorator_types import FogBoxes
from bake.low_discrepancy import owen_sobol, thresholds
from bake.settings import BakeSettings, Kernel
from bake.trace.base import Hits, SphereTally, Tracer, check_directions
from bake.trace.brute_veil import PlainVeil
from bake.trace.records import RayRecords
from bake.types import (
    BoolArray,
    Float32Array,
    Float64Array,
    Int32Array,
    Int64Array,
    Role,
    SampleSet,
    Tally,
    UInt32Array,
    World,
)

_PAIRS = 1 << 21  # ray-triangle pairs at a time: 16 MB an array


class _Followed(NamedTuple):
    """What became of n rays: all shape (n,), but for the last."""

    open_share: Float64Array  # shape (n, k)
    met: BoolArray
    back: BoolArray
    end: Float64Array
    stopper: Int64Array
    passes: Float64Array
    layers: list[tuple[Int64Array, Int32Array]]  # rays and the faces that they struck, layer by layer


class TracerBrute(Tracer):
    """The NumPy oracle."""

    name = "brute"
    device = "cpu"
    batch_size = 64

    def __init__(self, world: World, settings: BakeSettings, fog: FogBoxes | None = None) -> None:
        super().__init__(world, settings)
        self.fog, self._veil = fog, PlainVeil(world, settings, fog)
        self.fog_boxes, self.tree_triangles = self._veil.fog_boxes, self._veil.tree_triangles
        self._positions = geometry.as_traced(world.positions).astype(np.float64)
        self._cast_face = np.flatnonzero(world.face_casts)
        corners = geometry.faces_corners(self._positions, world.faces[self._cast_face])
        self._corner, self._edge1, self._edge2 = corners[0], corners[1] - corners[0], corners[2] - corners[0]
        cross = np.cross(self._edge1, self._edge2)
        self._normal = cross / np.maximum(np.linalg.norm(cross, axis=1), 1e-300)[:, None]

    def accumulate(self, samples: SampleSet, batch: slice, tally: Tally, *, rays: int | None = None) -> None:
        """Traces a batch; see `Tracer.accumulate`."""
        rays = self.settings.rays if rays is None else rays
        found = self._follow(*sample_rays(self.world, samples, batch, rays), trees=True)
        tally.ao[batch] = np.clip(found.open_share.reshape(-1, rays, self.settings.distance_count).mean(1), 0.0, 1.0)
        tally.hits[batch] = found.met.reshape(-1, rays).sum(1)
        tally.back_faces[batch] = found.back.reshape(-1, rays).sum(1)
        tally.rays[batch] = rays

    def transmittance(self, origins: Float32Array, directions: Float32Array, distance: float) -> Float32Array:
        """What fog and trees let through; see `Tracer.transmittance`."""
        end = np.full(len(origins), distance)
        depth = self._veil.depth(origins.astype(np.float64), directions.astype(np.float64), end, trees=True)
        return np.exp(-depth).astype(np.float32)

    def gather_sphere(
        self, points: Float32Array, seeds: UInt32Array, directions: int, *, trees: bool = True
    ) -> SphereTally:
        """Spherical harmonics of what is open around points; see `Tracer.gather_sphere`."""
        check_directions(directions)
        index, seed = np.tile(np.arange(directions), len(points)), np.repeat(seeds, directions)
        ways = geometry.sphere_direction(*owen_sobol(index, seed))
        origins = np.repeat(points.astype(np.float64), directions, axis=0)
        found = self._follow(origins, ways, thresholds(index, seed), trees=trees)
        basis = spherical_harmonics.evaluate(ways).reshape(len(points), directions, spherical_harmonics.COUNT)
        open_share = found.open_share.reshape(len(points), directions, self.settings.distance_count)
        return SphereTally(
            sh=(4.0 * math.pi / directions * np.einsum("ndc,ndk->nck", basis, open_share)).astype(np.float32),
            directions=directions,
            hits=found.met.reshape(-1, directions).sum(1).astype(np.uint16),
            back_faces=found.back.reshape(-1, directions).sum(1).astype(np.uint16),
        )

    def nearest(self, origins: Float32Array, directions: Float32Array, t_max: float) -> Hits:
        """Closest hits; see `Tracer.nearest`."""
        return self._closest(origins.astype(np.float64), directions.astype(np.float64), np.zeros(len(origins)), t_max)

    def record(self, samples: SampleSet) -> RayRecords:
        """Rays one by one; see `Tracer.record`."""
        rays = self.settings.rays
        drawn = drawn_rays(self.world, samples, slice(0, len(samples)), rays)
        directions = geometry.above_face(drawn.directions, drawn.face_normals)
        found = self._follow(drawn.origins, directions, drawn.thresholds, trees=True)
        ray, crossed, depth = self._veil.crossings(drawn.origins, directions, found.end)
        first = np.full(len(directions), -1, np.int32)
        if found.layers:
            first[found.layers[0][0]] = found.layers[0][1]
        shape = (len(samples), rays)
        return RayRecords(
            origin=drawn.origins[::rays].astype(np.float32),
            direction=directions.astype(np.float32).reshape(*shape, 3),
            distance=found.end.astype(np.float32).reshape(shape),
            face=found.stopper.astype(np.int32).reshape(shape),
            first_face=first.reshape(shape),
            back=found.back.reshape(shape),
            mirrored=(np.einsum("ij,ij->i", drawn.directions, drawn.face_normals) < 0.0).reshape(shape),
            passes=found.passes.astype(np.float32).reshape(shape),
            crossed_ray=ray,
            crossed_object=crossed,
            crossed_depth=depth.astype(np.float32),
        )

    def meets(
        self, samples: SampleSet, wanted: int, low: Float32Array, high: Float32Array, *, rays: int | None = None
    ) -> BoolArray:
        """Which samples have a ray that meets an object; see `Tracer.meets`."""
        rays = self.settings.rays if rays is None else rays
        origins, directions, threshold = sample_rays(self.world, samples, slice(0, len(samples)), rays)
        near = np.zeros(len(origins), np.bool_)
        inverse = 1.0 / np.where(np.abs(directions) < 1e-20, 1e-20, directions)
        for lowest, highest in zip(low.astype(np.float64), high.astype(np.float64), strict=True):
            a, b = (lowest - origins) * inverse, (highest - origins) * inverse
            enter = np.maximum(np.minimum(a, b).max(1), 0.0)
            near |= enter <= np.minimum(np.maximum(a, b).min(1), self.settings.trace_distance) + 1e-6
        if wanted >= 0:
            struck = np.zeros(len(origins), np.bool_)
            for ray, face in self._follow(origins, directions, threshold, trees=False).layers:
                struck[ray] |= self.world.face_object[face] == wanted
            near &= struck
        return np.asarray(near.reshape(-1, rays).any(axis=1))

    def trace_without(self, samples: SampleSet, wanted: int, fog: FogBoxes | None, *, rays: int | None = None) -> Tally:
        """Traces as if one object did not cast; see `Tracer.trace_without`."""
        world = self.world
        roles = list(world.object_roles)
        if roles[wanted] is Role.TREE:
            roles[wanted] = Role.IGNORE
        casts = world.face_casts & (world.face_object != wanted)
        other = TracerBrute(replace(world, face_casts=casts, object_roles=tuple(roles)), self.settings, fog)
        tally = Tally.empty(len(samples), self.settings.distance_count)
        other.accumulate(samples, slice(0, len(samples)), tally, rays=rays)
        return tally

    def updated(self, world: World, change: WorldChange, fog: FogBoxes | None) -> TracerBrute:
        """A tracer of the edited world, made anew; see `Tracer.updated`."""
        return TracerBrute(world, self.settings, fog)

    def close(self) -> None:
        """Holds nothing that needs freeing."""

    def _follow(
        self, origins: Float64Array, directions: Float64Array, threshold: Float64Array, *, trees: bool
    ) -> _Followed:
        blocked = np.zeros((len(origins), self.settings.distance_count))
        end = np.full(len(origins), self.settings.trace_distance)
        through, t_min = np.ones(len(origins)), np.zeros(len(origins))
        met, back = np.zeros(len(origins), np.bool_), np.zeros(len(origins), np.bool_)
        stopper, layers = np.full(len(origins), -1), list[tuple[Int64Array, Int32Array]]()
        active = np.arange(len(origins))
        for layer in range(geometry.MAX_LAYERS):
            hits = self._closest(origins[active], directions[active], t_min[active], self.settings.trace_distance)
            struck = hits.face >= 0
            if layer == 0:
                met, back = struck, struck & self._back_faces(hits)
            active, face = active[struck], hits.face[struck]
            layers.append((active, face))
            distance = hits.distance[struck].astype(np.float64)
            through[active] *= self._openness(hits, struck)
            stopped = through[active] <= threshold[active]
            if layer == geometry.MAX_LAYERS - 1:
                stopped[:] = True
            blocked[active[stopped]] = self._blocked_share(distance[stopped])
            end[active[stopped]] = distance[stopped]
            stopper[active[stopped]] = face[stopped]
            t_min[active] = distance * (1.0 + 4.0 * 2.0**-24) + 1e-7
            active = active[~stopped]
            if len(active) == 0:
                break
        passes: Float64Array = np.exp(-self._veil.depth(origins, directions, end, trees=trees))
        return _Followed((1.0 - blocked) * passes[:, None], met, back, end, stopper, passes, layers)

    def _closest(self, origins: Float64Array, directions: Float64Array, t_min: Float64Array, t_max: float) -> Hits:
        parts = [
            self._closest_part(origins[a : a + step], directions[a : a + step], t_min[a : a + step], t_max)
            for step in [max(1, _PAIRS // max(1, len(self._cast_face)))]
            for a in range(0, len(origins), step)
        ]
        distance, face, cosine, weights = (
            (np.concatenate(columns) for columns in zip(*parts, strict=True))
            if parts
            else (np.zeros(0), np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 2)))
        )
        return Hits(
            distance.astype(np.float32), face.astype(np.int32), cosine.astype(np.float32), weights.astype(np.float32)
        )

    def _closest_part(
        self, origins: Float64Array, directions: Float64Array, t_min: Float64Array, t_max: float
    ) -> tuple[Float64Array, Int64Array, Float64Array, Float64Array]:
        """Möller and Trumbore 1997, every ray against every triangle."""
        cross_d = np.cross(directions[:, None, :], self._edge2[None])
        determinant = np.einsum("rtk,tk->rt", cross_d, self._edge1)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            inverse = 1.0 / determinant
            to_origin = origins[:, None, :] - self._corner[None]
            u = np.einsum("rtk,rtk->rt", to_origin, cross_d) * inverse
            cross_o = np.cross(to_origin, self._edge1[None])
            v = np.einsum("rtk,rk->rt", cross_o, directions) * inverse
            t = np.einsum("rtk,tk->rt", cross_o, self._edge2) * inverse
            struck = (determinant != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= t_min[:, None]) & (t <= t_max)
        t = np.where(struck, t, np.inf)
        if t.shape[1] == 0:
            t, u, v = (np.full((len(origins), 1), np.inf) for _ in range(3))
        best = t.argmin(1)
        row = np.arange(len(origins))
        missed = ~np.isfinite(t[row, best])
        normal = self._normal[best] if len(self._normal) else np.zeros((len(origins), 3))
        face = np.where(missed, -1, self._cast_face[best] if len(self._cast_face) else -1)
        cosine = np.einsum("ij,ij->i", normal, directions)
        u, v = np.where(missed, 0.0, u[row, best]), np.where(missed, 0.0, v[row, best])
        weights = np.stack([1.0 - u - v, u], axis=1)
        return t[row, best], face, np.where(missed, 0.0, cosine), np.where(missed[:, None], 0.0, weights)

    def _back_faces(self, hits: Hits) -> BoolArray:
        third = 1.0 - hits.weights.sum(1)
        inside = np.minimum(third, hits.weights.min(1)) > geometry.EDGE_BARYCENTRIC
        return inside & (hits.cosine > geometry.GRAZING_COSINE) & ~self.world.face_two_sided[hits.face]

    def _openness(self, hits: Hits, struck: BoolArray) -> Float64Array:
        world, face = self.world, hits.face[struck]
        openness = world.face_openness[face].astype(np.float64)
        if world.face_texture is None or world.vertex_uv is None:
            return openness
        weights = np.concatenate([hits.weights, 1.0 - hits.weights.sum(1, keepdims=True)], axis=1)[struck]
        uv = np.einsum("ij,ijk->ik", weights, world.vertex_uv[world.faces[face]])
        uv -= np.floor(uv)
        for i, texels in enumerate(world.textures):
            of = world.face_texture[face] == i
            height, width = texels.shape
            x = np.minimum((uv[of, 0] * width).astype(int), width - 1)
            y = np.minimum((uv[of, 1] * height).astype(int), height - 1)
            openness[of] = texels[y, x]
        return openness

    def _blocked_share(self, distance: Float64Array) -> Float64Array:
        """1 - ρ for every column, shape (n, k)."""
        if self.settings.kernel is Kernel.OCCLUSION:
            return np.ones((len(distance), 1))
        rates = -math.log(2.0) / np.asarray(self.settings.distances)
        return np.exp(distance[:, None] * rates)


class DrawnRays(NamedTuple):
    """The samples' rays in order, before they are brought above their faces: shape (n × rays, 3), but `thresholds`."""

    origins: Float64Array
    directions: Float64Array
    face_normals: Float64Array
    thresholds: Float64Array  # shape (n × rays,)


def sample_rays(
    world: World, samples: SampleSet, batch: slice, rays: int
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Origins, directions, shape (n × rays, 3) each, and thresholds, (n × rays,), of the samples' rays in order."""
    drawn = drawn_rays(world, samples, batch, rays)
    return drawn.origins, geometry.above_face(drawn.directions, drawn.face_normals), drawn.thresholds


def drawn_rays(world: World, samples: SampleSet, batch: slice, rays: int) -> DrawnRays:
    """The rays of some samples as the sequences give them."""
    face, weights = samples.face[batch], samples.barycentric[batch].astype(np.float64)
    weights = np.concatenate([weights, 1.0 - weights.sum(1, keepdims=True)], axis=1)
    positions = geometry.as_traced(world.positions).astype(np.float64)
    a, b, c = geometry.faces_corners(positions, world.faces[face])
    point = np.einsum("ij,ijk->ik", weights, np.stack([a, b, c], axis=1))
    normal = geometry.face_normals(positions, world.faces[face])[0]
    extent = np.linalg.norm(np.stack([b - a, c - b, a - c]), axis=2).max(0)
    lift = geometry.offset_distance(point, extent)
    lift += np.array([keys.offset or 0.0 for keys in world.object_keys])[world.face_object[face]]
    origin = (point + lift[:, None] * normal).astype(np.float32).astype(np.float64)

    shading = geometry.shading_normals(world.normals[world.faces[face]], weights, normal)
    index = samples.index[batch, None].astype(np.int64) * rays + np.arange(rays)
    seed = np.repeat(samples.face_seed[face], rays)
    u, v = owen_sobol(index.ravel(), seed)
    directions = geometry.cosine_direction(u, v, np.repeat(shading, rays, axis=0))
    return DrawnRays(
        np.repeat(origin, rays, axis=0), directions, np.repeat(normal, rays, axis=0), thresholds(index.ravel(), seed)
    )
