"""Reads baked AO off the surface within spheres; `bake/decorators/resample.py` holds the twin in NumPy and the method.

A sphere is one thread: it widens by itself until enough of its rays meet surface that counts, so that no ray and no hit
ever lies in memory. Where a ray slips between two triangles, one in thirty-two is lost: there is no second look.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import warp as wp

from bake import decorator_types, geometry
from bake.kernels.bodies import CLOSEST
from bake.kernels.falloff import MAX_DISTANCES
from bake.kernels.surface import Surface, corner

wp.set_module_options({"enable_backward": False, "fast_math": False})

vec8d = wp.types.vector(length=MAX_DISTANCES, dtype=wp.float64)

ENOUGH = wp.constant(decorator_types.READ_ENOUGH)
DOUBLINGS = wp.constant(decorator_types.READ_DOUBLINGS)
LAYERS = wp.constant(decorator_types.READ_LAYERS)
LEAST_WEIGHT = wp.constant(wp.float64(decorator_types.READ_LEAST_WEIGHT))
SLACK = wp.constant(wp.float64(geometry.OFFSET_ULPS * 2.0**-24))


@wp.struct
class Reading:
    """Spheres, what counts for them, and what they found."""

    centre: wp.array(dtype=wp.vec3d)
    least: wp.array(dtype=wp.float64)
    most: wp.array(dtype=wp.float64)
    row: wp.array(dtype=wp.int32)
    own_face: wp.array(dtype=wp.int32)
    # The same for all of a reader's:
    counts: wp.array2d(dtype=wp.uint8)
    carries: wp.array(dtype=wp.uint8)
    ao: wp.array2d(dtype=wp.float32)
    outward: wp.array(dtype=wp.vec3d)
    # Out:
    mean: wp.array2d(dtype=wp.float64)
    hits: wp.array(dtype=wp.int32)
    rays: wp.array(dtype=wp.int32)


@wp.func
def rounded(v: wp.vec3d) -> wp.vec3:
    """In float32."""
    return wp.vec3(wp.float32(v[0]), wp.float32(v[1]), wp.float32(v[2]))


@wp.func
def crossed_edges(surface: Surface, face: wp.int32) -> wp.vec3d:
    """A face's normal, twice its area long."""
    a = corner(surface, face, 0)
    return wp.cross(corner(surface, face, 1) - a, corner(surface, face, 2) - a)


@wp.func
def admitted(surface: Surface, reading: Reading, sphere: wp.int32, primitive: wp.int32, own: wp.vec3d) -> wp.bool:
    """Whether a hit counts: it carries AO, belongs to the right object and faces the right way."""
    face = surface.cast_face[primitive]
    if reading.carries[face] == wp.uint8(0):
        return False
    row = reading.row[sphere]
    if row >= 0:  # noqa: SIM102  (on the device both sides of an `and` are computed)
        if reading.counts[row, surface.face_object[face]] == wp.uint8(0):
            return False
    if reading.own_face[sphere] >= 0 and surface.two_sided[primitive] == wp.uint8(0):
        return wp.dot(own, crossed_edges(surface, face)) > wp.float64(0.0)
    return True


@wp.func
def added(
    surface: Surface, reading: Reading, sums: vec8d, face: wp.int32, weights: wp.vec2, depth: wp.float64
) -> vec8d:
    """Sums with AO, interpolated at a hit, added by its weight."""
    u = wp.clamp(wp.float64(weights[0]), wp.float64(0.0), wp.float64(1.0))
    v = wp.clamp(wp.float64(weights[1]), wp.float64(0.0), wp.float64(1.0))
    w = wp.max(wp.float64(1.0) - (u + v), wp.float64(0.0))
    scale = depth / (u + v + w)
    a = surface.faces[3 * face]
    b = surface.faces[3 * face + 1]
    c = surface.faces[3 * face + 2]
    for k in range(reading.ao.shape[1]):
        value = u * wp.float64(reading.ao[a, k]) + v * wp.float64(reading.ao[b, k]) + w * wp.float64(reading.ao[c, k])
        sums[k] = sums[k] + scale * value
    return sums


@cache
def reading_kernel(tracer: str) -> Any:
    """The kernel for "embree" or "warp", compiled at its first launch."""
    closest_hit, _ = CLOSEST[tracer]

    @wp.kernel(module="unique", enable_backward=False)
    def read(
        entry: wp.uint64,
        scene: wp.uint64,
        surface: Surface,
        reading: Reading,
        first: wp.int32,
    ):
        s = first + wp.tid()
        centre = reading.centre[s]
        own = wp.vec3d()
        if reading.own_face[s] >= 0:
            own = crossed_edges(surface, reading.own_face[s])
        largest = wp.max(wp.abs(centre[0]), wp.max(wp.abs(centre[1]), wp.abs(centre[2])))
        radius = wp.min(reading.least[s], reading.most[s])
        count = reading.outward.shape[0]
        sent = wp.int32(0)
        reading.hits[s] = 0
        for k in range(reading.ao.shape[1]):
            reading.mean[s, k] = wp.float64(1.0)
        for _doubling in range(DOUBLINGS):
            slack = SLACK * (largest + radius)
            total = wp.float64(0.0)
            sums = vec8d()
            found = wp.int32(0)
            for j in range(count):
                outward = reading.outward[j]
                start = centre + radius * outward
                travelled = wp.float64(0.0)
                last = wp.int32(-1)
                weights = wp.vec2()
                depth = wp.float64(0.0)
                for _layer in range(LAYERS):
                    left = radius + slack - travelled
                    origin = rounded(start - travelled * outward)
                    hit = closest_hit(entry, scene, origin, rounded(-outward), 0.0, wp.float32(left))
                    sent += 1
                    if hit.primitive < 0 or wp.float64(hit.distance) > left:
                        break
                    travelled = travelled + wp.float64(hit.distance)
                    if admitted(surface, reading, s, hit.primitive, own):
                        last = surface.cast_face[hit.primitive]
                        weights = hit.weights
                        depth = travelled
                    travelled = travelled + slack
                    if travelled >= radius:
                        break
                if last >= 0:
                    found += 1
                    depth = wp.clamp(depth / radius, LEAST_WEIGHT, wp.float64(1.0))
                    total = total + depth
                    sums = added(surface, reading, sums, last, weights, depth)
            if found > 0:
                reading.hits[s] = found
                for k in range(reading.ao.shape[1]):
                    reading.mean[s, k] = wp.clamp(sums[k] / total, wp.float64(0.0), wp.float64(1.0))
            if found * ENOUGH >= count or radius >= reading.most[s]:
                break
            radius = wp.min(wp.float64(2.0) * radius, reading.most[s])
        reading.rays[s] = sent

    return read
