"""A rebake on one page: what the edit can reach, its rays, its values, and what hangs on them."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Generator
from contextlib import ExitStack

import numpy as np

from bake.devices import Device
from bake.errors import SceneError
from bake.pipeline import any_decorators, bake_findings, occluders, open_tracer, versions
from bake.rebake.around import rebaked_around
from bake.rebake.changes import changed_objects
from bake.rebake.decorated import rebaked_regions, rebaked_trees
from bake.rebake.first_look import can_look, first_look
from bake.rebake.reach import Places
from bake.rebake.rows import samples_after
from bake.rebake.setting_changes import SAMPLES, SOLVE, TREES
from bake.rebake.skipped_after import skipped_after
from bake.rebake.state import Edit, State
from bake.rebake.surface_rows import SurfaceRows, plan_rows
from bake.rebake.surface_trace import SurfaceRays, SurfaceTrace
from bake.rebake.types import Partial, RebakeOutcome, RebakeReport
from bake.solve.update import TOLERANCE, FieldKeeper, FieldUpdate
from bake.stages import StageClock, patiently
from bake.trace import Tracer
from bake.trace.changed_points import ChangedPoints
from bake.types import (
    BakeResult,
    BoolArray,
    Decorators,
    Int64Array,
    Progress,
    Role,
    SampleSet,
    VertexField,
    VertexState,
)


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
    old = kept = state.tracer
    tracer = yield from _tracer(state, edit, device, clock)
    try:
        looked = 0
        if can_look(state, edit):  # all of the level's samples are gone through only after the first picture
            begin = time.perf_counter()
            part, looked = first_look(state, edit, tracer)  # here: no thread may be left to trace when we are closed
            clock.ran("first look", f"{len(part.vertices):,} vertices shown", time.perf_counter() - begin, looked)
            yield part
        (samples, places, rows), seconds = yield from patiently("reach", lambda: _planned(state, edit, bound))
        if len(samples) == 0 and not any_decorators(world, settings):
            raise SceneError(
                "nothing receives ambient obscurance", where=str(edit.scene.path), remedy="check the objects' roles"
            )
        why = f"of {len(samples):,} samples {len(rows.whole):,} whole, {len(rows.check):,} in part"
        clock.ran("reach", why, seconds)
        if old is None and len(rows.check):
            result = state.result
            old, seconds = yield from open_tracer(result.world, result.settings, device, state.fog)
            clock.ran("build BVH as it was", occluders(result.world, old), seconds)
            state = dataclasses.replace(state, tracer=old)
        begin = time.perf_counter()
        work = SurfaceTrace(state, edit, samples, rows, tracer, first=first, exact=bound <= 0.0)
        rays = yield from work.run(old)
        rays = dataclasses.replace(rays, rays_traced=rays.rays_traced + looked)
        clock.ran("trace", f"{len(rays.changed):,} samples changed", time.perf_counter() - begin, rays.rays_traced)
        update = yield from _solved(state, edit, samples, rays, clock, tolerance=TOLERANCE if bound > 0.0 else 0.0)
        field = _adopted(state, edit, update.field)
        shown = changed_vertices(state, edit, field)
        yield Partial(shown, field.ao[shown], rays.rays_traced, rays.rays_traced, final=True)
        with ExitStack() as stack:
            changed = None if old is None else stack.enter_context(_changed_points(edit, old, tracer))
            trees, known_trees = yield from rebaked_trees(
                state, edit, tracer, device, clock, bound=bound, changed=changed
            )
            regions = yield from rebaked_regions(state, edit, tracer, clock, bound=bound, changed=changed)
        around = yield from rebaked_around(state, edit, field, shown, device=device, clock=clock)
    except BaseException:
        for mine in (tracer, old):
            if mine is not None and mine is not kept:
                mine.close()
        raise
    if old is not None and old is not kept:
        old.close()
    dynamic = regions.outcome
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
        skipped=skipped_after(state, rows.skipped, trees, known_trees, regions.skipped),
        stale=_stale(state, edit, samples, rows),
    )
    vertices = shown if around.field is field else changed_vertices(state, edit, around.field)
    voxels = 0 if trees is None else len(trees.volume.voxel)
    untouched = (
        state.result.decorators is not None and trees is not None and trees.volume is state.result.decorators.volume
    )
    report = dataclasses.replace(
        _report(state, edit, samples, rows, rays, vertices, clock),
        voxels=voxels,
        voxels_traced=0 if untouched else known_trees.traced_voxels if known_trees else voxels,
        points=0 if dynamic is None else len(dynamic.regions.points.traced),
        points_traced=regions.traced,
    )
    seen = {} if edit.settings_change.any_of(SOLVE, SAMPLES, TREES) else state.seen
    after = State(result, edit.scene, tracer, update.keeper, places, rows.anchor, seen)
    return after, RebakeOutcome(result, report)


def _changed_points(edit: Edit, old: Tracer, new: Tracer) -> ChangedPoints:
    low, high = edit.casters.boxes
    opaque = np.concatenate([edit.casters.before.opaque, edit.casters.after.opaque])
    return ChangedPoints(old, new, edit.change, low, high, opaque)


def _planned(state: State, edit: Edit, bound: float) -> tuple[SampleSet, Places, SurfaceRows]:
    result, world = state.result, edit.world
    anew = edit.settings_change.any_of(SAMPLES)
    samples, where = samples_after(result.samples, result.world, world, edit.change, edit.settings, anew=anew)
    if state.places is None:
        places = Places.of_samples(world, samples)
    else:
        places = state.places.after(world, samples, where)
    return samples, places, plan_rows(state, edit, samples, where, places, bound)


def _tracer(state: State, edit: Edit, device: Device, clock: StageClock) -> Generator[Progress, None, Tracer]:
    """A tracer of the edited world: the old one, if nothing differs, or one that follows from it."""
    old = state.tracer
    if old is None or "rays" in edit.settings_change.names:
        tracer, seconds = yield from open_tracer(edit.world, edit.settings, device, edit.fog)
    elif old.world.object_paths == edit.world.object_paths and old.world.object_hash == edit.world.object_hash:
        clock.skipped("build BVH", "carried: no object differs")
        return old
    else:
        tracer, seconds = yield from patiently("build BVH", lambda: old.updated(edit.world, edit.change, edit.fog))
    clock.ran("build BVH", occluders(edit.world, tracer), seconds)
    return tracer


def _solved(
    state: State, edit: Edit, samples: SampleSet, rays: SurfaceRays, clock: StageClock, *, tolerance: float
) -> Generator[Progress, None, FieldUpdate]:
    """Values at the vertices; carried where nothing that they hang on changed."""
    settings, before = edit.settings, state.result.settings
    valid = rays.tally.valid(settings.back_face_threshold)
    changed = rays.changed
    if "back_face_threshold" in edit.settings_change.names:
        turned = np.flatnonzero(valid != rays.tally.valid(before.back_face_threshold))
        changed = np.union1d(changed, turned)

    def solve() -> FieldUpdate:
        keeper = state.keeper or keeper_of(state.result)
        return keeper.updated(
            edit.world, samples, rays.tally.ao, valid, edit.change, changed, settings, tolerance=tolerance
        )

    update, seconds = yield from patiently("solve", solve)
    report = update.field.report
    clock.ran("map to vertices", f"{update.solved:,} of {report.unknowns:,} unknowns", seconds)
    return update


def keeper_of(result: BakeResult) -> FieldKeeper:
    """What follows the values of a stored bake."""
    return FieldKeeper(
        result.world,
        result.samples,
        np.asarray(result.tally.ao),
        result.tally.valid(result.settings.back_face_threshold),
        result.settings,
        field=None if result.stale else _of_receivers(result),  # stale values are no solution of anything
    )


def _of_receivers(result: BakeResult) -> VertexField:
    """The field without lower levels of detail, whose values are read off the others and not solved for."""
    world = result.world
    if Role.LOD not in world.object_roles:
        return result.field
    ao, state = np.array(result.field.ao), np.array(result.field.state)
    for number, role in enumerate(world.object_roles):
        if role is Role.LOD:
            own = slice(int(world.first_vertex[number]), int(world.first_vertex[number + 1]))
            ao[own], state[own] = np.nan, VertexState.UNREFERENCED
            state[world.faces[world.first_face[number] : world.first_face[number + 1]]] = VertexState.NOT_BAKED
    return VertexField(ao, state, result.field.report)


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


def changed_vertices(state: State, edit: Edit, field: VertexField) -> Int64Array:
    """Vertices whose value is another one than the old world's, or that are new, shape (v,).

    Lower levels of detail count once they have their values, which are read off the others.
    """
    former = edit.change.old_vertex
    known = former >= 0
    differs: BoolArray = ~known & np.isfinite(field.ao).any(axis=1)
    a, b = field.ao[known], state.result.field.ao[former[known]]
    differs[known] = ~((a == b) | (np.isnan(a) & np.isnan(b))).all(axis=1)
    world = edit.world
    for number, role in enumerate(world.object_roles):
        own = slice(int(world.first_vertex[number]), int(world.first_vertex[number + 1]))
        if role is Role.LOD and not np.isfinite(field.ao[own]).any():
            differs[own] = False
    return np.flatnonzero(differs).astype(np.int64)


def _stale(state: State, edit: Edit, samples: SampleSet, rows: SurfaceRows) -> tuple[str, ...]:
    """Objects that are older than the rest: just left alone, or before and not asked for now."""
    if not edit.selects:
        return ()
    world = edit.world
    stale = np.zeros(world.object_count, np.bool_)
    stale[world.face_object[samples.face[rows.stale]]] = True
    unwanted = np.zeros(world.object_count, np.bool_)
    unwanted[world.face_object[~edit.wanted_faces & world.face_samples]] = True
    if edit.settings_change.any_of(SOLVE, SAMPLES):
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
        samples_checked=len(rows.check),
        samples_whole=len(rows.whole),
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
