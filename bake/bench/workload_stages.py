"""Runs a workload stage by stage, tracing a share of its points where all would take too long."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.scaling_device import warm_up
from bake.decorator_types import FogBoxes
from bake.decorators.lods import FinestSearch, finest_levels, lod_world
from bake.decorators.resample import BakedSurface
from bake.decorators.small import objects_of
from bake.decorators.trees import bake_trees
from bake.devices import Device, resolve
from bake.pipeline import fog_stage, lent_stages, open_tracer, settings_for, trace
from bake.regions.probes import trace_points
from bake.regions.region_stage import find_regions, model_regions
from bake.samples import place_samples
from bake.scene import flatten, load_scene, samplable_faces
from bake.settings import BakeSettings
from bake.solve import map_to_vertices
from bake.stages import StageClock, drained, peak_memory_mb
from bake.trace import Tracer
from bake.types import Int64Array, Role, Scene, Tally, VertexField, World

_RUN = 64
"""Samples side by side that are traced together, as they would be if all were."""


@dataclass(frozen=True, slots=True)
class Stage:
    """What one stage did.

    Attributes:
        name: As in `workload_published`.
        seconds: For all of its work; extrapolated where `share` is below 1.
        rays: For all of its work.
        share: The part of its points that was traced.
        work: What it did, in words.
    """

    name: str
    seconds: float
    rays: int = 0
    share: float = 1.0
    work: str = ""


def run_stages(scene_path: Path, options: Mapping[str, Any], share: float) -> dict[str, Any]:
    """Every stage of a bake in its order, but for storing.

    Where a share is traced, the points in between take on the values of those before them, so that the solves and the
    models have their full size.

    Args:
        scene_path: A scene.
        options: Bake options by long name.
        share: In (0, 1]: the part of surface samples, region points and samples of lower levels that is traced; trees
            are traced in full.

    Returns:
        `stages`, a list of `Stage`; `tracer` and `peak memory MB`.
    """
    warm_up({name: options[name] for name in ("device", "tracer", "rays") if name in options})
    settings = settings_for(scene_path, options)
    device, run = resolve(settings.device), _Run()
    begin = time.perf_counter()
    scene = load_scene(scene_path, crease_angle=settings.crease_angle)
    run.add("process geometry", begin, work=f"{len(scene.objects):,} objects")
    begin = time.perf_counter()
    world = flatten(scene, settings)
    run.add("flatten", begin, work=f"{world.vertex_count:,} vertices, {world.face_count:,} faces")
    begin = time.perf_counter()
    samples = place_samples(world, settings)
    run.add("sample surface", begin, work=f"{len(samples):,} samples")
    fog: FogBoxes | None = drained(fog_stage(world, settings, run.clock))
    run.take_clock()
    tracer, seconds = drained(open_tracer(world, settings, device, fog))
    run.stages.append(Stage("build BVH", seconds, work=f"{int(world.face_casts.sum()):,} triangles"))
    with tracer:
        space = drained(find_regions(scene, world, settings, tracer, run.clock))
        run.take_clock()
        rows = chosen(len(samples), share)
        some: Tally = drained(trace(tracer, samples.only(rows), settings, run.clock))
        run.take_clock(len(rows) / max(len(samples), 1))
        fill = filled_from(rows, len(samples))
        tally = Tally(some.ao[fill], some.rays[fill], some.hits[fill], some.back_faces[fill])
        _trees(scene, world, settings, device, tracer, run)
        if space is not None:
            _regions(space, settings, tracer, share, run)
    valid = tally.valid(settings.back_face_threshold)
    begin = time.perf_counter()
    solved = map_to_vertices(world, samples, tally.ao, valid, settings)
    work = f"{solved.report.unknowns:,} unknowns, {solved.report.iterations} iterations"
    run.add("map to vertices", begin, work=work)
    if Role.LOD in world.object_roles:
        _lods(world, solved, settings, device, share, run)
    name = f"{tracer.name} on {tracer.device}"
    return {"stages": run.stages, "tracer": name, "peak memory MB": peak_memory_mb()}


def chosen(count: int, share: float) -> Int64Array:
    """Numbers of the points that are traced: runs of 64 side by side, evenly spread over all."""
    if share >= 1.0:
        return np.arange(count, dtype=np.int64)
    every = max(1, round(1.0 / share))
    number = np.arange(count, dtype=np.int64)
    return number[(number // _RUN) % every == 0]


def filled_from(rows: Int64Array, count: int) -> Int64Array:
    """For each of `count` points the place in `rows` of the last one traced up to it, shape (count,)."""
    return np.searchsorted(rows, np.arange(count), side="right") - 1


class _Run:
    """Stages as they come, those of the bake's own report among them."""

    def __init__(self) -> None:
        self.stages: list[Stage] = []
        self.clock = StageClock()
        self._taken = 0

    def add(self, name: str, begin: float, rays: int = 0, share: float = 1.0, work: str = "") -> None:
        seconds = time.perf_counter() - begin
        self.stages.append(Stage(name, seconds / share, round(rays / share), share, work))

    def take_clock(self, share: float = 1.0) -> None:
        """What the report has got since the last time; stages that were skipped are left out."""
        for row in self.clock.rows[self._taken :]:
            if row.status == "ran":
                rays = round(row.rays / share)
                self.stages.append(Stage(row.name, row.seconds / share, rays, share, row.why))
        self._taken = len(self.clock.rows)


