"""The fused kernel: generate, trace, weigh and sum; nothing per ray leaves the device."""

from __future__ import annotations

from functools import cache
from typing import Any

import warp as wp

from bake.kernels.bodies import CLOSEST
from bake.kernels.closest import nudged
from bake.kernels.falloff import Falloff, vec8
from bake.kernels.follow import follower
from bake.kernels.rays import (
    GOLDEN,
    SECOND_DIMENSION,
    THRESHOLD,
    above_face,
    concentric_disc,
    first_tangent,
    hash_u32,
    owen_sobol,
    to_unit,
)
from bake.kernels.surface import Surface, sample_origin
from bake.kernels.veil import Veil, dimmer

wp.set_module_options({"enable_backward": False, "fast_math": False})


@wp.struct
class Work:
    """The samples of a bake and where their tallies go."""

    face: wp.array(dtype=wp.int32)
    barycentric: wp.array(dtype=wp.vec2)
    index: wp.array(dtype=wp.int32)
    face_seed: wp.array(dtype=wp.uint32)
    rays: wp.int32
    # Out:
    ao: wp.array2d(dtype=wp.float32)
    hits: wp.array(dtype=wp.uint16)
    back_faces: wp.array(dtype=wp.uint16)


def _obscurance_kernel(closest_hit: Any, leaks_at_vertices: bool, fog: bool, trees: bool) -> Any:
    """The kernel over one way of finding closest hits, with code for fog and trees only where the scene has them."""
    follow = follower(closest_hit, leaks_at_vertices)
    dimmed = dimmer(fog, trees)
    veiled = fog or trees

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
        face = work.face[s]
        origin = sample_origin(surface, face, work.barycentric[s])
        tangent = first_tangent(origin.shading_normal)
        bitangent = wp.cross(origin.shading_normal, tangent)
        seed = work.face_seed[face]
        first_seed = hash_u32(seed)
        second_seed = hash_u32(seed ^ SECOND_DIMENSION)
        threshold_seed = hash_u32(seed ^ THRESHOLD)
        block = wp.uint32(work.index[s]) * wp.uint32(work.rays)

        blocked = vec8()
        hits = wp.int32(0)
        back_faces = wp.int32(0)
        for j in range(work.rays):
            disc = concentric_disc(owen_sobol(block + wp.uint32(j), first_seed, second_seed))
            height = wp.sqrt(wp.max(0.0, 1.0 - disc[0] * disc[0] - disc[1] * disc[1]))
            direction = disc[0] * tangent + disc[1] * bitangent + height * origin.shading_normal
            direction = above_face(direction, origin.face_normal)

            threshold = to_unit(threshold_seed + (block + wp.uint32(j)) * GOLDEN)
            doubtful = (j - hits) * 16 <= j
            fate = follow(entry, scene, surface, origin.point, direction, falloff.t_max, threshold, doubtful)
            hits += fate.struck
            back_faces += fate.back
            if veiled:
                passes = dimmed(veil, surface, origin.point, direction, fate.distance)
                for k in range(falloff.count):
                    near = wp.float32(0.0)
                    if fate.stopped == 1:
                        near = wp.exp(falloff.rates[k] * fate.distance)
                    blocked[k] += (1.0 - passes) + near * passes  # 1 - ρ × what passes
            else:
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
    return _obscurance_kernel(*CLOSEST[tracer], fog, trees)


@cache
def nearest_kernel(tracer: str) -> Any:
    """The plain-ray kernel for "embree" or "warp", compiled at its first launch."""
    return _nearest_kernel(*CLOSEST[tracer])


@cache
def transmittance_kernel(fog: bool, trees: bool) -> Any:
    """The kernel for what dims plain rays, compiled at its first launch."""
    return _transmittance_kernel(fog, trees)
