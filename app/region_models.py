"""Region models made again without tracing: another regularisation, or other points switched on and off."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bake.region_types import PointState, RegionPoints, Regions
from bake.regions.fit import fit_regions, with_errors
from bake.regions.mismatch import boundary_mismatch
from bake.regions.moments import Moments, sum_points
from bake.regions.regularise import regularise
from bake.settings import BakeSettings
from bake.types import BoolArray, Float64Array


@dataclass(frozen=True, slots=True)
class Refit:
    """Regions made again.

    Attributes:
        regions: With other points or models; graph and tracing are those of the bake.
        moments: Sums over the points, which the next refit of the same points need not take again.
        energies: Shape (sweeps + 1,): E before and after each sweep of the regularisation.
    """

    regions: Regions
    moments: Moments
    energies: Float64Array


def reachable_bits(regions: Regions) -> BoolArray:
    """The validity bit of every grid point, shape (r · 512,), bool."""
    return np.asarray(regions.points.state) != PointState.UNREACHABLE


def traced_bits(regions: Regions) -> BoolArray:
    """Whether a grid point was traced, so that it can be switched on without tracing, shape (r · 512,), bool."""
    traced = np.zeros(len(regions.points.state), bool)
    traced[regions.points.traced] = True
    return traced


def pending_bits(regions: Regions, bits: BoolArray) -> BoolArray:
    """Points that are switched on but were never traced: they count from the next bake on."""
    return bits & ~traced_bits(regions)


def with_bits(points: RegionPoints, bits: BoolArray, threshold: float) -> RegionPoints:
    """The same points with other validity bits; a point that was not traced stays unreachable.

    Args:
        points: As baked.
        bits: Shape (r · 512,), bool.
        threshold: A traced point whose back-face share is above this stays dropped.
    """
    state = np.full(len(points.state), PointState.UNREACHABLE, np.uint8)
    traced = np.asarray(points.traced)
    dropped = np.asarray(points.back_face_share)[traced] > threshold
    state[traced] = np.where(dropped, PointState.BACK_FACES, PointState.VALID)
    state[~bits] = PointState.UNREACHABLE
    return replace(points, state=state)


def refit(baked: Regions, settings: BakeSettings, bits: BoolArray | None = None, known: Refit | None = None) -> Refit:
    """Fits and regularises again what was traced.

    Args:
        baked: As stored.
        settings: β, sweeps, tolerance, optimised centres and the back-face threshold are taken from here.
        bits: Validity of every grid point, if it is not the baked one.
        known: An earlier refit with the same bits: its points and its fit are kept, and only the regularisation is
            made again, unless the centres are to be found in another way.
    """
    if known is None:
        points = baked.points if bits is None else with_bits(baked.points, bits, settings.back_face_threshold)
        moments = sum_points(points, baked.graph)
        fitted = fit_regions(points, baked.graph, settings, owner=baked.owner, moments=moments)
        before = boundary_mismatch(fitted, baked.graph)
    else:
        points, moments = known.regions.points, known.moments
        fitted, before = known.regions.fitted, known.regions.mismatch_before
    smooth = regularise(
        fitted,
        baked.graph,
        beta=settings.region_beta,
        sweeps=settings.region_sweeps,
        tolerance=settings.region_tolerance,
        owner=baked.owner,
    )
    regions = replace(
        baked,
        points=points,
        fitted=fitted,
        regularised=with_errors(smooth.models, moments),
        mismatch_before=before,
        mismatch_after=smooth.mismatch,
    )
    return Refit(regions, moments, smooth.energies)
