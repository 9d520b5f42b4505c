"""Finds the frames on which a character visibly jumps, and the boundary at fault."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from bake.types import Float64Array, Int64Array
from bake.walk.course import Course
from bake.walk.lag import crossings
from bake.walk.steps import Steps
from bake.walk.types import Pop, Variant

LEAST_CODES = 1.0
"""Smaller steps no 8-bit screen need show."""

PROMINENCE = 3.0
"""A pop is so many times what the frames before it step: else it is the walk itself that changes."""

_BEFORE_S = 0.1
_BOUNDARY_S = 0.5


def find_pops(variant: Variant, steps: Steps, course: Course) -> list[Pop]:
    """Pops of one variant, those of most codes first.

    A pop is a frame that steps by one 8-bit sRGB code or more about some normal, three times as far as the tenth of a
    second before it did at its median, and farther than any frame within a tenth of a second. Its boundary is the last
    that was crossed within half a second, or, for variants that see boundaries come, the nearest.

    Args:
        variant: Which one.
        steps: Its steps.
        course: The walk.
    """
    teleported = course.frames.teleported
    window = max(2, round(_BEFORE_S * course.frame_rate))
    frames = _peaks(steps.largest_codes, window)
    frames = [f for f in frames.tolist() if _stands_out(steps.largest_codes, teleported, f, window)]
    crossed = crossings(course.region, teleported)
    foreseen = variant in (Variant.SPATIAL, Variant.SPATIAL_BLENDED)
    pops: list[Pop] = []
    for frame in frames:
        before, after = _boundary(course, crossed, frame, foreseen=foreseen)
        column = int(steps.codes[frame].argmax())
        time, step = float(course.frames.time[frame]), float(steps.ao[frame, column])
        pops.append(Pop(variant, frame, time, before, after, column, step, float(steps.codes[frame, column])))
    return sorted(pops, key=lambda pop: (-pop.codes, pop.frame))


def _peaks(largest: Float64Array, window: int) -> Int64Array:
    """Frames that step by a code or more and by as much as any frame around; of equal ones the first."""
    padded = np.pad(largest, window, constant_values=-1.0)
    around = sliding_window_view(padded, 2 * window + 1)
    frames = np.flatnonzero(largest >= LEAST_CODES)
    frames = frames[largest[frames] >= around[frames].max(axis=1)]
    return frames[around[frames].argmax(axis=1) == window]


def _stands_out(largest: Float64Array, teleported: np.ndarray, frame: int, window: int) -> bool:
    """Whether it steps far more than the frames before it since the last teleport."""
    begin = max(0, frame - window)
    jumps = np.flatnonzero(teleported[begin : frame + 1])
    begin += int(jumps[-1]) + 1 if len(jumps) else 0  # the first frame after a teleport has no step of its own
    return begin < frame and bool(largest[frame] >= PROMINENCE * np.median(largest[begin:frame]))


def _boundary(course: Course, crossed: Int64Array, frame: int, *, foreseen: bool) -> tuple[int, int]:
    away = frame - crossed
    near = np.abs(away) <= _BOUNDARY_S * course.frame_rate
    if not foreseen:
        near &= away >= 0
    if not near.any():
        return int(course.region[frame]), int(course.region[frame])
    found = int(crossed[near][np.abs(away[near]).argmin()])
    return int(course.region[found - 1]), int(course.region[found])
