"""The fused gather over the whole sphere: what is open in every direction, projected to spherical harmonics at once."""

from __future__ import annotations

from functools import cache
from typing import Any

import warp as wp

from bake import spherical_harmonics
from bake.kernels.bodies import CLOSEST
from bake.kernels.falloff import Falloff
from bake.kernels.follow import Fate, follower
from bake.kernels.rays import GOLDEN, SECOND_DIMENSION, THRESHOLD, hash_u32, owen_sobol, to_unit
from bake.kernels.surface import Surface
from bake.kernels.veil import Veil, dimmer

wp.set_module_options({"enable_backward": False, "fast_math": False})

TWO_PI = wp.constant(6.283185307179586)
FOUR_PI = wp.constant(12.566370614359172)
Y0 = wp.constant(spherical_harmonics.Y0)
Y1 = wp.constant(spherical_harmonics.Y1)
Y2_PRODUCT = wp.constant(spherical_harmonics.Y2_PRODUCT)
Y2_ZONAL = wp.constant(spherical_harmonics.Y2_ZONAL)
Y2_DIFFERENCE = wp.constant(spherical_harmonics.Y2_DIFFERENCE)

vec9 = wp.types.vector(length=spherical_harmonics.COUNT, dtype=wp.float32)


@wp.struct
class Points:
    """Where to gather, and where the results go."""

    position: wp.array(dtype=wp.vec3)
    seed: wp.array(dtype=wp.uint32)
    directions: wp.int32
    # Out:
    sh: wp.array3d(dtype=wp.float32)
    hits: wp.array(dtype=wp.uint16)
    back_faces: wp.array(dtype=wp.uint16)


@wp.func
def sphere_direction(uv: wp.vec2) -> wp.vec3:
    """Unit square to unit sphere, area-preserving; the twin of `geometry.sphere_direction`."""
    z = 1.0 - 2.0 * uv[0]
    radius = wp.sqrt(wp.max(0.0, 1.0 - z * z))
    angle = TWO_PI * uv[1]
    return wp.vec3(radius * wp.cos(angle), radius * wp.sin(angle), z)


@wp.func
def basis(d: wp.vec3) -> vec9:
    """The twin of `spherical_harmonics.evaluate`."""
    x = d[0]
    y = d[1]
    z = d[2]
    return vec9(
        Y0,
        Y1 * y,
        Y1 * z,
        Y1 * x,
        Y2_PRODUCT * x * y,
        Y2_PRODUCT * y * z,
        Y2_ZONAL * (3.0 * z * z - 1.0),
        Y2_PRODUCT * x * z,
        Y2_DIFFERENCE * (x * x - y * y),
    )


def adder(fog: bool, trees: bool, distance_count: int) -> tuple[Any, Any, Any]:
    """The type of the sums over a point's rays, and device functions that add a ray to them and put them down.

    They are made for a number of distances, so that the sums stay in registers.
    """
    dimmed = dimmer(fog, trees)
    veiled = wp.constant(fog or trees)
    sums = wp.types.matrix(shape=(distance_count, spherical_harmonics.COUNT), dtype=wp.float32)
    columns = wp.constant(distance_count)

    @wp.func
    def added(
        total: Any,
        fate: Fate,
        veil: Veil,
        surface: Surface,
        origin: wp.vec3,
        direction: wp.vec3,
        falloff: Falloff,
    ):
        weights = basis(direction)
        if veiled:
            weights = weights * dimmed(veil, surface, origin, direction, fate.distance)
        result = sums()
        for k in range(columns):
            share = wp.float32(1.0)
            if fate.stopped == 1:
                share = 1.0 - wp.exp(falloff.rates[k] * fate.distance)  # ρ
            result[k] = total[k] + share * weights
        return result

    @wp.func
    def put(points: Points, p: wp.int32, total: Any, hits: wp.int32, back_faces: wp.int32):
        scale = FOUR_PI / wp.float32(points.directions)
        for k in range(columns):
            for c in range(9):
                points.sh[p, c, k] = scale * total[k, c]
        points.hits[p] = wp.uint16(hits)
        points.back_faces[p] = wp.uint16(back_faces)

    return sums, added, put


def _sphere_kernel(closest_hit: Any, leaks_at_vertices: bool, fog: bool, trees: bool, distance_count: int) -> Any:
    """The kernel over one way of finding closest hits, with code for what the scene has."""
    follow = follower(closest_hit, leaks_at_vertices)
    sums, added, put = adder(fog, trees, distance_count)

    @wp.kernel(module="unique", enable_backward=False)
    def sphere(
        entry: wp.uint64,
        scene: wp.uint64,
        surface: Surface,
        veil: Veil,
        points: Points,
        falloff: Falloff,
        first: wp.int32,
    ):
        p = first + wp.tid()
        origin = points.position[p]
        seed = points.seed[p]
        first_seed = hash_u32(seed)
        second_seed = hash_u32(seed ^ SECOND_DIMENSION)
        threshold_seed = hash_u32(seed ^ THRESHOLD)

        total = sums()
        hits = wp.int32(0)
        back_faces = wp.int32(0)
        for j in range(points.directions):
            direction = sphere_direction(owen_sobol(wp.uint32(j), first_seed, second_seed))
            threshold = to_unit(threshold_seed + wp.uint32(j) * GOLDEN)
            doubtful = (j - hits) * 16 <= j
            fate = follow(entry, scene, surface, origin, direction, falloff.t_max, threshold, doubtful)
            hits += fate.struck
            back_faces += fate.back
            total = added(total, fate, veil, surface, origin, direction, falloff)
        put(points, p, total, hits, back_faces)

    return sphere


@cache
def sphere_kernel(tracer: str, fog: bool, trees: bool, distance_count: int) -> Any:
    """The gather for "embree" or "warp", compiled at its first launch."""
    return _sphere_kernel(*CLOSEST[tracer], fog, trees, distance_count)
