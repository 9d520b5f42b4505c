"""Traces the surface samples that an edit can reach, and shows values on the way."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np

from bake.rebake.preview import DeltaPreview
from bake.rebake.state import Edit, State
from bake.rebake.surface_rows import SurfaceRows
from bake.rebake.types import Partial
from bake.trace import Tracer
from bake.types import Int64Array, Progress, SampleSet, Tally

_FIRST = 16  # one in so many samples makes the first picture
_CHUNK_RAYS = 1 << 19


@dataclass(frozen=True, slots=True)
class SurfaceRays:
    """What became of the samples.

    Attributes:
        tally: Of all samples.
        changed: Shape (r,), int64, ascending: rows whose AO or validity differs, or that are new.
        rays_traced, rays_tested, rays_changed: See `RebakeReport`.
    """

    tally: Tally
    changed: Int64Array
    rays_traced: int = 0
    rays_tested: int = 0
    rays_changed: int = 0


def trace_rows(
    state: State,
    edit: Edit,
    samples: SampleSet,
    rows: SurfaceRows,
    tracer: Tracer,
    first: Callable[[], Int64Array] | None,
) -> Generator[Progress | Partial, None, SurfaceRays]:
    """Traces what the edit can reach, the visible and the strongly affected first.

    Args:
        state: Before the edit.
        edit: What differs.
        samples: Of the edited world.
        rows: What has to be done; its tally is written to.
        tracer: Of the edited world.
        first: Vertices that are to be right first.
    """
    settings, tally = edit.settings, rows.tally
    wanted = np.concatenate([rows.whole, rows.check])
    lacking = rows.map.lacking(former=True)
    new = np.flatnonzero(lacking & ~_mask(wanted, len(samples)))
    if not len(wanted):
        return SurfaceRays(tally, new)
    before = _some(tally, wanted)
    known = ~lacking[wanted]
    order = _in_order(edit, samples, rows, wanted, first)
    preview = DeltaPreview(state.result, edit, samples)
    begin, rays = time.perf_counter(), settings.rays
    total, done = len(wanted) * rays, 0
    step = max(1, min(tracer.batch_size, _CHUNK_RAYS // rays))
    while done < len(wanted):
        chosen = order[done : done + step]
        target = wanted[chosen]
        found = traced(tracer, samples.only(target))
        tally.ao[target], tally.rays[target] = found.ao, found.rays
        tally.hits[target], tally.back_faces[target] = found.hits, found.back_faces
        done += len(chosen)
        seconds = time.perf_counter() - begin
        yield Progress("trace", done * rays, total, seconds, done * rays / max(seconds, 1e-9))
        then = np.where(known[chosen, None], before.ao[chosen], np.float32(np.nan))
        yield preview.partial(target, found.ao, then, done * rays, total)
    threshold, after = settings.back_face_threshold, _some(tally, wanted)
    differs = ~known | (after.ao != before.ao).any(axis=1) | (after.valid(threshold) != before.valid(threshold))
    part = differs[len(rows.whole) :]
    return SurfaceRays(
        tally,
        np.union1d(wanted[differs], new),
        rays_traced=total,
        rays_changed=(len(rows.whole) + int(part.sum())) * rays,
    )


def traced(tracer: Tracer, samples: SampleSet) -> Tally:
    """Some samples with all of their rays."""
    found = Tally.empty(len(samples), tracer.settings.distance_count)
    for batch in samples.batches(tracer.batch_size):
        tracer.accumulate(samples, batch, found)
    return found


def _some(tally: Tally, rows: Int64Array) -> Tally:
    return Tally(tally.ao[rows], tally.rays[rows], tally.hits[rows], tally.back_faces[rows])


def _mask(rows: Int64Array, count: int) -> np.ndarray:
    found = np.zeros(count, np.bool_)
    found[rows] = True
    return found


def _in_order(
    edit: Edit, samples: SampleSet, rows: SurfaceRows, wanted: Int64Array, first: Callable[[], Int64Array] | None
) -> Int64Array:
    """Positions in `wanted`: a thin spread over everything, then what is in view, then by what the edit may do."""
    strength = rows.bound[wanted].copy()
    strength[: len(rows.whole)] = 2.0
    if first is not None:
        seen = np.zeros(edit.world.vertex_count, np.bool_)
        seen[first()] = True
        strength += np.float32(4.0) * seen[edit.world.faces[samples.face[wanted]]].any(axis=1)
    strength[::_FIRST] += np.float32(8.0)
    return np.argsort(-strength, kind="stable")
