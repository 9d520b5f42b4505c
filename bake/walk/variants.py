"""AO on every frame, in every variant; nothing is cut off here."""

from __future__ import annotations

import numpy as np

from bake import spherical_harmonics
from bake.regions.evaluate import basis
from bake.types import Float64Array, Int32Array, Regions
from bake.walk.course import Course
from bake.walk.temporal import blend_in_time
from bake.walk.truth import truth_along
from bake.walk.types import PathTruth, Variant, WalkOptions


def variants_along(
    regions: Regions, course: Course, options: WalkOptions, truth: PathTruth | None
) -> dict[Variant, Float64Array]:
    """Every variant about the seven normals of the options, shape (n, 7) each."""
    lobes = spherical_harmonics.evaluate(options.normals)
    fitted, regularised = (
        _about(models.coefficients[..., options.column], lobes) for models in (regions.fitted, regions.regularised)
    )
    centre = regions.regularised.centre
    raw = _at(fitted, regions.fitted.centre, course.region, course.place)
    tagged = _at(regularised, centre, course.region, course.place)
    weighed = _at(regularised, centre, course.weights.region, course.weighed_place)
    spatial = np.add.reduceat(weighed * course.weights.weight[:, None], course.weights.first[:-1])
    found = {Variant.RAW: raw, Variant.REGULARISED: tagged}
    found |= {Variant.BLENDED: _blended(tagged, course, options)}
    found |= {Variant.SPATIAL: spatial, Variant.SPATIAL_BLENDED: _blended(spatial, course, options)}
    if truth is not None:
        found[Variant.TRUTH] = truth_along(truth, course.frames, lobes, options.column)
    return found


def _blended(values: Float64Array, course: Course, options: WalkOptions) -> Float64Array:
    return blend_in_time(
        values, course.frames.teleported, frame_time=1.0 / course.frame_rate, half_life=options.half_life
    )


def _about(coefficients: np.ndarray, lobes: Float64Array) -> Float64Array:
    """Models of AO about normals, from models of harmonics, shapes (r, 7, 9) and (7, 9) → (r, 7, 7)."""
    return np.einsum("rpc,mc->rpm", coefficients.astype(np.float64), lobes)


def _at(models: Float64Array, centre: Float64Array, region: Int32Array, place: Float64Array) -> Float64Array:
    return np.einsum("np,npm->nm", basis(place - centre[region]), models[region])
