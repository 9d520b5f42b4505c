"""The bake on one page: scene → samples → trace → solve → result."""

from __future__ import annotations

import time
from collections.abc import Generator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from bake import __version__
from bake.decorator_types import Decorators, FogBoxes
from bake.decorators.fog import make_fog
from bake.decorators.local_ao import StagesLent
from bake.decorators.resampling import resample_surfaces
from bake.decorators.trees import bake_trees
from bake.devices import Device, resolve
from bake.errors import SceneError
from bake.regions.region_stage import bake_regions, find_regions, remodelled
from bake.regions.source_files import region_files
from bake.results import check_destination, is_current, load_result, save_result
from bake.samples import place_samples
from bake.scene import flatten, load_unchecked, looked_over, read_bake_options, samplable_faces
from bake.settings import BakeSettings, TracerKind
from bake.solve import map_ahead, map_to_vertices
from bake.solve.importance import SampleImportance
from bake.stages import Running, StageClock, patiently
from bake.trace import Tracer, create_tracer
from bake.trace.adaptive import PILOT, RayPlan, trace_adaptively
from bake.types import BakeResult, Finding, Progress, Role, SampleSet, Scene, Tally, VertexField, VertexState, World

_NO_SURFACE = "no surface receives ambient obscurance"


@dataclass(frozen=True, slots=True)
class BakeRequest:
    """What to bake, and where to.

    Attributes:
        scene_path: A scene file.
        result_path: A folder: absent, empty or a result that will be replaced.
        options: Options by long name as the user gave them; they win over the side file's `[bake]` table.
    """

    scene_path: Path
    result_path: Path
    options: Mapping[str, Any] = field(default_factory=dict[str, Any])


@dataclass(frozen=True, slots=True)
class BakeOutcome:
    """What came of it.

    Attributes:
        result: The result as it is stored.
        unchanged: The stored result was already the one asked for; nothing was traced.
        seconds: From the request to the stored result.
        traced: Whether any ray was traced: not if only the models of regions had to be made anew.
    """

    result: BakeResult
    unchanged: bool
    seconds: float
    traced: bool = True


def run_bake(request: BakeRequest) -> Generator[Progress, None, BakeOutcome]:
    """Bakes a scene file into a result folder; close the generator to cancel.

    Raises:
        InputError: the options, the scene or the destination cannot be used; raised before any ray is traced.
        ObscuraError: a device failed or the result could not be stored. What was in the folder stays.
    """
    clock = StageClock()
    settings = settings_for(request.scene_path, request.options)  # refused, if need be, before the scene is read
    check_destination(request.result_path)
    scene, seconds = yield from patiently(
        "load", lambda: load_unchecked(request.scene_path, crease_angle=settings.crease_angle)
    )
    clock.ran("process geometry", f"{len(scene.objects)} objects, {len(scene.meshes)} meshes", seconds)
    device = resolve(settings.device)
    scene = replace(scene, files={**scene.files, **region_files(scene, settings)})
    if _is_current(request.result_path, scene, settings, device):
        return BakeOutcome(load_result(request.result_path, verify=False), True, clock.seconds, False)
    has_rays = _is_current(request.result_path, scene, settings, device, apart_from="regions")
    if has_rays:
        stored = load_result(request.result_path, verify=False)
        result = yield from remodelled(stored, settings, clock)
    else:
        result = yield from bake(scene, settings, device, clock, look_over=True)
    yield Progress("store", 0, 0, clock.seconds)
    save_result(result, request.result_path)  # not to be stopped half-way: it ends either stored or not begun
    return BakeOutcome(result, False, clock.seconds, not has_rays)


