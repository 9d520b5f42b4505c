"""A rebake on one page: what the edit can reach, its rays, its values, and what hangs on them."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator

import numpy as np

from bake.devices import Device
from bake.errors import SceneError
from bake.pipeline import any_decorators, bake_findings, occluders, open_tracer, versions
from bake.rebake.changes import changed_objects
from bake.rebake.decorated import rebaked_around, rebaked_regions, rebaked_trees
from bake.rebake.reach import Places
from bake.rebake.setting_changes import SOLVE
from bake.rebake.state import Edit, State
from bake.rebake.surface_rays import SurfaceRays, SurfaceRows, plan_rows, trace_rows
from bake.rebake.types import Partial, RebakeOutcome, RebakeReport
from bake.samples import place_samples
from bake.solve.update import FieldKeeper, FieldUpdate
from bake.stages import StageClock, patiently
from bake.types import BakeResult, Decorators, Int64Array, Progress, SampleSet, Skipped, VertexField


def follow(
    state: State,
    edit: Edit,
    device: Device,
    clock: StageClock,
    *,
    bound: float,
    first: Callable[[], Int64Array] | None = None,
) -> Generator[Progress | Partial, None, tuple[State, RebakeOutcome]]:
    """The state after an edit, and what the user gets of it; the state before it is left as it is.

    Args:
        state: Before.
        edit: What differs.
        device: Where to trace.
        clock: Gets a row for each stage.
        bound: Most AO that may be skipped for a sample.
        first: See `RebakeSession.rebake`.
    """
    world, settings = edit.world, edit.settings
    samples, seconds = yield from patiently("samples", lambda: place_samples(world, settings))
    if len(samples) == 0 and not any_decorators(world, settings):
        raise SceneError(
            "nothing receives ambient obscurance", where=str(edit.scene.path), remedy="check the objects' roles"
        )
    clock.ran("sample surface", f"{len(samples):,} samples", seconds)
    (places, rows), seconds = yield from patiently("reach", lambda: _planned(state, edit, samples, bound))
    clock.ran("reach", f"{int(rows.whole.sum()):,} samples whole, {int(rows.check.sum()):,} in part", seconds)

    tracer, seconds = yield from open_tracer(world, settings, device, edit.fog)
    clock.ran("build BVH", occluders(world, tracer), seconds)
    try:
        begin = time.perf_counter()
        rays = yield from trace_rows(state, edit, samples, rows, tracer, first)
        clock.ran("trace", f"{len(rays.changed):,} samples changed", time.perf_counter() - begin, rays.rays_traced)
        update = yield from _solved(state, edit, samples, rays, clock)
        field = _adopted(state, edit, update.field)
        shown = _changed_vertices(state, edit, field)
        yield Partial(shown, field.ao[shown], rays.rays_traced, rays.rays_traced, final=True)
        trees = yield from rebaked_trees(state, edit, tracer, device, clock)
        dynamic = yield from rebaked_regions(state, edit, tracer, clock)
        around = yield from rebaked_around(state, edit, field, changed=len(shown) > 0, device=device, clock=clock)
    except BaseException:
        tracer.close()
        raise
    decorators = Decorators(
        fog=edit.fog,
        volume=trees.volume if trees else None,
        models=trees.models if trees else (),
        fits=trees.fits if trees else None,
        shrub_scalars=around.shrub_scalars,
        small_scalars=around.small_scalars,
    )
    valid = rays.tally.valid(settings.back_face_threshold)
    result = BakeResult(
        scene_path=edit.scene.path.resolve(),
        files=edit.scene.files,
        settings=settings,
        world=world,
        samples=samples,
        tally=rays.tally,
        field=around.field,
        stages=tuple(clock.rows),
        findings=(
            *edit.scene.findings,
            *bake_findings(world, samples, valid, update.field),
            *(trees.findings if trees else ()),
            *around.findings,
            *(dynamic.findings if dynamic else ()),
        ),
        device=tracer.device,
        tracer=tracer.name,
        rays_skipped=int(rays.tally.rays.sum(dtype=np.int64)) - rays.rays_traced,
        versions=versions(),
        decorators=None if decorators == Decorators() else decorators,
        regions=dynamic.regions if dynamic else None,
        skipped=_skipped(rows.skipped),
        stale=_stale(state, edit, samples, rows),
    )
    report = _report(state, edit, samples, rows, rays, shown, clock)
    after = State(result, edit.scene, tracer, update.keeper, places)
    return after, RebakeOutcome(result, report)


def _planned(state: State, edit: Edit, samples: SampleSet, bound: float) -> tuple[Places, SurfaceRows]:
    places = Places.of_samples(edit.world, samples)
    return places, plan_rows(state, edit, samples, places, bound)


def _solved(
    state: State, edit: Edit, samples: SampleSet, rays: SurfaceRays, clock: StageClock
) -> Generator[Progress, None, FieldUpdate]:
    """Values at the vertices; carried where nothing that they hang on changed."""
    threshold = edit.settings.back_face_threshold
    valid = rays.tally.valid(threshold)
    result = state.result

    def solve() -> FieldUpdate:
        keeper = state.keeper or FieldKeeper(
            result.world,
            result.samples,
            result.tally.ao,
            result.tally.valid(result.settings.back_face_threshold),
            result.settings,
        )
        changed = rays.changed
        if "back_face_threshold" in edit.settings_change.names:
            changed = np.union1d(
                changed, np.flatnonzero(valid != rays.tally.valid(result.settings.back_face_threshold))
            )
        return keeper.updated(
            edit.world, samples, rays.tally.ao, valid, edit.change, changed, edit.settings, tolerance=0.0
        )

    update, seconds = yield from patiently("solve", solve)
    report = update.field.report
    clock.ran("map to vertices", f"{update.solved:,} of {report.unknowns:,} unknowns", seconds)
    return update


def _adopted(state: State, edit: Edit, solved: VertexField) -> VertexField:
    """The values, with those left as they were that nobody asked for and that have some."""
    if not edit.selects:
        return solved
    known = np.flatnonzero(~edit.wanted & (edit.change.old_vertex >= 0))
    former = edit.change.old_vertex[known]
    before = state.result.field
    kept = np.isfinite(before.ao[former]).all(axis=1) & np.isfinite(solved.ao[known]).all(axis=1)
    ao, state_of = solved.ao.copy(), solved.state.copy()
    ao[known[kept]], state_of[known[kept]] = before.ao[former[kept]], before.state[former[kept]]
    return VertexField(ao, state_of, solved.report)


def _changed_vertices(state: State, edit: Edit, field: VertexField) -> Int64Array:
    """Vertices whose value is another one than the old world's, or that are new, shape (v,)."""
    former = edit.change.old_vertex
    known = former >= 0
    differs = ~known & np.isfinite(field.ao).any(axis=1)
    a, b = field.ao[known], state.result.field.ao[former[known]]
    differs[known] = ~((a == b) | (np.isnan(a) & np.isnan(b))).all(axis=1)
    return np.flatnonzero(differs).astype(np.int64)


