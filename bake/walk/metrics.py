"""How well a variant does along a walk."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bake.types import BoolArray, Float64Array
from bake.walk.course import Course
from bake.walk.lag import crossings
from bake.walk.steps import Steps, steps
from bake.walk.types import WalkMetrics

_SMOOTHED_M = 0.5


@dataclass(frozen=True, slots=True)
class TruthVariation:
    """The truth, and how much it varies.

    Its variation is that of means over half a metre: else the noise of its rays would count. What rises or falls over
    a longer way keeps its variation under a mean.

    Attributes:
        ao: Shape (n, m), NaN where it does not count.
        known: Shape (n, m): steps on both of whose frames it counts.
        variation: Σ|step| over those.
    """

    ao: np.ndarray
    known: BoolArray
    variation: float


def measure(
    ao: np.ndarray, own: Steps, truth: TruthVariation | None, course: Course, *, lag: float, pops: int
) -> WalkMetrics:
    """Metrics of one variant over all frames and normals.

    Args:
        ao: Its AO, shape (n, m), in [0, 1].
        own: Its steps.
        truth: What was traced, or None.
        course: The walk.
        lag: As `bake.walk.lag` found it, s.
        pops: How many were found.
    """
    teleported = course.frames.teleported
    largest = own.largest[~teleported] if not teleported.all() else np.zeros(1)
    at_boundary = own.largest[crossings(course.region, teleported)]
    median = float(np.median(largest))
    errors = np.empty(0) if truth is None else np.abs(ao.astype(np.float64) - truth.ao)
    errors = errors[np.isfinite(errors)]
    return WalkMetrics(
        worst_step=float(largest.max()),
        worst_codes=float(own.largest_codes.max()),
        high_step=float(np.percentile(largest, 99.9)),
        worst_boundary_step=float(at_boundary.max()) if at_boundary.size else 0.0,
        jump_ratio=float(largest.max()) / median if median > 0.0 else math.nan,
        excess_variation=math.nan if truth is None else _excess(own, truth),
        lag=lag,
        mean_error=float(errors.mean()) if errors.size else math.nan,
        max_error=float(errors.max()) if errors.size else math.nan,
        pops=pops,
    )


def truth_variation(truth: np.ndarray, course: Course) -> TruthVariation:
    """What variants are compared with; `truth` has shape (n, m), NaN where it does not count."""
    reach = round(0.5 * _SMOOTHED_M / course.speed * course.frame_rate)
    real = np.abs(steps(_smoothed(truth, course.frames.piece, reach), course.frames.teleported))
    known = np.isfinite(real)
    return TruthVariation(truth, known, float(real[known].sum()))


def _excess(own: Steps, truth: TruthVariation) -> float:
    """Variation over that of the truth."""
    total = truth.variation
    return float(np.abs(own.ao).sum(where=truth.known)) / total if total > 0.0 else math.nan


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