def bake(
    scene: Scene, settings: BakeSettings, device: Device, clock: StageClock, *, look_over: bool = False
) -> Generator[Progress, None, BakeResult]:
    """Bakes a loaded scene; the stages in order. What rays need not wait for is worked on beside them.

    Args:
        scene: As loaded.
        settings: How to bake it.
        device: Where to.
        clock: Takes the stages' rows.
        look_over: It was loaded unchecked: before any ray is traced, it is looked over.
    """
    looking = Running("load", lambda: looked_over(scene)) if look_over else None
    world, seconds = yield from patiently("flatten", lambda: flatten(scene, settings))
    clock.ran("flatten", f"{world.face_count:,} faces, {world.vertex_count:,} vertices", seconds)
    welding = Running("solve", lambda: map_ahead(world, settings))

    samples, seconds = yield from patiently("samples", lambda: place_samples(world, settings))
    if len(samples) == 0 and not any_decorators(world, settings):
        raise SceneError(
            "nothing receives ambient obscurance", where=str(scene.path), remedy="check the objects' roles"
        )
    clock.ran("sample surface", f"{len(samples):,} samples", seconds)

    fog = yield from fog_stage(world, settings, clock)
    tracer, seconds = yield from open_tracer(world, settings, device, fog)
    clock.ran("build BVH", occluders(world, tracer), seconds)
    with tracer:
        if looking is not None:
            scene, seconds = yield from looking.ended()
            clock.beside("process geometry", "looked over", seconds)
        if not device.is_cuda:  # rays take all processors
            yield from welding.ended()
        space = yield from find_regions(scene, world, settings, tracer, clock)  # refused, if need be, before the rest
        tally = yield from trace(tracer, samples, settings, clock)
        trees = yield from bake_trees(scene, world, settings, tracer, lent_stages(device), clock)
        dynamic = yield from bake_regions(space, settings, tracer, clock)

    valid = tally.valid(settings.back_face_threshold)
    ahead, welded_in = yield from welding.ended()
    solved, seconds = yield from patiently(
        "solve", lambda: map_to_vertices(world, samples, tally.ao, valid, settings, ahead=ahead)
    )
    report = solved.report
    if report.unknowns:
        clock.ran("map to vertices", f"{report.unknowns:,} unknowns, {report.iterations} iterations", seconds)
        clock.beside("map to vertices", "welded", welded_in)
    else:
        clock.skipped("map to vertices", _NO_SURFACE)
    around = yield from resample_surfaces(
        world,
        solved,
        settings,
        clock,
        caster=lambda baked: open_tracer(baked, settings, device),
        sampler=place_samples,
        mapper=map_to_vertices,
        samplable=samplable_faces,
    )
    decorators = Decorators(
        fog=fog,
        volume=trees.volume if trees else None,
        models=trees.models if trees else (),
        fits=trees.fits if trees else None,
        shrub_scalars=around.shrub_scalars,
        small_scalars=around.small_scalars,
    )
    return BakeResult(
        scene_path=scene.path.resolve(),
        files=scene.files,
        settings=settings,
        world=world,
        samples=samples,
        tally=tally,
        field=around.field,
        stages=tuple(clock.rows),
        findings=(
            *scene.findings,
            *bake_findings(world, samples, valid, solved),
            *(trees.findings if trees else ()),
            *around.findings,
            *(dynamic.findings if dynamic else ()),
        ),
        device=tracer.device,
        tracer=tracer.name,
        rays_skipped=len(samples) * settings.rays - int(tally.rays.sum(dtype=np.int64)),
        versions=versions(),
        decorators=None if decorators == Decorators() else decorators,
        regions=dynamic.regions if dynamic else None,
    )


def trace(
    tracer: Tracer, samples: SampleSet, settings: BakeSettings, clock: StageClock
) -> Generator[Progress, None, Tally]:
    """Traces every sample: with all of its rays, or with as many as it needs."""
    tally = Tally.empty(len(samples), settings.distance_count)
    if len(samples) == 0:
        clock.skipped("trace", _NO_SURFACE)
        return tally
    if settings.adaptive_error is not None:
        return (yield from _trace_adaptively(tracer, samples, settings, clock))
    begin, total, seconds = time.perf_counter(), len(samples) * settings.rays, 0.0
    for batch in samples.batches(tracer.batch_size):
        tracer.accumulate(samples, batch, tally)
        done, seconds = batch.stop * settings.rays, time.perf_counter() - begin
        yield Progress("trace", done, total, seconds, done / max(seconds, 1e-9))
    clock.ran("trace", f"{settings.rays} rays a sample", seconds, total)
    return tally


def _trace_adaptively(
    tracer: Tracer, samples: SampleSet, settings: BakeSettings, clock: StageClock
) -> Generator[Progress, None, Tally]:
    importance, ahead = yield from patiently("trace", lambda: SampleImportance(tracer.world, samples, settings))
    begin = time.perf_counter()
    tally, plan = yield from trace_adaptively(tracer, samples, importance.of, settings)
    sent = int(plan.rays.sum())
    clock.ran("trace", _skipped_rays(plan, settings), ahead + time.perf_counter() - begin, sent)
    return tally


def _skipped_rays(plan: RayPlan, settings: BakeSettings) -> str:
    """For the report: how many rays were left out, and why."""
    sent, count = int(plan.rays.sum()), len(plan.rays)
    whole = int(np.count_nonzero(plan.rays == settings.rays))
    behind, free = (
        int(np.count_nonzero(samples)) * (settings.rays - PILOT) for samples in (plan.buried, plan.unreachable)
    )
    left = count * settings.rays - sent
    return (
        f"{sent / count:.1f} rays a sample of up to {settings.rays}: {left:,} skipped, of them {behind:,} behind "
        f"walls, {free:,} in the open and {left - behind - free:,} where the noise is low enough; {plan.settling:,} "
        f"sent to settle validity; {whole:,} samples sent all; estimated noise {plan.noise:.4f}, "
        f"doubt {plan.doubt:.4f}"
    )


def lent_stages(device: Device) -> StagesLent:
    """What baking a tree alone needs of the other stages."""
    return StagesLent(flatten, place_samples, partial(create_tracer, device=device), map_to_vertices)


