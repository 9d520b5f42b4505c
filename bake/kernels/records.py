"""The rays of chosen samples once more, each on record: the same sequence as the fused kernel, nothing summed.

A second kernel only asks which samples have a ray that meets an object at all.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import warp as wp

from bake.kernels.bodies import CLOSEST
from bake.kernels.closest import nudged
from bake.kernels.coincident import settler
from bake.kernels.follow import MAX_LAYERS, NEXT_AFTER, TINY_STEP, follower
from bake.kernels.rays import above_face
from bake.kernels.surface import Surface, openness_at
from bake.kernels.veil import Veil, dimmer
from bake.kernels.veil_list import list_boxes, list_leaves
from bake.kernels.work import Fan, drawn, fan_at, ray_direction, ray_threshold

wp.set_module_options({"enable_backward": False, "fast_math": False})

STOPPED = wp.constant(wp.uint8(1))
STRUCK = wp.constant(wp.uint8(2))
BACK = wp.constant(wp.uint8(4))
MIRRORED = wp.constant(wp.uint8(8))


@wp.struct
class Chosen:
    """Samples whose rays are wanted; as `Work` of the fused kernel, without its sums."""

    face: wp.array(dtype=wp.int32)
    barycentric: wp.array(dtype=wp.vec2)
    index: wp.array(dtype=wp.int32)
    face_seed: wp.array(dtype=wp.uint32)
    rays: wp.int32


@wp.struct
class Records:
    """One entry a ray, sample by sample; `origin` one a sample."""

    origin: wp.array(dtype=wp.vec3)
    direction: wp.array(dtype=wp.vec3)
    distance: wp.array(dtype=wp.float32)
    face: wp.array(dtype=wp.int32)
    first_face: wp.array(dtype=wp.int32)
    passes: wp.array(dtype=wp.float32)
    flags: wp.array(dtype=wp.uint8)


@wp.func
def fan_among(surface: Surface, chosen: Chosen, s: wp.int32) -> Fan:
    """The rays of sample `s`."""
    face = chosen.face[s]
    return fan_at(surface, face, chosen.barycentric[s], chosen.face_seed[face], chosen.index[s], chosen.rays)


@cache
def record_kernel(tracer: str, fog: bool, trees: bool) -> Any:
    """Puts every ray of the chosen samples on record; for "embree" or "warp"."""
    follow = follower(*CLOSEST[tracer])
    dimmed = dimmer(fog, trees)
    veiled = fog or trees

    @wp.kernel(module="unique", enable_backward=False)
    def record(
        entry: wp.uint64,
        scene: wp.uint64,
        surface: Surface,
        veil: Veil,
        chosen: Chosen,
        t_max: wp.float32,
        out: Records,
        first: wp.int32,
    ):
        s = first + wp.tid()
        fan = fan_among(surface, chosen, s)
        out.origin[s] = fan.point
        hits = wp.int32(0)
        for j in range(chosen.rays):
            flags = wp.uint8(0)
            wanted = drawn(fan, j)
            direction = above_face(wanted, fan.face_normal)
            if wp.dot(wanted, fan.face_normal) < 0.0:
                flags = flags | MIRRORED
            doubtful = (j - hits) * 16 <= j
            fate = follow(entry, scene, surface, fan.point, direction, t_max, ray_threshold(fan, j), doubtful)
            hits += fate.struck

            i = s * chosen.rays + j
            out.direction[i] = direction
            out.distance[i] = fate.distance
            out.face[i] = -1
            out.first_face[i] = -1
            out.passes[i] = 1.0
            if fate.stopped == 1:
                flags = flags | STOPPED
                out.face[i] = surface.cast_face[fate.stopper]
            if fate.struck == 1:
                flags = flags | STRUCK
                out.first_face[i] = surface.cast_face[fate.first]
            if fate.back == 1:
                flags = flags | BACK
            if veiled:
                out.passes[i] = dimmed(veil, surface, fan.point, direction, fate.distance)
            out.flags[i] = flags

    return record


@cache
def meets_kernel(tracer: str) -> Any:
    """Which of the chosen samples have a ray that meets an object; for "embree" or "warp".

    Only rays that cross one of some boxes are traced. A ray meets the object if one of its faces stops it or lets it
    through; of an object without such faces, crossing a box is enough.
    """
    closest_hit, leaks_at_vertices = CLOSEST[tracer]
    second_look = wp.constant(leaks_at_vertices)
    settled = settler(closest_hit)

    @wp.func
    def met(
        entry: wp.uint64,
        scene: wp.uint64,
        surface: Surface,
        origin: wp.vec3,
        direction: wp.vec3,
        t_max: wp.float32,
        threshold: wp.float32,
        wanted: wp.int32,
    ) -> wp.bool:
        through = wp.float32(1.0)
        t_min = wp.float32(0.0)
        for layer in range(MAX_LAYERS):
            hit = closest_hit(entry, scene, origin, direction, t_min, t_max)
            if second_look and hit.primitive < 0 and layer == 0:
                hit = closest_hit(entry, scene, origin, nudged(direction), t_min, t_max)
            if hit.primitive < 0:
                return False
            passes = openness_at(surface, hit.primitive, hit.weights)
            if passes > 0.0:
                hit = settled(entry, scene, origin, direction, t_min, hit)
                passes = openness_at(surface, hit.primitive, hit.weights)
            if surface.face_object[surface.cast_face[hit.primitive]] == wanted:
                return True
            through = through * passes
            if through <= threshold:
                return False
            t_min = hit.distance * NEXT_AFTER + TINY_STEP
        return False

    @wp.func
    def crosses(low: wp.vec3, high: wp.vec3, origin: wp.vec3, direction: wp.vec3, t_max: wp.float32) -> wp.bool:
        enter = wp.float32(0.0)
        leave = t_max
        for axis in range(3):
            d = direction[axis]
            d = wp.where(wp.abs(d) < 1.0e-20, 1.0e-20, d)
            a = (low[axis] - origin[axis]) / d
            b = (high[axis] - origin[axis]) / d
            enter = wp.max(enter, wp.min(a, b))
            leave = wp.min(leave, wp.max(a, b))
        return enter * 0.999999 <= leave * 1.000001 + 1.0e-6

    @wp.func
    def above(low: wp.vec3, high: wp.vec3, origin: wp.vec3, normal: wp.vec3) -> wp.bool:
        farthest = wp.float32(0.0)
        for axis in range(3):
            farthest += normal[axis] * (wp.where(normal[axis] > 0.0, high[axis], low[axis]) - origin[axis])
        return farthest > -1.0e-4

    @wp.kernel(module="unique", enable_backward=False)
    def meets(
        entry: wp.uint64,
        scene: wp.uint64,
        surface: Surface,
        chosen: Chosen,
        t_max: wp.float32,
        wanted: wp.int32,
        low: wp.array(dtype=wp.vec3),
        high: wp.array(dtype=wp.vec3),
        # Out:
        found: wp.array(dtype=wp.uint8),
        first: wp.int32,
    ):
        s = first + wp.tid()
        fan = fan_among(surface, chosen, s)
        rays = wp.int32(0)  # none of a box that lies below the face is ever met
        for box in range(low.shape[0]):
            if above(low[box], high[box], fan.point, fan.face_normal):
                rays = chosen.rays
        for j in range(rays):
            direction = ray_direction(fan, j)
            near = wp.bool(False)
            for box in range(low.shape[0]):
                if not near:
                    near = crosses(low[box], high[box], fan.point, direction, t_max)
            if near:
                if wanted >= 0:
                    near = met(entry, scene, surface, fan.point, direction, t_max, ray_threshold(fan, j), wanted)
                if near:
                    found[s] = wp.uint8(1)
                    break

    return meets


@cache
def crossings_kernel(fog: bool, trees: bool) -> Any:
    """Lists the fog boxes and leaves that rays cross: counts them where there is no room yet."""

    @wp.kernel(module="unique", enable_backward=False)
    def crossings(
        surface: Surface,
        veil: Veil,
        origins: wp.array(dtype=wp.vec3),
        directions: wp.array(dtype=wp.vec3),
        distance: wp.array(dtype=wp.float32),
        rays: wp.int32,
        begin: wp.array(dtype=wp.int64),
        # Out:
        boxes: wp.array(dtype=wp.int32),
        leaves: wp.array(dtype=wp.int32),
        place: wp.array(dtype=wp.int32),
        depth: wp.array(dtype=wp.float32),
        first: wp.int32,
    ):
        i = first + wp.tid()
        origin = origins[i / rays]
        write = wp.int64(-1)
        if begin.shape[0] > 0:
            write = begin[i]
        if fog:
            boxes[i] = list_boxes(
                veil.bounds, veil.node, veil.density, origin, directions[i], distance[i], place, depth, write
            )
        if trees:
            if write >= wp.int64(0) and fog:
                write = write + wp.int64(boxes[i])
            count = list_leaves(
                veil.trees, 0, veil.tree_depth, veil.tree_transmission, veil.tree_texture,
                veil.tree_uvs, surface.texture_first, surface.texture_width, surface.texture_height, surface.texels,
                origin, directions[i], distance[i], place, depth, write,
            )  # fmt: skip
            if veil.added != wp.uint64(0):
                if write >= wp.int64(0):
                    write = write + wp.int64(count)
                count += list_leaves(
                    veil.added, veil.first_added, veil.tree_depth, veil.tree_transmission, veil.tree_texture,
                    surface.uvs, surface.texture_first, surface.texture_width, surface.texture_height, surface.texels,
                    origin, directions[i], distance[i], place, depth, write,
                )  # fmt: skip
            leaves[i] = count

    return crossings
