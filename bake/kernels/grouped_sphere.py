"""The gather around points in space with packets of rays, for Embree: see `bake/kernels/packets.py`.

All rays of a packet begin at one point. An aligned block of 2ᵐ points of a (0, 2)-sequence has one in each cell of a
grid of 2ᵐ, so that the cell's number along a Morton curve is a ray's place: sixteen in a row are a cone.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import warp as wp

from bake.kernels.bodies import CLOSEST
from bake.kernels.falloff import Falloff
from bake.kernels.follow import follower_on
from bake.kernels.packets import LANES, RAYS, direction_at, hit_at, put_direction, put_origin, trace_all
from bake.kernels.rays import GOLDEN, SECOND_DIMENSION, THRESHOLD, hash_u32, owen_sobol, to_unit
from bake.kernels.sphere import Points, adder, sphere_direction
from bake.kernels.surface import Surface
from bake.kernels.veil import Veil

wp.set_module_options({"enable_backward": False, "fast_math": False})

BLOCK = LANES * RAYS
"""Rays that the scratch has room for."""

_BITS = 5
_LANES, _BLOCK, _SIDE, _PLACES = (wp.constant(n) for n in (LANES, BLOCK, 1 << _BITS, LANES * RAYS))


@wp.func
def _apart(value: wp.int32) -> wp.int32:
    """Five bits with a zero before each."""
    x = (value | (value << 4)) & 0x0F0F
    x = (x | (x << 2)) & 0x3333
    return (x | (x << 1)) & 0x5555


@wp.func
def _place(uv: wp.vec2, ray: wp.int32, count: wp.int32) -> wp.int32:
    """A ray's place among `count`: its cell, or its own number where they are no power of two."""
    if (count & (count - 1)) != 0:
        return ray
    side = wp.float32(_SIDE)
    return (2 * _apart(wp.int32(uv[0] * side)) + _apart(wp.int32(uv[1] * side))) / (_BLOCK // count)


@cache
def grouped_sphere_kernel(fog: bool, trees: bool, distance_count: int) -> Any:
    """The kernel for a number of distances, with code for what the scene has; its sums are those of `sphere_kernel`."""
    follow_on = follower_on(*CLOSEST["embree"], True)
    sums, added, put = adder(fog, trees, distance_count)

    @wp.kernel(module="unique", enable_backward=False)
    def grouped_sphere(
        entry: wp.uint64,
        scene: wp.uint64,
        surface: Surface,
        veil: Veil,
        points: Points,
        falloff: Falloff,
        packets: wp.int32,
        reals: wp.array(dtype=wp.float32),
        wholes: wp.array(dtype=wp.int32),
        first: wp.int32,
    ):
        p = first + wp.tid()
        origin = points.position[p]
        seed = points.seed[p]
        first_seed = hash_u32(seed)
        second_seed = hash_u32(seed ^ SECOND_DIMENSION)
        threshold_seed = hash_u32(seed ^ THRESHOLD)
        for lane in range(_LANES):
            put_origin(reals, lane, origin)

        total = sums()
        hits = wp.int32(0)
        back_faces = wp.int32(0)
        for begin in range(0, points.directions, _BLOCK):
            count = wp.min(_BLOCK, points.directions - begin)
            rows = (count + _LANES - 1) // _LANES
            for i in range(count):
                uv = owen_sobol(wp.uint32(begin + i), first_seed, second_seed)
                place = _place(uv, i, count)
                wholes[_PLACES + i] = place
                put_direction(reals, place, sphere_direction(uv))
            for i in range(count, rows * _LANES):
                put_direction(reals, i, wp.vec3(0.0, 0.0, 1.0))
            trace_all(entry, scene, reals, wholes, _LANES, rows, falloff.t_max, packets)
            for i in range(count):
                j = begin + i
                place = wholes[_PLACES + i]
                direction = direction_at(reals, place, place % _LANES)
                threshold = to_unit(threshold_seed + wp.uint32(j) * GOLDEN)
                doubtful = (j - hits) * 16 <= j
                fate = follow_on(
                    entry, scene, surface, origin, direction, falloff.t_max, threshold, doubtful,
                    hit_at(reals, wholes, place),
                )  # fmt: skip
                hits += fate.struck
                back_faces += fate.back
                total = added(total, fate, veil, surface, origin, direction, falloff)
        put(points, p, total, hits, back_faces)

    return grouped_sphere
