"""The stage that dynamic regions add to a bake: where objects move, what is open there, and models of it."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Generator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bake.arrays import Float32Array
from bake.region_types import CentreKind, PointState, RegionGraph, RegionPoints, Regions
from bake.regions.graph import make_graph
from bake.regions.model_findings import KINDS, model_findings
from bake.regions.models import FittedRegions, fit_and_absorb, mean_error, regularised_regions
from bake.regions.probes import KnownPoints, trace_points
from bake.regions.rays import NearestHits
from bake.regions.space import RegionSpace
from bake.settings import BakeSettings
from bake.sphere_rays import SphereTracer
from bake.stages import StageClock, patiently
from bake.types import BakeResult, Finding, Progress, Scene, World


class RegionTracer(SphereTracer, Protocol):
    """What this stage asks of a tracer."""

    def nearest(self, origins: Float32Array, directions: Float32Array, t_max: float, /) -> NearestHits:
        """Closest hits of plain rays; see `rays.Nearest`."""
        ...


@dataclass(frozen=True, slots=True)
class RegionOutcome:
    """What the bake makes of regions.

    Attributes:
        regions: As stored.
        findings: What the user should know.
    """

    regions: Regions
    findings: tuple[Finding, ...]


MODEL_ROWS = ("fit regions", "regularise regions")
"""The rows of the stage report that need no rays: a refit makes them anew."""


def find_regions(
    scene: Scene, world: World, settings: BakeSettings, tracer: RegionTracer, clock: StageClock
) -> Generator[Progress, None, RegionSpace | None]:
    """Finds or reads the regions and tells which of their points count, before anything is baked.

    Args:
        scene, world: The level.
        settings: Those of the bake.
        tracer: Of the whole world, open.
        clock: Gets the row "regions".

    Returns:
        None if no regions are asked for, or the settings skip them; the row "regions" says so.

    Raises:
        SceneError: the region file cannot be used, or no regions can be made of the scene.
    """
    if "regions" in settings.skip:
        clock.skipped("regions", "asked for by --skip")
        return None
    begin = time.perf_counter()
    space = yield from make_graph(scene, world, settings, nearest=tracer.nearest)
    if space is None:
        clock.skipped("regions", "none asked for (--regions auto makes some)")
        return None
    clock.ran("regions", _found(space), _since(begin), space.rays)
    return space


def bake_regions(
    space: RegionSpace | None,
    settings: BakeSettings,
    tracer: RegionTracer,
    clock: StageClock,
    *,
    known: KnownPoints | None = None,
) -> Generator[Progress, None, RegionOutcome | None]:
    """Traces the points of regions and models them (Sloan et al. 2013, section 2.3); None without any.

    Args:
        space: What `find_regions` found.
        settings: Those of the bake.
        tracer: Of the whole world, open.
        clock: Gets the rows "region probes" and `MODEL_ROWS`.
        known: Points that need not be traced.
    """
    if space is None:
        return None
    points = yield from _probes(space, settings, tracer, clock, known)
    outcome = yield from model_regions(space.graph, points, settings, clock)
    return RegionOutcome(outcome.regions, (*space.findings, *outcome.findings))


def model_regions(
    graph: RegionGraph, points: RegionPoints, settings: BakeSettings, clock: StageClock
) -> Generator[Progress, None, RegionOutcome]:
    """Models of traced points; adds the rows `MODEL_ROWS`. Nothing is traced."""
    fitted, seconds = yield from patiently("fit regions", lambda: fit_and_absorb(points, graph, settings))
    clock.ran(MODEL_ROWS[0], _fitted(fitted), seconds)
    (regions, energies), seconds = yield from patiently(
        "regularise regions", lambda: regularised_regions(points, graph, fitted, settings)
    )
    clock.ran(MODEL_ROWS[1], _regularised(regions, energies), seconds)
    return RegionOutcome(regions, tuple(model_findings(regions, fitted)))


def remodelled(result: BakeResult, settings: BakeSettings, clock: StageClock) -> Generator[Progress, None, BakeResult]:
    """A result whose regions are modelled anew under other settings of theirs; all else is as it was.

    Args:
        result: Baked with settings that differ in those of the region models alone.
        settings: Those wanted.
        clock: Gets `MODEL_ROWS`.
    """
    if result.regions is None:
        return dataclasses.replace(result, settings=settings)
    outcome = yield from model_regions(result.regions.graph, result.regions.points, settings, clock)
    rows = {row.name: row for row in clock.rows if row.name in MODEL_ROWS}
    return dataclasses.replace(
        result,
        settings=settings,
        regions=outcome.regions,
        stages=tuple(rows.get(row.name, row) for row in result.stages),
        findings=(*(item for item in result.findings if item.what not in KINDS), *outcome.findings),
    )


def _probes(
    space: RegionSpace, settings: BakeSettings, tracer: RegionTracer, clock: StageClock, known: KnownPoints | None
) -> Generator[Progress, None, RegionPoints]:
    begin, directions = time.perf_counter(), settings.region_directions
    count = int(np.count_nonzero(space.valid if known is None else known.wanted))
    total = count * directions
    work = trace_points(space.graph, space.valid, tracer, settings, known=known)
    while True:
        try:
            done = next(work) * directions
        except StopIteration as stop:
            points: RegionPoints = stop.value
            break
        yield Progress("region probes", done, total, _since(begin), done / _since(begin))
    seconds = _since(begin)
    dropped = int(np.count_nonzero(points.state == PointState.BACK_FACES))
    why = (
        f"{count:,} points of {directions:,} rays, {count / seconds:,.0f} points/s; "
        f"{dropped:,} see too many back faces, {int(points.windowed.sum()):,} rang"
    )
    clock.ran("region probes", why, seconds, total)
    return points


def _found(space: RegionSpace) -> str:
    graph = space.graph
    share = "" if np.isnan(space.coverage) else f", {100.0 * space.coverage:.0f} % of the walkable floor"
    points = int(np.count_nonzero(space.valid))
    return f"{len(graph):,} boxes ({graph.origin}), {len(graph.link):,} links{share}, {points:,} valid points"


def _fitted(fitted: FittedRegions) -> str:
    models, absorption = fitted.models, fitted.absorption
    own = absorption.owner == np.arange(len(models))
    parts = [f"{int(own.sum()):,} models, mean error {mean_error(models.rmse):.4f}", f"{int((~own).sum()):,} absorbed"]
    searched = own & (models.centre_kind == CentreKind.OPTIMISED)
    if fitted.without_search is not None:
        parts.append(f"{int(searched.sum()):,} centres found by search, mean error {fitted.without_search:.4f} before")
    return ", ".join(parts)


def _regularised(regions: Regions, energies: np.ndarray) -> str:
    before, after = (float(values.max(initial=0.0)) for values in (regions.mismatch_before, regions.mismatch_after))
    return (
        f"{len(energies)} sweeps, worst step at a boundary {before:.3f} → {after:.3f}, "
        f"mean error {mean_error(regions.fitted.rmse):.4f} → {mean_error(regions.regularised.rmse):.4f}"
    )


def _since(begin: float) -> float:
    return max(time.perf_counter() - begin, 1e-9)
