"""The fused kernel: generate, trace, weigh and sum; nothing per ray leaves the device."""

from __future__ import annotations

from functools import cache
from typing import Any

import warp as wp

from bake.kernels.bodies import CLOSEST
from bake.kernels.closest import nudged
from bake.kernels.falloff import Falloff, vec8
from bake.kernels.follow import follower
from bake.kernels.surface import Surface
from bake.kernels.veil import Veil, dimmer
from bake.kernels.veiled import veiled_obscurance_kernel
from bake.kernels.work import Work, fan_of, ray_direction, ray_threshold

wp.set_module_options({"enable_backward": False, "fast_math": False})

RAYS_AT_ONCE = {"embree": 32, "warp": 1}
"""Rays that wait for their walk through fog and trees; on CUDA each would cost memory that threads do not have."""


def _obscurance_kernel(closest_hit: Any, leaks_at_vertices: bool) -> Any:
    """The kernel over one way of finding closest hits, for scenes without fog and trees."""
    follow = follower(closest_hit, leaks_at_vertices)

    @wp.kernel(module="unique", enable_backward=False)
    def obscurance(
        entry: wp.uint64,
        scene: wp.uint64,
        surface: Surface,
        veil: Veil,
        work: Work,
        falloff: Falloff,
        first: wp.int32,
    ):
        s = first + wp.tid()
        fan = fan_of(surface, work, s)
        blocked = vec8()
        hits = wp.int32(0)
        back_faces = wp.int32(0)
        for j in range(work.rays):
            direction = ray_direction(fan, j)
            doubtful = (j - hits) * 16 <= j
            threshold = ray_threshold(fan, j)
            fate = follow(entry, scene, surface, fan.point, direction, falloff.t_max, threshold, doubtful)
            hits += fate.struck
            back_faces += fate.back
            if fate.stopped == 1:
                for k in range(falloff.count):
                    blocked[k] += wp.exp(falloff.rates[k] * fate.distance)  # 1 - ρ
        for k in range(falloff.count):
            work.ao[s, k] = wp.max(0.0, 1.0 - blocked[k] / wp.float32(work.rays))
        work.hits[s] = wp.uint16(hits)
        work.back_faces[s] = wp.uint16(back_faces)

    return obscurance


def _nearest_kernel(closest_hit: Any, leaks_at_vertices: bool) -> Any:
    """The kernel behind `Tracer.nearest`: plain rays in, closest hits out."""
    second_look = wp.constant(leaks_at_vertices)

    @wp.kernel(module="unique", enable_backward=False)
    def nearest(
        entry: wp.uint64,
        scene: wp.uint64,
        cast_face: wp.array(dtype=wp.int32),
        origins: wp.array(dtype=wp.vec3),
        directions: wp.array(dtype=wp.vec3),
        t_max: wp.float32,
        # Out:
        distance: wp.array(dtype=wp.float32),
        face: wp.array(dtype=wp.int32),
        cosine: wp.array(dtype=wp.float32),
        weights: wp.array(dtype=wp.vec2),
        first: wp.int32,
    ):
        i = first + wp.tid()
        hit = closest_hit(entry, scene, origins[i], directions[i], 0.0, t_max)
        if second_look and hit.primitive < 0:
            hit = closest_hit(entry, scene, origins[i], nudged(directions[i]), 0.0, t_max)
        face[i] = -1
        distance[i] = wp.inf
        if hit.primitive >= 0:
            face[i] = cast_face[hit.primitive]
            distance[i] = hit.distance
            cosine[i] = hit.cosine
            weights[i] = hit.weights

    return nearest


def _transmittance_kernel(fog: bool, trees: bool) -> Any:
    """The kernel behind `Tracer.transmittance`."""
    dimmed = dimmer(fog, trees)

    @wp.kernel(module="unique", enable_backward=False)
    def transmittance(
        surface: Surface,
        veil: Veil,
        origins: wp.array(dtype=wp.vec3),
        directions: wp.array(dtype=wp.vec3),
        distance: wp.float32,
        # Out:
        passes: wp.array(dtype=wp.float32),
        first: wp.int32,
    ):
        i = first + wp.tid()
        passes[i] = dimmed(veil, surface, origins[i], directions[i], distance)

    return transmittance


@cache
def obscurance_kernel(tracer: str, fog: bool, trees: bool) -> Any:
    """The fused kernel for "embree" or "warp", compiled at its first launch."""
    if fog or trees:
        return veiled_obscurance_kernel(*CLOSEST[tracer], fog, trees, RAYS_AT_ONCE[tracer.partition("-")[0]])
    return _obscurance_kernel(*CLOSEST[tracer])


@cache
def nearest_kernel(tracer: str) -> Any:
    """The plain-ray kernel for "embree" or "warp", compiled at its first launch."""
    return _nearest_kernel(*CLOSEST[tracer])


@cache
def transmittance_kernel(fog: bool, trees: bool) -> Any:
    """The kernel for what dims plain rays, compiled at its first launch."""
    return _transmittance_kernel(fog, trees)
