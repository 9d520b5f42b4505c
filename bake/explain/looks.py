"""What can be seen from a point, by rays of our own: to hold against what the bake made of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.explain.retrace import rho_of
from bake.geometry import GRAZING_COSINE, cosine_direction, face_normals, offset_distance
from bake.low_discrepancy import owen_sobol
from bake.trace import Tracer
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array, World

CLOSE = 1e-3
"""Metres: a surface this close in front of another one is as good as on it."""

PARALLEL = 0.99
"""Cosine from which on two faces count as parallel."""

LAYERS = 8  # partly open faces that a ray passes before it counts as blocked


@dataclass(frozen=True, slots=True)
class Ends:
    """Where rays end, shape (n,) each.

    Attributes:
        distance: Metres; inf where nothing stops the ray.
        face: -1 where nothing does.
        from_behind: The first face met was struck from its back, whether or not it is two-sided.
        proof: It was, and is one-sided: the ray comes from where nobody should be.
    """

    distance: Float32Array
    face: Int32Array
    from_behind: BoolArray
    proof: BoolArray


@dataclass(frozen=True, slots=True)
class Looks:
    """What p points see, one row a point.

    Attributes:
        ao: Shape (p, k), float64.
        stopped: Shape (p,): share of rays that meet anything.
        from_behind: Shape (p,): share of those that strike a face from behind.
        proof: Shape (p,): share of those that strike a one-sided face from behind.
        on_own: Shape (p,): share of those that end on the point's own object.
        covered: Shape (p,): share of all rays that end on a parallel face within `CLOSE`.
    """

    ao: Float64Array
    stopped: Float64Array
    from_behind: Float64Array
    proof: Float64Array
    on_own: Float64Array
    covered: Float64Array


def follow(tracer: Tracer, origins: Float64Array, directions: Float64Array, reach: float) -> Ends:
    """Follows rays through partly open faces, each of which stops a ray with its own share of chance, evenly spread.

    Fog and trees are left out.

    Args:
        tracer: Of the bake.
        origins, directions: Shape (n, 3), relative to `World.origin`; unit directions.
        reach: Metres.
    """
    world, count = tracer.world, len(origins)
    start = np.ascontiguousarray(origins, np.float32)
    ways = np.ascontiguousarray(directions, np.float32)
    distance, face = np.full(count, np.inf, np.float32), np.full(count, -1, np.int32)
    behind, proof = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    gone, through = np.zeros(count), np.ones(count)
    threshold = (0.5 + np.arange(count) * 0.6180339887498949) % 1.0
    active = np.arange(count)
    for layer in range(LAYERS):
        if not len(active):
            break
        hits = tracer.nearest(start[active], ways[active], reach)
        met = hits.face >= 0
        active, found = active[met], hits.face[met]
        if layer == 0:
            behind[active] = hits.cosine[met] > GRAZING_COSINE
            proof[active] = behind[active] & ~world.face_two_sided[found]
        step = hits.distance[met].astype(np.float64)
        through[active] *= world.face_openness[found]
        ends = (through[active] <= threshold[active]) | (layer == LAYERS - 1)
        distance[active[ends]] = (gone[active] + step)[ends]
        face[active[ends]] = found[ends]
        active, step = active[~ends], step[~ends] * (1.0 + 1e-6) + 1e-6
        gone[active] += step
        start[active] += (step[:, None] * ways[active]).astype(np.float32)
    distance[distance > reach] = np.inf
    face[~np.isfinite(distance)] = -1
    return Ends(distance, face, behind, proof)


def look(
    tracer: Tracer, points: Float64Array, normals: Float64Array, owner: Int64Array, extent: Float64Array, rays: int
) -> Looks:
    """What points see over the hemisphere about a normal, cosine-weighted.

    Args:
        tracer: Of the bake.
        points: Shape (p, 3), on faces, relative to `World.origin`.
        normals: Shape (p, 3), unit: the side to look to.
        owner: Shape (p,): the object of each point.
        extent: Shape (p,): longest edge of each point's face, metres.
        rays: Rays from each point.
    """
    count, settings = len(points), tracer.settings
    lift = offset_distance(points, extent)
    origins = np.repeat(points + lift[:, None] * normals, rays, axis=0)
    u, v = owen_sobol(np.tile(np.arange(rays), count), np.repeat(np.arange(count, dtype=np.uint32), rays))
    directions = cosine_direction(u, v, np.repeat(normals, rays, axis=0))
    ends = follow(tracer, origins, directions, settings.trace_distance)
    return _summed(tracer, ends, directions, np.repeat(normals, rays, axis=0), np.repeat(owner, rays), count)


def mean_ao(tracer: Tracer, origins: Float64Array, directions: Float64Array) -> Float64Array:
    """AO by given rays, without fog and trees.

    Args:
        tracer: Of the bake.
        origins: Shape (p, 3), off the surface already.
        directions: Shape (p, r, 3), unit.

    Returns:
        Shape (p, k), float64.
    """
    points, rays = directions.shape[:2]
    reach = tracer.settings.trace_distance
    ends = follow(tracer, np.repeat(origins, rays, axis=0), directions.reshape(-1, 3), reach)
    rho = rho_of(ends.distance, tracer.settings).astype(np.float64)
    rho[ends.face < 0] = 1.0
    return rho.reshape(points, rays, -1).mean(axis=1)


def _summed(
    tracer: Tracer, ends: Ends, directions: Float64Array, normals: Float64Array, owner: Int64Array, points: int
) -> Looks:
    """Means over the rays of each point.

    Args:
        tracer: Of the bake.
        ends: Of all rays, point by point.
        directions: Shape (n, 3): theirs.
        normals: Shape (n, 3): normal of the face that each ray leaves.
        owner: Shape (n,): its object.
        points: How many.
    """
    world = tracer.world
    stopped = ends.face >= 0
    hit = np.maximum(ends.face, 0)
    rho = rho_of(ends.distance, tracer.settings).astype(np.float64)
    rho[~stopped] = 1.0
    close = covering(world, ends.face, ends.distance, directions, normals)

    def share(flags: BoolArray, of: BoolArray | None = None) -> Float64Array:
        total = flags.reshape(points, -1).sum(axis=1)
        whole = flags.size // max(points, 1) if of is None else np.maximum(of.reshape(points, -1).sum(axis=1), 1)
        return total / whole

    return Looks(
        ao=rho.reshape(points, -1, rho.shape[1]).mean(axis=1),
        stopped=share(stopped),
        from_behind=share(stopped & ends.from_behind, stopped),
        proof=share(stopped & ends.proof, stopped),
        on_own=share(stopped & (world.face_object[hit] == owner), stopped),
        covered=share(close),
    )


def covering(
    world: World, face: Int32Array, distance: Float32Array, directions: Float64Array, normals: Float64Array
) -> BoolArray:
    """Whether rays end on a face that lies within `CLOSE` above the one they leave, and parallel to it, shape (n,)."""
    found = np.zeros(len(face), np.bool_)
    struck = np.flatnonzero(face >= 0)
    height = distance[struck] * np.einsum("ij,ij->i", directions[struck], normals[struck])
    near = struck[height < CLOSE]
    if len(near):
        own = face_normals(world.positions, world.faces[face[near]])[0]
        parallel = np.abs(np.einsum("ij,ij->i", own, normals[near])) > PARALLEL
        found[near[parallel]] = True
    return found
