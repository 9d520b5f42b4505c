"""The walk on one page: path → frames → regions → AO in every variant → pops and figures. Nothing is traced here."""

from __future__ import annotations

import numpy as np

from bake.errors import InputError
from bake.types import Float32Array, Regions
from bake.walk.course import Course, lay_out
from bake.walk.lag import lag
from bake.walk.metrics import measure, truth_variation
from bake.walk.pops import find_pops
from bake.walk.steps import measure_steps
from bake.walk.types import PathTruth, Pop, Variant, Walk, WalkMetrics, WalkOptions, WalkPath
from bake.walk.variants import variants_along


def simulate(
    regions: Regions,
    path: WalkPath,
    options: WalkOptions,
    *,
    truth: PathTruth | None = None,
    course: Course | None = None,
) -> Walk:
    """Walks a path.

    Args:
        regions: As baked, or with models regularised anew.
        path: Where to walk.
        options: How, and what to look at.
        truth: What was traced along the path; without it nothing is compared.
        course: The path as laid out by `lay_out` for the same regions; it is made anew where it does not fit the
            path, the speed or the frame rate. Models, half-life, normal and distance may differ.

    Raises:
        InputError: no regions, no such distance, or more frames than anyone could look at.
    """
    if not len(regions.graph):
        raise InputError("there are no regions to walk in", where="walk", remedy="bake with --regions auto")
    columns = regions.regularised.coefficients.shape[3]
    if not -columns <= options.column < columns:
        raise InputError(f"no distance number {options.column}", where="walk", remedy=f"there are {columns}")
    if (
        course is None
        or course.path is not path
        or (course.speed, course.frame_rate) != (options.speed, options.frame_rate)
    ):
        course = lay_out(regions, path, speed=options.speed, frame_rate=options.frame_rate)
    exact = variants_along(regions, course, options, truth)
    ao = {variant: np.clip(values, 0.0, 1.0).astype(np.float32) for variant, values in exact.items()}
    pops, metrics = _judged(course, options, ao)
    frames = course.frames
    return Walk(
        options=options,
        time=frames.time,
        distance=frames.distance,
        position=frames.position,
        region=course.region,
        inside=course.inside,
        teleported=frames.teleported,
        ao=ao,
        pops=pops,
        metrics=metrics,
    )


def _judged(
    course: Course, options: WalkOptions, ao: dict[Variant, Float32Array]
) -> tuple[tuple[Pop, ...], dict[Variant, WalkMetrics]]:
    truth = truth_variation(ao[Variant.TRUTH], course) if Variant.TRUTH in ao else None
    pops: list[Pop] = []
    metrics: dict[Variant, WalkMetrics] = {}
    for variant, values in ao.items():
        # The truth has no boundaries; what it jumps by is the level's own.
        steps = measure_steps(values, course.frames.teleported)
        found = [] if variant is Variant.TRUTH else find_pops(variant, steps, course)
        metrics[variant] = measure(values, steps, truth, course, lag=_lag(variant, course, options), pops=len(found))
        pops += found
    return tuple(sorted(pops, key=lambda pop: (-pop.codes, pop.frame, pop.variant))), metrics


def _lag(variant: Variant, course: Course, options: WalkOptions) -> float:
    if variant is Variant.TRUTH:
        return 0.0
    in_space = variant in (Variant.SPATIAL, Variant.SPATIAL_BLENDED)
    in_time = variant in (Variant.BLENDED, Variant.SPATIAL_BLENDED)
    left = course.leavings
    return lag(
        left.spatial if in_space else left.tagged,
        left.before,
        frame_rate=course.frame_rate,
        half_life=options.half_life if in_time else 0.0,
    )
