"""The fused kernel for scenes with fog or trees: rays are followed several at a time, and only then dimmed.

Following a ray and walking the boxes of fog right after it would have each of the two find its data and its branches
forgotten: on the CPU the walks then take nearly twice as long.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from bake.kernels.falloff import Falloff, vec8
from bake.kernels.follow import follower
from bake.kernels.surface import Surface
from bake.kernels.veil import Veil, dimmer
from bake.kernels.work import Work, fan_of, ray_direction, ray_threshold

wp.set_module_options({"enable_backward": False, "fast_math": False})


def veiled_obscurance_kernel(closest_hit: Any, leaks_at_vertices: bool, fog: bool, trees: bool, at_once: int) -> Any:
    """The kernel over one way of finding closest hits, for fog, trees or both; `at_once` rays wait to be dimmed."""
    follow = follower(closest_hit, leaks_at_vertices)
    dimmed = dimmer(fog, trees)
    directions = wp.types.matrix(shape=(at_once, 3), dtype=wp.float32)
    distances = wp.types.vector(length=at_once, dtype=wp.float32)
    most = wp.constant(at_once)

    @wp.kernel(module="unique", enable_backward=False)
    def veiled_obscurance(
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
        ways = directions()
        ends = distances()  # -1 where nothing stopped the ray
        for begin in range(0, work.rays, most):
            count = wp.min(most, work.rays - begin)
            for i in range(count):
                j = begin + i
                direction = ray_direction(fan, j)
                doubtful = (j - hits) * 16 <= j
                threshold = ray_threshold(fan, j)
                fate = follow(entry, scene, surface, fan.point, direction, falloff.t_max, threshold, doubtful)
                hits += fate.struck
                back_faces += fate.back
                ways[i] = direction
                ends[i] = wp.where(fate.stopped == 1, fate.distance, -1.0)
            for i in range(count):
                stopped = ends[i] >= 0.0
                passes = dimmed(veil, surface, fan.point, ways[i], wp.where(stopped, ends[i], falloff.t_max))
                for k in range(falloff.count):
                    near = wp.float32(0.0)
                    if stopped:
                        near = wp.exp(falloff.rates[k] * ends[i])
                    blocked[k] += (1.0 - passes) + near * passes  # 1 - ρ × what passes
        for k in range(falloff.count):
            work.ao[s, k] = wp.max(0.0, 1.0 - blocked[k] / wp.float32(work.rays))
        work.hits[s] = wp.uint16(hits)
        work.back_faces[s] = wp.uint16(back_faces)

    return veiled_obscurance
