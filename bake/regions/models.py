"""From traced points to the models that an engine uses: fit, absorb, regularise. No ray is traced for any of it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from bake.arrays import Float32Array, Float64Array, Int32Array
from bake.region_types import RegionGraph, RegionModels, RegionPoints, Regions
from bake.regions.absorb import Absorption, absorb
from bake.regions.crossings import Crossings, find_crossings
from bake.regions.fit import fit_regions, with_errors
from bake.regions.mismatch import boundary_mismatch
from bake.regions.moments import Moments, sum_points
from bake.regions.probes import judged
from bake.regions.regularise import Regularised, regularise
from bake.settings import BakeSettings
from bake.types import BakeResult

_FIT_SETTINGS = ("back_face_threshold", "region_smallest", "optimise_centre")


@dataclass(frozen=True, slots=True)
class FittedRegions:
    """What is known before the regularisation.

    Attributes:
        moments: Sums over the valid points.
        absorption: Who uses whose model.
        alone: Each region's model as if nothing had been absorbed.
        models: Those of the groups.
        without_search: Mean error with the better of the two candidate centres, where the settings had them searched.
    """

    moments: Moments
    absorption: Absorption
    alone: RegionModels
    models: RegionModels
    without_search: float | None = None

    def absorbed_error(self) -> Float32Array:
        """By how much the error at each absorbed region's points grew, shape (absorbed, k); NaN without points."""
        rows = np.array(self.absorption.absorbed, np.int64)
        return (self.models.rmse - self.alone.rmse)[rows]


def fit_and_absorb(
    points: RegionPoints, graph: RegionGraph, settings: BakeSettings, *, moments: Moments | None = None
) -> FittedRegions:
    """Fits all regions, lets small ones be absorbed, and fits those that took some up again.

    Args:
        points: Traced and judged.
        graph: The regions.
        settings: Those of the bake.
        moments: What `sum_points` gives for the points, if it is at hand.
    """
    moments = sum_points(points, graph) if moments is None else moments
    absorption = absorb(moments, graph, settings.region_smallest)
    alone = models = fit_regions(points, graph, settings, moments=moments)
    if absorption.absorbed:
        models = fit_regions(points, graph, settings, owner=absorption.owner, moments=moments)
    without_search = None
    if settings.optimise_centre:
        tried = settings.replaced(optimise_centre=False)
        plain = fit_regions(points, graph, tried, owner=absorption.owner, moments=moments)
        without_search = mean_error(plain.rmse)
    return FittedRegions(moments, absorption, alone, models, without_search)


def mean_error(rmse: Float32Array) -> float:
    """Mean over the regions that have points and over the distances; 0 if none has."""
    known = rmse[np.isfinite(rmse)]
    return float(known.mean()) if known.size else 0.0


def regularised_regions(
    points: RegionPoints, graph: RegionGraph, fitted: FittedRegions, settings: BakeSettings
) -> tuple[Regions, Float64Array]:
    """The finished regions, and the energy before and after each sweep, shape (sweeps, 2)."""
    absorption = fitted.absorption
    crossings = find_crossings(graph, points)
    outcome = regularised_models(
        fitted.models, graph, settings, owner=absorption.owner, moments=fitted.moments, crossings=crossings
    )
    regions = Regions(
        graph=graph,
        points=points,
        fitted=fitted.models,
        regularised=outcome.models,
        mismatch_before=boundary_mismatch(fitted.models, graph),
        mismatch_after=outcome.mismatch,
        absorbed=tuple((graph.names[i], graph.names[int(absorption.owner[i])]) for i in absorption.absorbed),
        absorbed_error=fitted.absorbed_error(),
        owner=absorption.owner,
    )
    return regions, outcome.energies


def regularised_models(
    fitted: RegionModels,
    graph: RegionGraph,
    settings: BakeSettings,
    *,
    owner: Int32Array,
    moments: Moments,
    crossings: Crossings,
) -> Regularised:
    """Fitted models drawn together as the settings say, with their errors.

    Args:
        fitted: One a region.
        graph: The regions.
        settings: Those of the regularisation count.
        owner: Shape (r,): whose model each region uses.
        moments: Sums over the valid points.
        crossings: What `find_crossings` gives.
    """
    outcome = regularise(
        fitted,
        graph,
        beta=settings.region_beta,
        sweeps=settings.region_sweeps,
        tolerance=settings.region_tolerance,
        owner=owner,
        moments=moments,
        crossings=crossings,
    )
    return outcome._replace(models=with_errors(outcome.models, moments))


def refit_regions(result: BakeResult, settings: BakeSettings, *, moments: Moments | None = None) -> Regions:
    """The regions of a stored result under other settings of the regions or of validity, without tracing.

    Where only the regularisation changed, the stored fit is kept.

    Args:
        result: It has regions.
        settings: Those wanted; what would change rays or points is not looked at.
        moments: What `sum_points` gives for the result's points, to be spared when it is called again and again.
    """
    regions = result.regions
    assert regions is not None, "the result has no regions"
    graph = regions.graph
    if any(getattr(settings, name) != getattr(result.settings, name) for name in _FIT_SETTINGS):
        points = judged(regions.points, settings.back_face_threshold)
        return regularised_regions(points, graph, fit_and_absorb(points, graph, settings), settings)[0]
    outcome = regularised_models(
        regions.fitted,
        graph,
        settings,
        owner=regions.owner,
        moments=moments or sum_points(regions.points, graph),
        crossings=find_crossings(graph, regions.points),
    )
    return dataclasses.replace(regions, regularised=outcome.models, mismatch_after=outcome.mismatch)
