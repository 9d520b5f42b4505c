"""What dynamic regions hold, how well their models fit, what they cost, and what a walk through them shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.kept_regions import Traced, keep, kept, kept_file
from bake.bench.table import Measurements, bake_seed
from bake.decorators.fog import make_fog
from bake.devices import resolve
from bake.pipeline import settings_for
from bake.region_types import PointState, Regions
from bake.regions.packed import INDEX_BYTES, MODEL_BYTES
from bake.regions.region_stage import bake_regions, find_regions, model_regions
from bake.regions.upright import find_up
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.stages import StageClock, drained
from bake.trace import create_tracer
from bake.walk import STEP_BOUND, Variant, Walk, WalkMetrics, WalkOptions, lay_out, simulate, trace_truth
from bake.walk.tour import tour

PAPER_POINTS = 332_741
PAPER_SECONDS = 9.2
"""Dynamic points and their seconds in Table 1 of Sloan et al. 2013, 1,024 rays each, on a K20."""

STEP_RATIO = 3.0
ERROR_RISE = 0.01


@dataclass(frozen=True, slots=True)
class WalkedScene:
    """A scene's regions and the walk through them.

    Attributes:
        name: The scene's.
        distances: Of the AO columns, metres.
        regions: As baked.
        walks: One for each distance.
        length: Of the tour, metres.
    """

    name: str
    distances: tuple[float, ...]
    regions: Regions
    walks: tuple[Walk, ...]
    length: float


@dataclass(frozen=True, slots=True)
class RegionBench:
    """All that was measured.

    Attributes:
        tables: One of the regions, one of the walks.
        scenes: What can be plotted.
    """

    tables: tuple[Measurements, Measurements]
    scenes: tuple[WalkedScene, ...]


def measure_regions(scenes: Sequence[Path], options: Mapping[str, Any], *, folder: Path | None = None) -> RegionBench:
    """Bakes the regions of scenes, and nothing else of them, and takes a tour through each.

    Args:
        scenes: Scene files.
        options: Bake options by long name; regions are automatic unless they say something else.
        folder: What is traced is kept there, and taken from there where scene and settings are the same.
    """
    rows: list[dict[str, Any]] = []
    walk_rows: list[dict[str, Any]] = []
    walked: list[WalkedScene] = []
    for path in scenes:
        row, scene = _measure(path, {"regions": "auto", **options}, folder)
        rows.append(row)
        if scene is not None:
            walked.append(scene)
            for walk, distance in zip(scene.walks, scene.distances, strict=True):
                walk_rows += _walk_rows(scene, walk, distance)
    notes = [
        f"× paper: seconds for {PAPER_POINTS:,} points at this rate over the {PAPER_SECONDS:g} s of Table 1 of "
        "Sloan et al. 2013 (1,024 rays each, on a K20)",
        "fit: RMSE of AO at the valid points over six normals, of each region's own model; mean over regions, worst; "
        "then the mean after the regularisation",
        "mismatch: largest step of AO over six normals at the middle of a boundary; mean over boundaries, worst",
        "made and traced: seconds when it was traced, also where that is taken from --keep",
        "engine: bytes of the packed models, linear harmonics of one function; stored: quadratic, all distances, "
        "fitted and regularised",
    ]
    how = WalkOptions()
    walk_notes = [
        f"{how.speed:g} m/s at {how.frame_rate:g} Hz; blended: with a half-life of {how.half_life:g} s",
        "steps: largest change of AO from frame to frame over seven normals (six axes and up); boundary: on the frames "
        "on which the region changed",
        f"gates: regularisation lowers the worst boundary step at least {STEP_RATIO:g} times while the mean error "
        f"against what is traced rises by at most {ERROR_RISE:g}; no blended frame steps by more than {STEP_BOUND:g}",
    ]
    seeds = {"bake": bake_seed(options)}
    tables = (
        Measurements("regions", rows, notes, seeds=seeds),
        Measurements("region walks", walk_rows, walk_notes, seeds=seeds),
    )
    return RegionBench(tables, tuple(walked))


def _measure(path: Path, options: Mapping[str, Any], folder: Path | None) -> tuple[dict[str, Any], WalkedScene | None]:
    settings = settings_for(path, options)
    file = None if folder is None else kept_file(folder, path, settings)
    traced = None if file is None else kept(file)
    if traced is None:
        traced = _traced(path, settings)
        if traced is None:
            return {"scene": path.stem, "regions": 0}, None
        if file is not None:
            keep(file, traced)
    clock = StageClock()
    regions = drained(model_regions(traced.graph, traced.points, settings, clock)).regions
    row = {"scene": path.stem, **_region_row(regions, traced, settings, clock)}
    how = WalkOptions()
    course = lay_out(regions, traced.path, speed=how.speed, frame_rate=how.frame_rate)
    walks = tuple(
        simulate(regions, traced.path, WalkOptions(column=column), truth=traced.truth, course=course)
        for column in range(settings.distance_count)
    )
    row |= {"toured": traced.toured, "tour m": traced.path.length}
    return row, WalkedScene(path.stem, settings.column_distances, regions, walks, traced.path.length)


def _traced(path: Path, settings: BakeSettings) -> Traced | None:
    """Finds and traces the regions of a scene, and a tour through them; None if there are none."""
    scene = load_scene(path, crease_angle=settings.crease_angle)
    world = flatten(scene, settings)
    clock = StageClock()
    with create_tracer(world, settings, resolve(settings.device), fog=make_fog(world, settings)) as tracer:
        space = drained(find_regions(scene, world, settings, tracer, clock))
        outcome = drained(bake_regions(space, settings, tracer, clock))
        if space is None or outcome is None:
            return None
        regions = outcome.regions
        made = tour(regions, world, tracer.nearest, find_up(scene, world, settings))
        truth = drained(
            trace_truth(made.path, tracer, seed=settings.seed, back_face_threshold=settings.back_face_threshold)
        )
    seconds = {stage.name: stage.seconds for stage in clock.rows}
    visited = int(made.visited.sum())
    return Traced(regions.graph, regions.points, made.path, truth, visited, space.coverage, seconds)


def _region_row(regions: Regions, traced: Traced, settings: BakeSettings, clock: StageClock) -> dict[str, Any]:
    seconds = traced.seconds | {stage.name: stage.seconds for stage in clock.rows}
    points, graph = regions.points, regions.graph
    valid = int(np.count_nonzero(points.state == PointState.VALID))
    rate = len(points.traced) / seconds["region probes"]
    models = len(np.unique(regions.owner))
    regularised = regions.regularised
    row: dict[str, Any] = {
        "regions": len(graph),
        "links": len(graph.link),
        "floor covered %": None if np.isnan(traced.coverage) else 100.0 * traced.coverage,
        "valid points": valid,
        "dropped": int(np.count_nonzero(points.state == PointState.BACK_FACES)),
        "absorbed": len(regions.absorbed),
        "made s": seconds["regions"],
        "traced s": seconds["region probes"],
        "points/s": rate,
        "× paper": PAPER_POINTS / rate / PAPER_SECONDS,
        "fitted s": seconds["fit regions"],
        "regularised s": seconds["regularise regions"],
        "engine kB": (models * MODEL_BYTES + len(graph) * INDEX_BYTES) / 1e3,
        "stored kB": sum(model.coefficients.nbytes + model.centre.nbytes for model in (regions.fitted, regularised))
        / 1e3,
    }
    for column, distance in enumerate(settings.column_distances):
        fit, after = (models_.rmse[:, column] for models_ in (regions.fitted, regularised))
        before, late = regions.mismatch_before[:, column], regions.mismatch_after[:, column]
        row |= {
            f"fit {distance:g} m": _means(fit) + f", {_mean(after):.3f}",
            f"mismatch {distance:g} m": f"{_means(before)} → {_means(late)}",
        }
    return row


def _walk_rows(scene: WalkedScene, walk: Walk, distance: float) -> list[dict[str, Any]]:
    raw = walk.metrics[Variant.RAW]
    rows: list[dict[str, Any]] = []
    for variant, m in walk.metrics.items():
        row: dict[str, Any] = {
            "scene": scene.name,
            "distance m": distance,
            "variant": str(variant),
            "worst step": m.worst_step,
            "codes": m.worst_codes,
            "p99.9 step": m.high_step,
            "boundary step": m.worst_boundary_step,
            "jump ratio": m.jump_ratio,
            "variation": m.excess_variation,
            "lag s": m.lag,
            "mean error": m.mean_error,
            "max error": m.max_error,
            "pops": m.pops,
        }
        gate = _gate(variant, m, raw)
        rows.append(row if gate is None else {**row, **gate})
    return rows


def _gate(variant: Variant, found: WalkMetrics, raw: WalkMetrics) -> dict[str, Any] | None:
    if variant is Variant.REGULARISED:
        ratio = raw.worst_boundary_step / max(found.worst_boundary_step, 1e-9)
        rise = found.mean_error - raw.mean_error
        return {"× lower": ratio, "error rise": rise, "passed": ratio >= STEP_RATIO and rise <= ERROR_RISE}
    if variant in (Variant.BLENDED, Variant.SPATIAL_BLENDED):
        return {"passed": found.worst_step <= STEP_BOUND}
    return None


def _mean(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else float("nan")


def _means(values: np.ndarray) -> str:
    known = values[np.isfinite(values)]
    return f"{_mean(values):.3f}, {known.max(initial=0.0):.3f}"
