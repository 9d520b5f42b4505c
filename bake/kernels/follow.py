"""What becomes of one ray among the opaque and partly open faces."""

from __future__ import annotations

from typing import Any

import warp as wp

from bake import geometry
from bake.kernels.closest import Hit, nudged
from bake.kernels.coincident import settler
from bake.kernels.surface import Surface, openness_at

wp.set_module_options({"enable_backward": False, "fast_math": False})

GRAZING_COSINE = wp.constant(geometry.GRAZING_COSINE)
EDGE_BARYCENTRIC = wp.constant(geometry.EDGE_BARYCENTRIC)
MAX_LAYERS = wp.constant(geometry.MAX_LAYERS)
NEXT_AFTER = wp.constant(1.0 + 4.0 * 2.0**-24)
TINY_STEP = wp.constant(1.0e-7)


@wp.struct
class Fate:
    """Where a ray ended.

    `distance` is that of the face that stopped it, or `t_max` where none did (`stopped` 0). `struck` and `back` tell of
    the first face it met, whether or not that stopped it. `stopper` and `first` are those faces' primitives, and mean
    nothing where there is none.
    """

    distance: wp.float32
    stopped: wp.int32
    struck: wp.int32
    back: wp.int32
    stopper: wp.int32
    first: wp.int32


@wp.func
def strikes_back(surface: Surface, hit: Hit) -> wp.bool:
    """Whether a hit proves that the ray came from behind a one-sided face."""
    third = 1.0 - hit.weights[0] - hit.weights[1]
    smallest = wp.min(third, wp.min(hit.weights[0], hit.weights[1]))
    inside = hit.cosine > GRAZING_COSINE and smallest > EDGE_BARYCENTRIC
    return inside and surface.two_sided[hit.primitive] == wp.uint8(0)


def follower(closest_hit: Any, leaks_at_vertices: bool) -> Any:
    """The device function that follows a ray from its origin, over one way of finding closest hits."""
    follow_on = follower_on(closest_hit, leaks_at_vertices, False)

    @wp.func
    def follow(
        entry: wp.uint64,
        scene: wp.uint64,
        surface: Surface,
        origin: wp.vec3,
        direction: wp.vec3,
        t_max: wp.float32,
        threshold: wp.float32,
        doubtful: wp.bool,
    ) -> Fate:
        return follow_on(entry, scene, surface, origin, direction, t_max, threshold, doubtful, Hit())

    return follow


def follower_on(closest_hit: Any, leaks_at_vertices: bool, first_known: bool) -> Any:
    """The device function that follows a ray whose first closest hit may be known already.

    A partly open face stops the rays whose threshold their transmittance falls to.

    A tracer that lets one in a thousand of the rays aimed exactly at a vertex through gets a second look: a doubtful
    escape is believed only if the ray's twin, turned by 10⁻⁵, escapes as well. The caller doubts where hardly a ray
    escaped so far, which costs at most a sixteenth more rays where a surface is nearly closed off, and one ray
    elsewhere.
    """
    second_look = wp.constant(leaks_at_vertices)
    given = wp.constant(first_known)
    settled = settler(closest_hit)

    @wp.func
    def follow_on(
        entry: wp.uint64,
        scene: wp.uint64,
        surface: Surface,
        origin: wp.vec3,
        direction: wp.vec3,
        t_max: wp.float32,
        threshold: wp.float32,
        doubtful: wp.bool,
        first: Hit,
    ) -> Fate:
        fate = Fate()
        fate.distance = t_max
        through = wp.float32(1.0)
        t_min = wp.float32(0.0)
        for layer in range(MAX_LAYERS):
            hit = first
            if not given or layer > 0:
                hit = closest_hit(entry, scene, origin, direction, t_min, t_max)
            if second_look and hit.primitive < 0 and layer == 0 and doubtful:
                hit = closest_hit(entry, scene, origin, nudged(direction), t_min, t_max)
            if hit.primitive < 0:
                break
            passes = openness_at(surface, hit.primitive, hit.weights)
            if passes > 0.0 or (layer == 0 and strikes_back(surface, hit)):
                hit = settled(entry, scene, origin, direction, t_min, hit)
                passes = openness_at(surface, hit.primitive, hit.weights)
            if layer == 0:
                fate.struck = 1
                fate.first = hit.primitive
                if strikes_back(surface, hit):
                    fate.back = 1
            through = through * passes
            if through <= threshold or layer == MAX_LAYERS - 1:
                fate.distance = hit.distance
                fate.stopped = 1
                fate.stopper = hit.primitive
                break
            t_min = hit.distance * NEXT_AFTER + TINY_STEP
        return fate

    return follow_on
