"""How well a variant does along a walk."""

from __future__ import annotations

import math

import numpy as np

from bake.types import Float64Array
from bake.walk.course import Course
from bake.walk.lag import crossings
from bake.walk.steps import codes, steps
from bake.walk.types import WalkMetrics

_SMOOTHED_M = 0.5


def measure(
    ao: np.ndarray,
    truth: np.ndarray | None,
    course: Course,
    *,
    lag: float,
    pops: int,
) -> WalkMetrics:
    """Metrics of one variant over all frames and normals.

    Args:
        ao: Its AO, shape (n, m), in [0, 1].
        truth: What was traced, shape (n, m), NaN where it does not count; or None.
        course: The walk.
        lag: As `bake.walk.lag` found it, s.
        pops: How many were found.
    """
    teleported = course.frames.teleported
    changes = np.nan_to_num(np.abs(steps(ao, teleported)))  # what is not known does not step
    every = changes[~teleported]
    in_codes = np.nan_to_num(np.abs(steps(codes(ao), teleported)))
    largest = every.max(axis=1) if len(every) else np.zeros(1)
    at_boundary = changes[crossings(course.region, teleported)]
    median = float(np.median(largest))
    errors = np.empty(0) if truth is None else np.abs(ao.astype(np.float64) - truth)
    errors = errors[np.isfinite(errors)]
    return WalkMetrics(
        worst_step=float(largest.max()),
        worst_codes=float(in_codes.max()),
        high_step=float(np.percentile(largest, 99.9)),
        worst_boundary_step=float(at_boundary.max()) if at_boundary.size else 0.0,
        jump_ratio=float(largest.max()) / median if median > 0.0 else math.nan,
        excess_variation=math.nan if truth is None else _excess(ao, truth, course),
        lag=lag,
        mean_error=float(errors.mean()) if errors.size else math.nan,
        max_error=float(errors.max()) if errors.size else math.nan,
        pops=pops,
    )


def _excess(ao: np.ndarray, truth: np.ndarray, course: Course) -> float:
    """Variation over that of the truth, where the truth is known on both frames of a step.

    The truth is a mean over half a metre here: else the noise of its rays would count as variation. What rises or
    falls over a longer way keeps its variation under a mean.
    """
    teleported = course.frames.teleported
    reach = round(0.5 * _SMOOTHED_M / course.speed * course.frame_rate)
    real = np.abs(steps(_smoothed(truth, course.frames.piece, reach), teleported))
    known = np.isfinite(real)
    total = float(real[known].sum())
    return float(np.abs(steps(ao, teleported))[known].sum()) / total if total > 0.0 else math.nan


def _smoothed(values: np.ndarray, piece: np.ndarray, reach: int) -> Float64Array:
    """Means over up to `reach` frames before and after each, of the same piece; NaN spreads over as many."""
    smooth = np.empty(values.shape)
    for number in np.unique(piece).tolist():
        own = np.flatnonzero(piece == number)
        part = values[own].astype(np.float64)
        known = np.isfinite(part)
        total = np.cumsum(np.concatenate([np.zeros((1, part.shape[1])), np.where(known, part, 0.0)]), axis=0)
        unknown = np.cumsum(np.concatenate([np.zeros((1, part.shape[1])), ~known]), axis=0)
        index = np.arange(len(own))
        width = np.minimum(
            reach, np.minimum(index, len(own) - 1 - index)
        )  # even on both sides: ends stay what they are
        low, high = index - width, index + width + 1
        mean = (total[high] - total[low]) / (high - low)[:, None]
        smooth[own] = np.where(unknown[high] > unknown[low], np.nan, mean)
    return smooth
