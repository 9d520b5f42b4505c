"""Finds the frames on which a character visibly jumps, and the boundary at fault."""

from __future__ import annotations

import numpy as np

from bake.types import Float64Array, Int64Array
from bake.walk.course import Course
from bake.walk.lag import crossings
from bake.walk.steps import codes, steps
from bake.walk.types import Pop, Variant

LEAST_CODES = 1.0
"""Smaller steps no 8-bit screen need show."""

PROMINENCE = 3.0
"""A pop is so many times what the frames before it step: else it is the walk itself that changes."""

_BEFORE_S = 0.1
_BOUNDARY_S = 0.5


def find_pops(variant: Variant, ao: np.ndarray, course: Course) -> list[Pop]:
    """Pops of one variant, those of most codes first.

    A pop is a frame that steps by one 8-bit sRGB code or more about some normal, three times as far as the tenth of a
    second before it did at its median, and farther than any frame within a tenth of a second. Its boundary is the last
    that was crossed within half a second, or, for variants that see boundaries come, the nearest.

    Args:
        variant: Which one.
        ao: Its AO, shape (n, m), in [0, 1].
        course: The walk.
    """
    teleported = course.frames.teleported
    every = np.abs(steps(codes(ao), teleported))
    normal, largest = every.argmax(axis=1), every.max(axis=1)
    window = max(2, round(_BEFORE_S * course.frame_rate))
    frames = np.flatnonzero(largest >= LEAST_CODES)
    frames = frames[[_stands_out(largest, teleported, frame, window) for frame in frames.tolist()]]
    if not len(frames):
        return []
    changes = steps(ao, teleported)
    crossed = crossings(course.region, teleported)
    foreseen = variant in (Variant.SPATIAL, Variant.SPATIAL_BLENDED)
    pops: list[Pop] = []
    for frame in frames.tolist():
        before, after = _boundary(course, crossed, frame, foreseen=foreseen)
        column = int(normal[frame])
        time, step = float(course.frames.time[frame]), float(changes[frame, column])
        pops.append(Pop(variant, frame, time, before, after, column, step, float(largest[frame])))
    return sorted(pops, key=lambda pop: (-pop.codes, pop.frame))


def _stands_out(largest: Float64Array, teleported: np.ndarray, frame: int, window: int) -> bool:
    begin = max(0, frame - window)
    jumps = np.flatnonzero(teleported[begin : frame + 1])
    begin += int(jumps[-1]) + 1 if len(jumps) else 0  # the first frame after a teleport has no step of its own
    around = largest[begin : frame + window + 1]
    if largest[frame] < around.max() or begin >= frame:
        return False
    if np.flatnonzero(around == largest[frame])[0] != frame - begin:
        return False  # of equal ones only the first
    return bool(largest[frame] >= PROMINENCE * np.median(largest[begin:frame]))


def _boundary(course: Course, crossed: Int64Array, frame: int, *, foreseen: bool) -> tuple[int, int]:
    away = frame - crossed
    near = np.abs(away) <= _BOUNDARY_S * course.frame_rate
    if not foreseen:
        near &= away >= 0
    if not near.any():
        return int(course.region[frame]), int(course.region[frame])
    found = int(crossed[near][np.abs(away[near]).argmin()])
    return int(course.region[found - 1]), int(course.region[found])
