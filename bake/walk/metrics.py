"""How well a variant does along a walk."""

from __future__ import annotations

import math

import numpy as np

from bake.types import Float64Array, Int64Array
from bake.walk.course import Course
from bake.walk.steps import codes, steps
from bake.walk.types import WalkMetrics

_ARRIVED = 0.1
_LEAST_JUMP = 0.01


def measure(
    ao: np.ndarray,
    truth: np.ndarray | None,
    course: Course,
    crossed: Int64Array,
    jumps: Float64Array,
    target: np.ndarray,
    *,
    pops: int,
) -> WalkMetrics:
    """Metrics of one variant over all frames and normals.

    Args:
        ao: Its AO, shape (n, m), in [0, 1].
        truth: What was traced, shape (n, m), NaN where it does not count; or None.
        course: The walk.
        crossed: Frames on which the region changed, shape (c,).
        jumps: What changes there all at once, shape (c, m).
        target: What the variant lags behind, shape (n, m): the models as they are.
        pops: How many were found.
    """
    teleported = course.frames.teleported
    every = np.abs(steps(ao, teleported))[~teleported]
    in_codes = np.abs(steps(codes(ao), teleported))
    largest = every.max(axis=1) if len(every) else np.zeros(1)
    at_boundary = np.abs(steps(ao, teleported))[crossed]
    median = float(np.median(largest))
    errors = np.empty(0) if truth is None else np.abs(ao.astype(np.float64) - truth)
    errors = errors[np.isfinite(errors)]
    return WalkMetrics(
        worst_step=float(largest.max()),
        worst_codes=float(in_codes.max()),
        high_step=float(np.percentile(largest, 99.9)),
        worst_boundary_step=float(at_boundary.max()) if at_boundary.size else 0.0,
        jump_ratio=float(largest.max()) / median if median > 0.0 else math.nan,
        excess_variation=math.nan if truth is None else _excess(ao, truth, teleported),
        lag=_lag(ao, target, course, crossed, jumps),
        mean_error=float(errors.mean()) if errors.size else math.nan,
        max_error=float(errors.max()) if errors.size else math.nan,
        pops=pops,
    )


def _excess(ao: np.ndarray, truth: np.ndarray, teleported: np.ndarray) -> float:
    """Variation over that of the truth, where the truth is known on both frames of a step."""
    real = np.abs(steps(truth, teleported))
    known = np.isfinite(real)
    total = float(real[known].sum())
    return float(np.abs(steps(ao, teleported))[known].sum()) / total if total > 0.0 else math.nan


def _lag(ao: np.ndarray, target: np.ndarray, course: Course, crossed: Int64Array, jumps: Float64Array) -> float:
    """Median seconds from a crossing until less than a tenth of its jump is missing, about the normal that jumps most.

    A character that has crossed the next boundary by then counts with what it had until there.
    """
    ends = np.append(crossed[1:], len(ao))
    begun = np.flatnonzero(course.frames.teleported)
    waits: list[int] = []
    for row, (begin, end) in enumerate(zip(crossed.tolist(), ends.tolist(), strict=True)):
        column = int(np.abs(jumps[row]).argmax())
        jump = abs(float(jumps[row, column]))
        if jump < _LEAST_JUMP:
            continue
        later = begun[begun > begin]
        end = min(end, int(later[0])) if len(later) else end
        missing = np.abs(ao[begin:end, column] - target[begin:end, column])
        there = np.flatnonzero(missing <= _ARRIVED * jump)
        waits.append(int(there[0]) if len(there) else end - begin)
    return float(np.median(waits)) / course.frame_rate if waits else math.nan
