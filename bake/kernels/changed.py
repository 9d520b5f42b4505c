"""What an edit changes about the rays of some samples: only those that meet what changed are traced.

Rays that point at none of the boxes around what changed are not even made (`bake/kernels/towards.py`). For the others,
three parts of the two scenes are asked apart: what only the old one has, what only the new one has, and what both have.
The first two are small, so that they say quickly whether a ray meets anything that changed; one closest hit in the
third then tells what the ray strikes before and after, unless a partly open face is met.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import warp as wp

from bake.kernels.bodies import CLOSEST
from bake.kernels.closest import Hit, nudged
from bake.kernels.falloff import MAX_DISTANCES, Falloff
from bake.kernels.follow import Fate, follower, strikes_back
from bake.kernels.rays import owen_sobol
from bake.kernels.surface import Surface, openness_at
from bake.kernels.towards import STRIPS, Towards, number_in, towards
from bake.kernels.veil import Veil, dimmer
from bake.kernels.work import Work, fan_of, ray_direction, ray_threshold

wp.set_module_options({"enable_backward": False, "fast_math": False})

FEW = wp.constant(8)
"""As many rays are looked at one by one."""

vec8d = wp.types.vector(length=MAX_DISTANCES, dtype=wp.float64)


@wp.struct
class Side:
    """One of the two scenes.

    `entry` and `scene` are the tracer's. `part_entry` and `part_scene` lead to what this scene alone has, `count`
    triangles, and `primitive` says which of the tracer's primitives each of them is.
    """

    entry: wp.uint64
    scene: wp.uint64
    part_entry: wp.uint64
    part_scene: wp.uint64
    count: wp.int32
    primitive: wp.array(dtype=wp.int32)


@wp.struct
class Boxes:
    """Around all that changed; it is enough to cross one of those from `first_soft` on, which are of fog and leaves."""

    low: wp.array(dtype=wp.vec3)
    high: wp.array(dtype=wp.vec3)
    first_soft: wp.int32


@wp.struct
class Change:
    """What changed for each sample: sums over its rays, in units of one ray.

    With `find` set, only `candidates` is written, 1 where some ray of the sample is one. `doubtful` is 1 where rays
    that meet nothing that changed may find something else: an escape that is looked at twice in one scene only.
    """

    first_ray: wp.int32
    last_ray: wp.int32
    find: wp.int32
    # Out:
    ao: wp.array2d(dtype=wp.float64)
    hits: wp.array(dtype=wp.int32)
    back_faces: wp.array(dtype=wp.int32)
    tested: wp.array(dtype=wp.int32)
    candidates: wp.array(dtype=wp.int32)
    traced: wp.array(dtype=wp.int32)
    changed: wp.array(dtype=wp.int32)
    doubtful: wp.array(dtype=wp.int32)


@wp.func
def crosses(low: wp.vec3, high: wp.vec3, origin: wp.vec3, inverse: wp.vec3, t_max: wp.float32) -> wp.bool:
    """Whether a ray crosses a box within `t_max`, with a little room for rounding."""
    a = wp.cw_mul(low - origin, inverse)
    b = wp.cw_mul(high - origin, inverse)
    near = wp.min(a, b)
    far = wp.max(a, b)
    enter = wp.max(0.0, wp.max(near[0], wp.max(near[1], near[2])))
    leave = wp.min(t_max, wp.min(far[0], wp.min(far[1], far[2])))
    return enter * 0.999999 <= leave * 1.000001 + 1.0e-6


@wp.func
def inverse_of(direction: wp.vec3) -> wp.vec3:
    """One over each component, none of them taken for zero."""
    x = wp.where(wp.abs(direction[0]) < 1.0e-20, 1.0e-20, direction[0])
    y = wp.where(wp.abs(direction[1]) < 1.0e-20, 1.0e-20, direction[1])
    z = wp.where(wp.abs(direction[2]) < 1.0e-20, 1.0e-20, direction[2])
    return wp.vec3(1.0 / x, 1.0 / y, 1.0 / z)


@wp.func
def above(low: wp.vec3, high: wp.vec3, origin: wp.vec3, normal: wp.vec3) -> wp.bool:
    """Whether some of a box is above a plane; rays never go below their face."""
    farthest = wp.float32(0.0)
    for axis in range(3):
        farthest += normal[axis] * (wp.where(normal[axis] > 0.0, high[axis], low[axis]) - origin[axis])
    return farthest > -1.0e-4


@wp.func
def fate_at(surface: Surface, hit: Hit, t_max: wp.float32) -> Fate:
    """The fate of a ray whose first hit, if it has one, stops it."""
    fate = Fate()
    fate.distance = t_max
    if hit.primitive >= 0:
        fate.distance = hit.distance
        fate.stopped = 1
        fate.struck = 1
        if strikes_back(surface, hit):
            fate.back = 1
    return fate


@wp.func
def see_through(surface: Surface, hit: Hit) -> wp.bool:
    """Whether a ray may go on behind a hit."""
    if hit.primitive < 0:
        return False
    return openness_at(surface, hit.primitive, hit.weights) > 0.0


@wp.func
def same(a: Fate, b: Fate) -> wp.bool:
    """Whether two fates count alike."""
    return a.distance == b.distance and a.stopped == b.stopped and a.struck == b.struck and a.back == b.back


@cache
def changed_kernel(tracer: str, fog: bool, trees: bool) -> Any:
    """The kernel for "embree" or "warp", compiled at its first launch; fog and trees are there in one scene or both."""
    closest_hit, leaks_at_vertices = CLOSEST[tracer]
    closest_shared, _ = CLOSEST[f"{tracer}-without"]
    second_look = wp.constant(leaks_at_vertices)
    follow = follower(closest_hit, leaks_at_vertices)
    follow_shared = follower(closest_shared, leaks_at_vertices)
    dimmed = dimmer(fog, trees)
    veiled = fog or trees

    @wp.func
    def part_hit(side: Side, origin: wp.vec3, direction: wp.vec3, t_max: wp.float32) -> Hit:
        hit = Hit()
        hit.primitive = -1
        if side.count > 0:
            hit = closest_hit(side.part_entry, side.part_scene, origin, direction, 0.0, t_max)
            if hit.primitive >= 0:
                hit.primitive = side.primitive[hit.primitive]
        return hit

    @wp.kernel(module="unique", enable_backward=False)
    def changed(
        shared_entry: wp.uint64,
        shared_scene: wp.uint64,
        before: Side,
        after: Side,
        old_surface: Surface,
        new_surface: Surface,
        old_veil: Veil,
        new_veil: Veil,
        boxes: Boxes,
        work: Work,
        falloff: Falloff,
        out: Change,
        first: wp.int32,
    ):
        s = first + wp.tid()
        fan = fan_of(new_surface, work, s)
        aimed = Towards()  # at nothing, if all that changed lies below the face
        aimed.low = 2.0
        aimed.high = -1.0
        for box in range(boxes.low.shape[0]):
            low = boxes.low[box]
            high = boxes.high[box]
            if above(low, high, fan.point, fan.face_normal):
                aimed = towards(fan, aimed, 0.5 * (low + high), 0.5 * wp.length(high - low))
        total = vec8d()
        hits = wp.int32(0)
        back_faces = wp.int32(0)
        tested = wp.int32(0)
        candidates = wp.int32(0)
        traced = wp.int32(0)
        differing = wp.int32(0)
        t_max = falloff.t_max
        first_turned = wp.int32(0) + work.rays  # the first ray that escapes in one scene only
        rays = out.last_ray - out.first_ray
        layers = (rays + STRIPS - 1) / STRIPS
        steps = STRIPS * layers
        one_by_one = rays <= FEW
        if one_by_one:
            steps = rays
        if aimed.strips == wp.uint64(0):
            steps = 0
        for step in range(steps):
            j = out.first_ray + step
            if not one_by_one:
                strip = step / layers
                if ((aimed.strips >> wp.uint64(strip)) & wp.uint64(1)) == wp.uint64(0):
                    continue
                begin = fan.block + wp.uint32(out.first_ray)
                ahead = (number_in(strip, fan.first_seed) - begin) & wp.uint32(STRIPS - 1)
                j = out.first_ray + wp.int32(ahead) + STRIPS * (step % layers)
                if j >= out.last_ray:
                    continue
            place = owen_sobol(fan.block + wp.uint32(j), fan.first_seed, fan.second_seed)
            if place[1] < aimed.low or place[1] > aimed.high:
                continue
            if one_by_one:
                strip = wp.min(wp.int32(place[0] * 64.0), 63)
                if ((aimed.strips >> wp.uint64(strip)) & wp.uint64(1)) == wp.uint64(0):
                    continue
            direction = ray_direction(fan, j)
            inverse = inverse_of(direction)
            near = wp.bool(False)
            soft = wp.bool(False)
            for box in range(boxes.low.shape[0]):
                if (not near) or (box >= boxes.first_soft and not soft):  # noqa: SIM102  # not to be tested in vain
                    if crosses(boxes.low[box], boxes.high[box], fan.point, inverse, t_max):
                        near = True
                        soft = soft or box >= boxes.first_soft
            if not near:
                continue
            tested += 1
            old_hit = part_hit(before, fan.point, direction, t_max)
            new_hit = part_hit(after, fan.point, direction, t_max)
            meets = soft or old_hit.primitive >= 0 or new_hit.primitive >= 0
            if out.find == 1:
                if second_look and not meets:
                    twin = nudged(direction)
                    meets = (
                        part_hit(before, fan.point, twin, t_max).primitive >= 0
                        or part_hit(after, fan.point, twin, t_max).primitive >= 0
                    )
                if meets:
                    candidates = 1
                    break
                continue
            if not meets:
                continue
            candidates += 1

            limit = t_max
            if old_hit.primitive >= 0 and new_hit.primitive >= 0:
                limit = wp.max(old_hit.distance, new_hit.distance)
            hit = closest_shared(shared_entry, shared_scene, fan.point, direction, 0.0, limit)
            traced += 1
            old_fate = fate_at(new_surface, hit, t_max)
            new_fate = fate_at(new_surface, hit, t_max)
            old_through = see_through(new_surface, hit)
            new_through = old_through
            if old_hit.primitive >= 0 and (hit.primitive < 0 or old_hit.distance <= hit.distance):
                if hit.primitive < 0 or old_hit.distance < hit.distance:
                    old_fate = fate_at(old_surface, old_hit, t_max)
                    old_through = False
                old_through = old_through or see_through(old_surface, old_hit)
            if new_hit.primitive >= 0 and (hit.primitive < 0 or new_hit.distance <= hit.distance):
                if hit.primitive < 0 or new_hit.distance < hit.distance:
                    new_fate = fate_at(new_surface, new_hit, t_max)
                    new_through = False
                new_through = new_through or see_through(new_surface, new_hit)
            threshold = ray_threshold(fan, j)
            if old_through and new_through:
                nearest = t_max
                if old_hit.primitive >= 0:
                    nearest = old_hit.distance
                if new_hit.primitive >= 0:
                    nearest = wp.min(nearest, new_hit.distance)
                # Most such rays end among leaves that both scenes have, before they come to what changed.
                if hit.primitive >= 0 and hit.distance < nearest:
                    ended = follow_shared(
                        shared_entry, shared_scene, new_surface, fan.point, direction, nearest, threshold, False
                    )
                    if ended.stopped == 1:
                        old_fate = ended
                        new_fate = ended
                        old_through = False
                        new_through = False
            # Of faces back to back only the whole scenes tell which one counts.
            tied = hit.primitive >= 0 and (
                (old_hit.primitive >= 0 and old_hit.distance == hit.distance)
                or (new_hit.primitive >= 0 and new_hit.distance == hit.distance)
            )
            behind = (old_fate.back == 1 or new_fate.back == 1) and (tied or not same(old_fate, new_fate))
            # What nothing stops is looked at twice only where it is the first ray, which is always in doubt.
            doubtful = j == 0
            if (
                old_through
                or new_through
                or behind
                or (second_look and doubtful and (old_fate.struck == 0 or new_fate.struck == 0))
            ):
                old_fate = follow(
                    before.entry, before.scene, old_surface, fan.point, direction, t_max, threshold, doubtful
                )
                new_fate = follow(
                    after.entry, after.scene, new_surface, fan.point, direction, t_max, threshold, doubtful
                )
                traced += 2
            if old_fate.struck != new_fate.struck:
                first_turned = wp.min(first_turned, j)
            if same(old_fate, new_fate) and not soft:
                continue
            old_passes = wp.float32(1.0)
            new_passes = wp.float32(1.0)
            if veiled:
                old_passes = dimmed(old_veil, old_surface, fan.point, direction, old_fate.distance)
                new_passes = dimmed(new_veil, new_surface, fan.point, direction, new_fate.distance)
            if same(old_fate, new_fate) and old_passes == new_passes:
                continue
            differing += 1
            hits += new_fate.struck - old_fate.struck
            back_faces += new_fate.back - old_fate.back
            for k in range(falloff.count):
                old_share = wp.float32(1.0)
                if old_fate.stopped == 1:
                    old_share = 1.0 - wp.exp(falloff.rates[k] * old_fate.distance)
                new_share = wp.float32(1.0)
                if new_fate.stopped == 1:
                    new_share = 1.0 - wp.exp(falloff.rates[k] * new_fate.distance)
                total[k] += wp.float64(new_share * new_passes) - wp.float64(old_share * old_passes)
        doubtful_escapes = wp.int32(0)
        if second_look and out.find == 0 and first_turned < work.rays:
            # Escapes are doubted for as long as there were few. From here on the two scenes may doubt different ones,
            # unless so many of the rays before this one escape, in both scenes, that nothing is doubted any more.
            escaped = wp.int32(0)
            for early in range(first_turned):
                if escaped * 16 < work.rays:
                    found = closest_hit(after.entry, after.scene, fan.point, ray_direction(fan, early), 0.0, t_max)
                    traced += 1
                    if found.primitive < 0:
                        escaped += 1
            if escaped * 16 < work.rays:
                doubtful_escapes = 1
        out.tested[s] = tested
        out.candidates[s] = candidates
        if out.find == 0:
            for k in range(falloff.count):
                out.ao[s, k] = total[k]
            out.hits[s] = hits
            out.back_faces[s] = back_faces
            out.traced[s] = traced
            out.changed[s] = differing
            out.doubtful[s] = doubtful_escapes

    return changed