def _skipped(samples: np.ndarray) -> Skipped | None:
    if not samples.any():
        return None
    nothing = np.zeros(0, np.float32)
    return Skipped(samples, nothing, nothing, nothing)


def _stale(state: State, edit: Edit, samples: SampleSet, rows: SurfaceRows) -> tuple[str, ...]:
    """Objects that are older than the rest: just left alone, or before and not asked for now."""
    if not edit.selects:
        return ()
    world = edit.world
    stale = np.zeros(world.object_count, np.bool_)
    stale[world.face_object[samples.face[rows.stale]]] = True
    unwanted = np.zeros(world.object_count, np.bool_)
    unwanted[world.face_object[~edit.wanted_faces & world.face_samples]] = True
    if edit.settings_change.any_of(SOLVE):
        stale |= unwanted
    if state.result.stale:
        before = np.isin(np.array(world.object_paths, object), state.result.stale)
        stale |= before & unwanted
    return tuple(path for path, is_stale in zip(world.object_paths, stale.tolist(), strict=True) if is_stale)


def _report(
    state: State,
    edit: Edit,
    samples: SampleSet,
    rows: SurfaceRows,
    rays: SurfaceRays,
    vertices: Int64Array,
    clock: StageClock,
) -> RebakeReport:
    return RebakeReport(
        changed=changed_objects(state.result.world, edit.world),
        stale=_stale(state, edit, samples, rows),
        samples=len(samples),
        samples_checked=int(rows.check.sum()),
        samples_whole=int(rows.whole.sum()),
        samples_changed=len(rays.changed),
        rays_tested=rays.rays_tested,
        rays_traced=rays.rays_traced,
        rays_changed=rays.rays_changed,
        rays_elsewhere=sum(row.rays for row in clock.rows if row.name != "trace"),
        vertices_changed=len(vertices),
        bound=float(rows.skipped.max(initial=0.0)),
        seconds=clock.seconds,
        stages={row.name: row.seconds for row in clock.rows if row.status == "ran"},
        carried=tuple((row.name, row.why) for row in clock.rows if row.status == "skipped"),
    )
