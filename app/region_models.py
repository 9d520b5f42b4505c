"""Region models made again without tracing: another regularisation, or other points switched on and off."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bake.region_types import PointState, RegionGraph, RegionPoints, Regions
from bake.regions.crossings import Crossings, find_crossings
from bake.regions.models import fit_and_absorb, regularised_models, regularised_regions
from bake.regions.moments import Moments, sum_points
from bake.settings import BakeSettings
from bake.types import BoolArray, Float64Array, Int64Array, UInt8Array


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """What decides the fitted models, besides what was traced.

    Attributes:
        bits: Validity of every grid point, shape (r · 512,), bool, if it is not the baked one.
        optimise_centre: Whether centres are searched.
        is_new: Whether the stored models differ from these.
    """

    bits: BoolArray | None
    optimise_centre: bool
    is_new: bool

    def is_same(self, other: Fit) -> bool:
        """Whether the fitted models are the same."""
        return self.bits is other.bits and self.optimise_centre == other.optimise_centre


@dataclass(frozen=True, slots=True)
class Sums:
    """What fits and errors need to know of the points.

    Attributes:
        state: Of every grid point when they were summed.
        moments: Sums over the valid ones of each region.
        crossings: Where characters cross from region to region.
    """

    state: UInt8Array
    moments: Moments
    crossings: Crossings


@dataclass(frozen=True, slots=True)
class Refit:
    """Regions made again.

    Attributes:
        fit: Which models were fitted.
        regions: With other points or models; graph and tracing are those of the bake.
        sums: Over their points.
        energies: Shape (sweeps, 2): E before and after each sweep of the regularisation, under its weights.
    """

    fit: Fit
    regions: Regions
    sums: Sums
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


def summed(points: RegionPoints, graph: RegionGraph, known: Sums | None = None) -> Sums:
    """Sums over valid points; of regions whose points are as they were in `known`, its own."""
    state = np.asarray(points.state)
    if known is None or len(known.state) != len(state):
        return Sums(state, sum_points(points, graph), find_crossings(graph, points))
    changed = np.flatnonzero((state != known.state).reshape(len(graph), -1).any(axis=1))
    if not len(changed):
        return known
    fresh = sum_points(*_only(points, graph, changed))
    old = known.moments
    parts = (
        (np.array(old.levels), fresh.levels), (np.array(old.count), fresh.count), (np.array(old.design), fresh.design),
        (np.array(old.cross), fresh.cross), (np.array(old.square), fresh.square),
    )  # fmt: skip
    for whole, part in parts:
        whole[changed] = part
    links = np.flatnonzero(np.isin(graph.link, changed).any(axis=1))
    crossed = find_crossings(
        replace(graph, link=graph.link[links], link_area=graph.link_area[links], link_centre=graph.link_centre[links]),
        points,
    )
    position, counts = known.crossings.position.copy(), known.crossings.counts.copy()
    position[links], counts[links] = crossed.position, crossed.counts
    return Sums(state, Moments(*(whole for whole, _ in parts)), Crossings(position, counts))


def refit(
    baked: Regions, settings: BakeSettings, fit: Fit, known: Refit | None = None, sums: Sums | None = None
) -> Refit:
    """Fits and regularises again what was traced.

    Args:
        baked: As stored.
        settings: Those of the regions are taken from here, and the back-face threshold.
        fit: Which models are fitted: as stored, or anew.
        known: An earlier refit for the same fit: only the regularisation is made again.
        sums: Those of some earlier points of the same regions: only what changed is summed again.
    """
    if known is None and fit.is_new:
        points = baked.points if fit.bits is None else with_bits(baked.points, fit.bits, settings.back_face_threshold)
        sums = summed(points, baked.graph, sums)
        fitted = fit_and_absorb(points, baked.graph, settings, moments=sums.moments)
        regions, energies = regularised_regions(points, baked.graph, fitted, settings)
        return Refit(fit, regions, sums, energies)
    base = baked if known is None else known.regions
    sums = summed(base.points, base.graph, sums) if known is None else known.sums
    smooth = regularised_models(
        base.fitted, base.graph, settings, owner=base.owner, moments=sums.moments, crossings=sums.crossings
    )
    regions = replace(base, regularised=smooth.models, mismatch_after=smooth.mismatch)
    return Refit(fit, regions, sums, smooth.energies)


def _only(points: RegionPoints, graph: RegionGraph, chosen: Int64Array) -> tuple[RegionPoints, RegionGraph]:
    """Some regions without their links, and their points."""
    count = len(points.state) // max(len(graph), 1)
    rows = (chosen[:, None] * count + np.arange(count)).ravel()
    traced = np.asarray(points.traced)
    place = np.full(len(points.state), -1, np.int64)
    place[rows] = np.arange(len(rows))
    kept = place[traced] >= 0
    part = RegionPoints(
        position=np.asarray(points.position)[rows],
        state=np.asarray(points.state)[rows],
        back_face_share=np.asarray(points.back_face_share)[rows],
        traced=place[traced[kept]].astype(np.int32),
        sh=np.asarray(points.sh)[kept],
        windowed=np.asarray(points.windowed)[kept],
    )
    names = tuple(graph.names[number] for number in chosen.tolist())
    low, high, seed = graph.minimum[chosen], graph.maximum[chosen], graph.seed[chosen]
    none = np.zeros((0, 2), np.int32)
    return part, RegionGraph(names, low, high, seed, none, np.zeros(0), np.zeros((0, 3)), graph.origin)
