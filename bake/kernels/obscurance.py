"""The fused kernel: generate, trace, weigh and sum; nothing per ray leaves the device."""

from __future__ import annotations

from functools import cache
from typing import Any

import warp as wp

from bake import geometry
from bake.kernels import closest
from bake.kernels.closest import Hit, nudged
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
from bake.kernels.surface import Surface, openness_at, sample_origin

wp.set_module_options({"enable_backward": False, "fast_math": False})

MAX_DISTANCES = 8
vec8 = wp.types.vector(length=MAX_DISTANCES, dtype=wp.float32)

GRAZING_COSINE = wp.constant(geometry.GRAZING_COSINE)
EDGE_BARYCENTRIC = wp.constant(geometry.EDGE_BARYCENTRIC)
MAX_LAYERS = wp.constant(geometry.MAX_LAYERS)
NEXT_AFTER = wp.constant(1.0 + 4.0 * 2.0**-24)
TINY_STEP = wp.constant(1.0e-7)


@wp.struct
class Falloff:
    """What a hit counts for: ρ(d) = 1 - exp(rate × d) for each of `count` distances; rate 0: ρ = 0."""

    rates: vec8
    count: wp.int32
    t_max: wp.float32


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


@wp.func
def strikes_back(surface: Surface, hit: Hit) -> wp.bool:
    """Whether a hit proves that the ray came from behind a one-sided face."""
    third = 1.0 - hit.weights[0] - hit.weights[1]
    smallest = wp.min(third, wp.min(hit.weights[0], hit.weights[1]))
    inside = hit.cosine > GRAZING_COSINE and smallest > EDGE_BARYCENTRIC
    return inside and surface.two_sided[hit.primitive] == wp.uint8(0)


def _obscurance_kernel(closest_hit: Any, leaks_at_vertices: bool) -> Any:
    """The kernel over one way of finding closest hits.

    A tracer that lets one in a thousand of the rays aimed exactly at a vertex through gets a second look: where hardly
    a ray of the sample escaped so far, an escape is believed only if the ray's twin, turned by 10⁻⁵, escapes as well.
    This costs at most a sixteenth more rays where a surface is nearly closed off, and one ray elsewhere.
    """
    second_look = wp.constant(leaks_at_vertices)

    @wp.kernel(module="unique", enable_backward=False)
    def obscurance(entry: wp.uint64, scene: wp.uint64, surface: Surface, work: Work, falloff: Falloff, first: wp.int32):
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

            # A partly open face stops the rays whose threshold its transmittance falls to.
            threshold = to_unit(threshold_seed + (block + wp.uint32(j)) * GOLDEN)
            through = wp.float32(1.0)
            t_min = wp.float32(0.0)
            for layer in range(MAX_LAYERS):
                hit = closest_hit(entry, scene, origin.point, direction, t_min, falloff.t_max)
                if second_look and hit.primitive < 0 and layer == 0 and (j - hits) * 16 <= j:
                    hit = closest_hit(entry, scene, origin.point, nudged(direction), t_min, falloff.t_max)
                if hit.primitive < 0:
                    break
                if layer == 0:
                    hits += 1
                    if strikes_back(surface, hit):
                        back_faces += 1
                through = through * openness_at(surface, hit.primitive, hit.weights)
                if through <= threshold or layer == MAX_LAYERS - 1:
                    for k in range(falloff.count):
                        blocked[k] += wp.exp(falloff.rates[k] * hit.distance)  # 1 - ρ
                    break
                t_min = hit.distance * NEXT_AFTER + TINY_STEP
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


@cache
def obscurance_kernel(tracer: str) -> Any:
    """The fused kernel for "embree" or "warp", compiled at its first launch."""
    return _obscurance_kernel(*_CLOSEST[tracer])


@cache
def nearest_kernel(tracer: str) -> Any:
    """The plain-ray kernel for "embree" or "warp", compiled at its first launch."""
    return _nearest_kernel(*_CLOSEST[tracer])


# How each tracer finds a closest hit, and whether it may leak at vertices.
_CLOSEST = {"embree": (closest.embree_closest, True), "warp": (closest.bvh_closest, False)}
