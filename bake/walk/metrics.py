"""How well a variant does along a walk."""

from __future__ import annotations

import math

import numpy as np

from bake.walk.course import Course
from bake.walk.lag import crossings
from bake.walk.steps import codes, steps
from bake.walk.types import WalkMetrics


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
        excess_variation=math.nan if truth is None else _excess(ao, truth, teleported),
        lag=lag,
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