def any_decorators(world: World, settings: BakeSettings) -> bool:
    """Whether a scene without a surface sample has trees, shrubs or small decorators to bake."""
    baked_by = {Role.TREE: "trees", Role.SHRUB: "decorators", Role.SMALL: "decorators"}
    has_faces = np.diff(world.first_face) > 0
    return any(
        has_faces[number] and role in baked_by and baked_by[role] not in settings.skip
        for number, role in enumerate(world.object_roles)
    )


def fog_stage(world: World, settings: BakeSettings, clock: StageClock) -> Generator[Progress, None, FogBoxes | None]:
    """Shrubs as boxes of fog, or the reason why there are none."""
    shrubs = world.object_roles.count(Role.SHRUB)
    if shrubs == 0 or "fog" in settings.skip:
        clock.skipped("fog", "asked for by --skip" if shrubs else "no shrubs in the scene")
        return None
    fog, seconds = yield from patiently("fog", lambda: make_fog(world, settings))
    if fog is None:
        clock.skipped("fog", f"{shrubs:,} shrubs without faces")
        return None
    lowered = int(np.count_nonzero(fog.density < fog.given_density))
    clock.ran("fog", f"{len(fog):,} boxes, {lowered:,} thinned where they overlap", seconds)
    return fog


def open_tracer(
    world: World, settings: BakeSettings, device: Device, fog: FogBoxes | None = None
) -> Generator[Progress, None, tuple[Tracer, float]]:
    """A tracer over a world, and the seconds that it took."""
    if not device.is_cuda:
        return (yield from patiently("build BVH", lambda: create_tracer(world, settings, device, fog=fog)))
    # CUDA builds fast, and Warp's objects are best made and used on one thread.
    yield Progress("build BVH", 0, 0)
    begin = time.perf_counter()
    return create_tracer(world, settings, device, fog=fog), time.perf_counter() - begin


def occluders(world: World, tracer: Tracer) -> str:
    """What rays can meet, for the report: only what there is."""
    counts = {
        "triangles": int(world.face_casts.sum()),
        "boxes of fog": tracer.fog_boxes,
        "triangles of trees": tracer.tree_triangles,
    }
    return ", ".join(f"{count:,} {what}" for what, count in counts.items() if count) or "nothing casts"


def settings_for(scene_path: Path, options: Mapping[str, Any]) -> BakeSettings:
    """The settings that hold for a scene: its side file's `[bake]` table, overruled by explicit options.

    Raises:
        InputError: an option of either is wrong; the message names the side file if it is at fault.
    """
    BakeSettings.from_options(options)
    own, side_file = read_bake_options(scene_path)
    BakeSettings.from_options(own, where=side_file)
    return BakeSettings.from_options({**own, **options})


def versions() -> dict[str, str]:
    """Versions that a result depends on."""
    return dict(_versions())


@cache
def _versions() -> Mapping[str, str]:
    from importlib.metadata import PackageNotFoundError, version

    found = {"obscura": __version__, "numpy": np.__version__}
    for package in ("scipy", "warp-lang", "embreex"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def _is_current(folder: Path, scene: Scene, settings: BakeSettings, device: Device, *, apart_from: str = "") -> bool:
    kind = settings.tracer
    if kind is TracerKind.AUTO:
        kind = TracerKind.WARP if device.is_cuda else TracerKind.EMBREE
    name = device.name if device.is_cuda else "cpu"
    return is_current(
        folder,
        files=scene.files,
        settings=settings,
        device=name,
        tracer=kind.value,
        versions=versions(),
        apart_from=apart_from,
    )


def bake_findings(world: World, samples: SampleSet, valid: np.ndarray, solved: VertexField) -> list[Finding]:
    """Per object: samples that the back-face rule threw away, and vertices that had to be filled."""
    findings: list[Finding] = []
    invalid = np.bincount(world.face_object[samples.face[~valid]], minlength=world.object_count)
    totals = np.bincount(world.face_object[samples.face], minlength=world.object_count)
    filled = (
        np.add.reduceat(np.append(solved.state == VertexState.FILLED, False).astype(np.int64), world.first_vertex[:-1])
        if world.object_count
        else np.zeros(0, np.int64)
    )
    filled[np.diff(world.first_vertex) == 0] = 0
    for i, path in enumerate(world.object_paths):
        if invalid[i]:
            share = 100.0 * invalid[i] / totals[i]
            detail = f"{invalid[i]:,} of {totals[i]:,} samples ({share:.0f} %) see too many back faces"
            findings.append(Finding(path, "invalid-samples", int(invalid[i]), detail))
        if filled[i]:
            detail = f"{filled[i]:,} vertices had no valid sample and were filled from their neighbours"
            findings.append(Finding(path, "filled-vertices", int(filled[i]), detail))
    return findings


__all__ = [
    "BakeOutcome",
    "BakeRequest",
    "any_decorators",
    "bake",
    "bake_findings",
    "fog_stage",
    "lent_stages",
    "occluders",
    "open_tracer",
    "run_bake",
    "settings_for",
    "trace",
    "versions",
]
