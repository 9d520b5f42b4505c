"""Which points in space have a ray that an edit can have changed: of rays in all directions, as `sphere.py` sends them.

As in `changed.py`, rays that point at none of the boxes around what changed are not even made, and the others are held
against the faces that one of the two scenes has and the other has not.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import warp as wp

from bake.kernels.bodies import CLOSEST
from bake.kernels.changed import Boxes, Side, crosses, inverse_of
from bake.kernels.closest import nudged
from bake.kernels.rays import SECOND_DIMENSION, hash_u32, owen_sobol
from bake.kernels.sphere import TWO_PI, sphere_direction
from bake.kernels.towards import ALMOST, PI, SLACK, STRIPS, Towards, everything, number_in

wp.set_module_options({"enable_backward": False, "fast_math": False})


@wp.struct
class Asked:
    """The points, and what is found: 1 for those with such a ray, and how many rays were held against faces."""

    position: wp.array(dtype=wp.vec3)
    seed: wp.array(dtype=wp.uint32)
    directions: wp.int32
    # Out:
    found: wp.array(dtype=wp.int32)
    tested: wp.array(dtype=wp.int32)


@wp.func
def all_round(point: wp.vec3, found: Towards, low: wp.vec3, high: wp.vec3) -> Towards:
    """`found` with the directions added that may cross a box, by strips of height and a range of angles."""
    offset = 0.5 * (low + high) - point
    distance = wp.length(offset)
    wide = 0.5 * wp.length(high - low) * 1.0001
    if wide >= ALMOST * distance:
        return everything()
    axis = offset / distance
    half = wp.asin(wide / distance) + 1.0e-4
    tilt = wp.acos(wp.clamp(axis[2], -1.0, 1.0))
    top = wp.cos(wp.max(tilt - half, 0.0))
    bottom = wp.cos(wp.min(tilt + half, PI))
    first = wp.clamp(wp.int32(wp.floor((0.5 - 0.5 * top - SLACK) * 64.0)), 0, 63)
    last = wp.clamp(wp.int32(wp.floor((0.5 - 0.5 * bottom + SLACK) * 64.0)), 0, 63)
    every = wp.uint64(0) - wp.uint64(1)
    result = Towards()
    result.strips = found.strips | ((every >> wp.uint64(63 - last + first)) << wp.uint64(first))
    result.low = -1.0
    result.high = 2.0
    sideways = wp.sin(tilt)
    if tilt > half and tilt + half < PI and wp.sin(half) < ALMOST * sideways:
        turn = wp.atan2(axis[1], axis[0]) / TWO_PI
        turn = wp.where(turn < 0.0, turn + 1.0, turn)
        wing = wp.asin(wp.sin(half) / sideways) / TWO_PI + SLACK
        if turn - wing > 0.0 and turn + wing < 1.0:  # else it goes round past where angles begin
            result.low = turn - wing
            result.high = turn + wing
    result.low = wp.min(found.low, result.low)
    result.high = wp.max(found.high, result.high)
    return result


@cache
def changed_points_kernel(tracer: str) -> Any:
    """The kernel for "embree" or "warp", compiled at its first launch."""
    closest_hit, leaks_at_vertices = CLOSEST[tracer]
    second_look = wp.constant(leaks_at_vertices)

    @wp.func
    def strikes(side: Side, origin: wp.vec3, direction: wp.vec3, t_max: wp.float32) -> wp.bool:
        if side.count == 0:
            return False
        return closest_hit(side.part_entry, side.part_scene, origin, direction, 0.0, t_max).primitive >= 0

    @wp.kernel(module="unique", enable_backward=False)
    def changed_points(before: Side, after: Side, boxes: Boxes, asked: Asked, t_max: wp.float32, first: wp.int32):
        p = first + wp.tid()
        origin = asked.position[p]
        seed = asked.seed[p]
        first_seed = hash_u32(seed)
        second_seed = hash_u32(seed ^ SECOND_DIMENSION)
        aimed = Towards()
        aimed.low = 2.0
        aimed.high = -1.0
        for box in range(boxes.low.shape[0]):
            aimed = all_round(origin, aimed, boxes.low[box], boxes.high[box])
        tested = wp.int32(0)
        found = wp.int32(0)
        layers = (asked.directions + STRIPS - 1) / STRIPS
        for strip in range(STRIPS):
            if found == 0 and ((aimed.strips >> wp.uint64(strip)) & wp.uint64(1)) == wp.uint64(1):
                number = wp.int32(number_in(strip, first_seed))
                for layer in range(layers):
                    j = number + STRIPS * layer
                    if found == 1 or j >= asked.directions:
                        continue
                    place = owen_sobol(wp.uint32(j), first_seed, second_seed)
                    if place[1] < aimed.low or place[1] > aimed.high:
                        continue
                    direction = sphere_direction(place)
                    inverse = inverse_of(direction)
                    near = wp.bool(False)
                    for box in range(boxes.low.shape[0]):
                        if found == 0 and (not near or box >= boxes.first_soft):  # noqa: SIM102
                            if crosses(boxes.low[box], boxes.high[box], origin, inverse, t_max):
                                near = True
                                if box >= boxes.first_soft:
                                    found = 1
                    if near and found == 0:
                        tested += 1
                        if strikes(before, origin, direction, t_max) or strikes(after, origin, direction, t_max):
                            found = 1
                        elif second_look:
                            twin = nudged(direction)
                            if strikes(before, origin, twin, t_max) or strikes(after, origin, twin, t_max):
                                found = 1
        asked.found[p] = found
        asked.tested[p] = tested

    return changed_points
