"""The fused kernel over sixteen samples at a time, for Embree: see `bake/kernels/packets.py`.

A sample's rays are weighed in their own order, so that its sums are those of the kernel that takes them one by one, to
the bit.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import warp as wp

from bake.kernels.bodies import CLOSEST
from bake.kernels.falloff import Falloff, vec8
from bake.kernels.follow import follower_on
from bake.kernels.packets import LANES, RAYS, direction_at, end_at, hit_at, place_of, put_end, spread, trace_all
from bake.kernels.surface import Surface
from bake.kernels.veil import Veil, dimmer
from bake.kernels.work import Work, fan_of, ray_threshold

wp.set_module_options({"enable_backward": False, "fast_math": False})

_LANES, _RAYS = wp.constant(LANES), wp.constant(RAYS)


@cache
def grouped_kernel(fog: bool, trees: bool) -> Any:
    """The kernel for scenes with fog, trees, both or neither; one thread takes sixteen samples, on one scratch."""
    follow_on = follower_on(*CLOSEST["embree"], True)
    dimmed = dimmer(fog, trees)
    veiled = wp.constant(fog or trees)

    @wp.kernel(module="unique", enable_backward=False)
    def grouped_obscurance(
        entry: wp.uint64,
        scene: wp.uint64,
        surface: Surface,
        veil: Veil,
        work: Work,
        falloff: Falloff,
        packets: wp.int32,
        reals: wp.array(dtype=wp.float32),
        wholes: wp.array(dtype=wp.int32),
        end: wp.int32,
        first: wp.int32,
    ):
        low = first + wp.tid() * _LANES
        lanes = wp.min(_LANES, end - low)
        for begin in range(0, work.rays, _RAYS):
            count = wp.min(_RAYS, work.rays - begin)
            for lane in range(lanes):
                spread(reals, wholes, lane, fan_of(surface, work, low + lane), begin, count)
            trace_all(entry, scene, reals, wholes, lanes, count, falloff.t_max, packets)
            for lane in range(lanes):
                s = low + lane
                fan = fan_of(surface, work, s)
                hits = wp.int32(0)
                back_faces = wp.int32(0)
                blocked = vec8()
                if begin > 0:
                    hits = wp.int32(work.hits[s])
                    back_faces = wp.int32(work.back_faces[s])
                    for k in range(falloff.count):
                        blocked[k] = work.ao[s, k]
                for i in range(count):
                    j = begin + i
                    place = place_of(wholes, lane, i)
                    direction = direction_at(reals, place, lane)
                    doubtful = (j - hits) * 16 <= j
                    threshold = ray_threshold(fan, j)
                    fate = follow_on(
                        entry, scene, surface, fan.point, direction, falloff.t_max, threshold, doubtful,
                        hit_at(reals, wholes, place),
                    )  # fmt: skip
                    hits += fate.struck
                    back_faces += fate.back
                    if veiled:
                        put_end(reals, place, wp.where(fate.stopped == 1, fate.distance, -1.0))
                    elif fate.stopped == 1:
                        for k in range(falloff.count):
                            blocked[k] += wp.exp(falloff.rates[k] * fate.distance)  # 1 - ρ
                if veiled:
                    for i in range(count):
                        place = place_of(wholes, lane, i)
                        ended = end_at(reals, place)
                        stopped = ended >= 0.0
                        way = direction_at(reals, place, lane)
                        passes = dimmed(veil, surface, fan.point, way, wp.where(stopped, ended, falloff.t_max))
                        for k in range(falloff.count):
                            near = wp.float32(0.0)
                            if stopped:
                                near = wp.exp(falloff.rates[k] * ended)
                            blocked[k] += (1.0 - passes) + near * passes  # 1 - ρ × what passes
                for k in range(falloff.count):
                    ao = blocked[k]
                    if begin + count >= work.rays:
                        ao = wp.max(0.0, 1.0 - ao / wp.float32(work.rays))
                    work.ao[s, k] = ao
                work.hits[s] = wp.uint16(hits)
                work.back_faces[s] = wp.uint16(back_faces)

    return grouped_obscurance