def _trees(scene: Scene, world: World, settings: BakeSettings, device: Device, tracer: Tracer, run: _Run) -> None:
    drained(bake_trees(scene, world, settings, tracer, lent_stages(device), run.clock))
    run.take_clock()


def _regions(space: Any, settings: BakeSettings, tracer: Tracer, share: float, run: _Run) -> None:
    valid: Int64Array = np.flatnonzero(space.valid)
    rows = chosen(len(valid), share)
    wanted = np.zeros(len(space.valid), np.bool_)
    wanted[valid[rows]] = True
    begin = time.perf_counter()
    points = drained(trace_points(space.graph, wanted, tracer, settings))
    part = len(rows) / max(len(valid), 1)
    run.add("region probes", begin, len(rows) * settings.region_directions, part, f"{len(valid):,} points")
    fill = filled_from(rows, len(valid))
    state = points.state.copy()
    state[valid] = points.state[valid[rows]][fill]
    points = dataclasses.replace(
        points, state=state, traced=valid.astype(np.int32), sh=points.sh[fill], windowed=points.windowed[fill]
    )
    drained(model_regions(space.graph, points, settings, run.clock))
    run.take_clock()


def _lods(world: World, solved: VertexField, settings: BakeSettings, device: Device, share: float, run: _Run) -> None:
    begin = time.perf_counter()
    surface = BakedSurface.of(world, solved)
    bare = dataclasses.replace(world, face_casts=surface.carries, object_roles=(Role.IGNORE,) * world.object_count)
    tracer, _ = drained(open_tracer(bare, settings, device))
    run.add("BVH of baked surface", begin, work=f"{int(surface.carries.sum()):,} triangles")
    own = settings.replaced(weld_instances=False)
    with tracer:
        begin = time.perf_counter()
        lods = objects_of(world, Role.LOD)
        finest = finest_levels(world, lods)
        alone = lod_world(world, lods, samplable_faces)
        samples = place_samples(alone, own)
        rows = chosen(len(samples), share)
        search = FinestSearch(world, surface, tracer, samples.only(rows), lods, finest)
        whole = time.perf_counter() - begin
        begin = time.perf_counter()
        drained(search.run())
        part = len(rows) / max(len(samples), 1)
        seconds = whole + (time.perf_counter() - begin) / part
        run.stages.append(Stage("resample LODs", seconds, round(search.rays / part), part, f"{len(samples):,} samples"))
    fill = filled_from(rows, len(samples))
    begin = time.perf_counter()
    field = map_to_vertices(alone, samples, search.ao[fill], search.found[fill], own)
    work = f"{field.report.unknowns:,} unknowns, {field.report.iterations} iterations"
    run.add("map LODs", begin, work=work)
