"""The surface samples of an edited world: carried, or traced where the edit can reach them."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np

from bake.rebake.carry import carried_tally, carry_samples, marginal
from bake.rebake.preview import DeltaPreview
from bake.rebake.reach import Places, reach
from bake.rebake.state import Edit, State
from bake.rebake.types import Partial
from bake.trace import Tracer
from bake.types import BoolArray, Float32Array, Int64Array, Progress, SampleSet, Tally

CHECKED = 1.0 / 8.0
"""Share of the bound above which a sample is looked at; what is below adds up until it exceeds the bound."""

_FIRST = 16  # one in so many samples makes the first picture
_CHUNK_RAYS = 1 << 19


@dataclass(frozen=True, slots=True)
class SurfaceRows:
    """What has to be done for each sample of the edited world.

    Attributes:
        old_row, former_row: As in `CarriedSamples`.
        whole: Shape (n,), bool: to be traced with all rays.
        check: Shape (n,), bool: to be traced where changed rays are found; none of `whole`.
        skipped: Shape (n,), float32: what is skipped after this edit, of those that are not touched.
        stale: Shape (n,), bool: the edit may reach it, but it was told to be left alone.
        bound: Shape (n,), float32: what the edit may do to it, in AO.
    """

    old_row: Int64Array
    former_row: Int64Array
    whole: BoolArray
    check: BoolArray
    skipped: Float32Array
    stale: BoolArray
    bound: Float32Array


@dataclass(frozen=True, slots=True)
class SurfaceRays:
    """What became of the samples.

    Attributes:
        tally: Of all samples.
        changed: Shape (r,), int64: rows whose AO or validity differs, or that are new.
        rays_traced, rays_tested, rays_changed: See `RebakeReport`.
    """

    tally: Tally
    changed: Int64Array
    rays_traced: int = 0
    rays_tested: int = 0
    rays_changed: int = 0


def plan_rows(state: State, edit: Edit, samples: SampleSet, places: Places, bound: float) -> SurfaceRows:
    """Sorts the samples into those that are carried and those to be looked at.

    Args:
        state: Before the edit.
        edit: What differs.
        samples: Of the edited world.
        places: Where they are.
        bound: Most that may be skipped for one.
    """
    result, world, settings = state.result, edit.world, edit.settings
    carried = carry_samples(result.samples, samples, edit.change, result.world, world)
    known = carried.old_row >= 0
    wanted = edit.wanted_faces[samples.face]
    whole = ~known
    if "rays" in edit.settings_change.names:
        whole |= True
    if result.stale:
        left = np.isin(np.array(world.object_paths, object), result.stale)
        whole |= left[world.face_object[samples.face]]
    skipped = (
        np.where(known, state.skipped[np.maximum(carried.old_row, 0)], np.float32(0.0))
        if len(state.skipped)
        else np.zeros(len(samples), np.float32)
    )
    found = reach(places, edit.casters, settings, rays=settings.rays, near=CHECKED * bound)
    check = found.touched if bound <= 0.0 else found.bound > np.float32(CHECKED * bound)
    if bound > 0.0 and len(edit.casters) and len(samples):
        former = carried_tally(result.tally, carried.old_row)
        check = check | (found.touched & marginal(former, settings.back_face_threshold, settings.rays))
    check = check & ~whole
    skipped = np.where(check | whole, skipped, skipped + found.bound).astype(np.float32)
    whole |= ~check & (skipped > np.float32(bound))
    # What nobody asked for stays as it was, if it was ever traced.
    left = ~wanted & (carried.former_row >= 0)
    stale = left & (whole | check)
    whole &= ~left
    check &= ~left
    skipped[whole] = 0.0
    return SurfaceRows(carried.old_row, carried.former_row, whole, check, skipped, stale, found.bound)


def trace_rows(
    state: State,
    edit: Edit,
    samples: SampleSet,
    rows: SurfaceRows,
    tracer: Tracer,
    first: Callable[[], Int64Array] | None,
) -> Generator[Progress | Partial, None, SurfaceRays]:
    """Traces what the edit can reach, the visible and the strongly affected first."""
    settings, old = edit.settings, state.result.tally
    source = np.where(rows.old_row >= 0, rows.old_row, rows.former_row)
    tally = carried_tally(old, source)
    wanted = np.flatnonzero(rows.whole | rows.check)
    if not len(wanted):
        return SurfaceRays(tally, np.flatnonzero(source < 0))
    before = Tally(tally.ao[wanted], tally.rays[wanted], tally.hits[wanted], tally.back_faces[wanted])
    known = source[wanted] >= 0
    order = _in_order(edit, samples, rows, wanted, first)
    preview = DeltaPreview(state.result, edit, samples)
    begin, rays = time.perf_counter(), settings.rays
    total, done = len(wanted) * rays, 0
    step = max(1, min(tracer.batch_size, _CHUNK_RAYS // rays))
    while done < len(wanted):
        chosen = order[done : done + step]
        target = wanted[chosen]
        found = Tally.empty(len(chosen), settings.distance_count)
        own = samples.only(target)
        for batch in own.batches(tracer.batch_size):
            tracer.accumulate(own, batch, found)
        tally.ao[target], tally.rays[target] = found.ao, found.rays
        tally.hits[target], tally.back_faces[target] = found.hits, found.back_faces
        done += len(chosen)
        seconds = time.perf_counter() - begin
        yield Progress("trace", done * rays, total, seconds, done * rays / max(seconds, 1e-9))
        yield preview.partial(
            target, found.ao, np.where(known[chosen, None], before.ao[chosen], np.nan), done * rays, total
        )
    threshold = settings.back_face_threshold
    after = Tally(tally.ao[wanted], tally.rays[wanted], tally.hits[wanted], tally.back_faces[wanted])
    differs = ~known | (after.ao != before.ao).any(axis=1) | (after.valid(threshold) != before.valid(threshold))
    changed = wanted[differs]
    whole = int(np.count_nonzero(rows.whole))
    return SurfaceRays(
        tally, changed, rays_traced=total, rays_changed=(whole + int((differs & rows.check[wanted]).sum())) * rays
    )


def _in_order(
    edit: Edit, samples: SampleSet, rows: SurfaceRows, wanted: Int64Array, first: Callable[[], Int64Array] | None
) -> Int64Array:
    """Positions in `wanted`: a thin spread over everything, then what is in view, then by what the edit may do."""
    strength = np.where(rows.whole[wanted], np.float32(2.0), rows.bound[wanted])
    if first is not None:
        seen = np.zeros(edit.world.vertex_count, np.bool_)
        seen[first()] = True
        strength += 4.0 * seen[edit.world.faces[samples.face[wanted]]].any(axis=1)
    strength[::_FIRST] += 8.0
    return np.argsort(-strength, kind="stable")
