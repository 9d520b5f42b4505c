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
from bake.trace.changed_rays import ChangedRays, TallyChange
from bake.types import Float64Array, Int64Array, Progress, SampleSet, Tally

PASSES = 3
"""Rays of each sample that the edit does much to are looked at in so many parts at most, each four times the one
before."""

STRONG = 1.0 / 1024.0
"""What an edit may do to a sample, in AO, to be looked at in parts."""

_FIRST = 16  # one in so many of the samples traced whole makes the first picture
_CHUNK_RAYS = 1 << 19
_CHUNK = 1 << 19  # samples that are checked at a time


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


class SurfaceTrace:
    """Traces what an edit can reach, the visible and the strongly affected first.

    Args:
        state: Before the edit.
        edit: What differs.
        samples: Of the edited world.
        rows: What has to be done; its tally is written to.
        tracer: Of the edited world.
        first: Vertices that are to be right first.
        exact: Samples with a ray that can have changed are traced whole, so that they equal a bake's to the bit.
    """

    def __init__(
        self,
        state: State,
        edit: Edit,
        samples: SampleSet,
        rows: SurfaceRows,
        tracer: Tracer,
        *,
        first: Callable[[], Int64Array] | None,
        exact: bool,
    ) -> None:
        self._edit, self._samples, self._rows, self._tracer, self._exact = edit, samples, rows, tracer, exact
        self._tally = rows.tally
        self._preview = DeltaPreview(state.result, edit, samples)
        self._seen = None if first is None else first()
        self._lacking = rows.map.lacking(former=True)
        self._changed: list[Int64Array] = [np.flatnonzero(self._lacking)]
        self._begin = time.perf_counter()
        rays = edit.settings.rays
        self._total = (len(rows.whole) + len(rows.check)) * rays
        self._done = self._traced = self._tested = self._found = 0

    def run(self, old: Tracer | None) -> Generator[Progress | Partial, None, SurfaceRays]:
        """Does it.

        Args:
            old: A tracer of the world before; None if no sample is to be checked.
        """
        whole = self._in_order(self._rows.whole)
        thin = len(whole) // _FIRST
        yield from self._trace_whole(whole[:thin])
        if len(self._rows.check):
            assert old is not None, "samples are checked against both worlds"
            low, high = self._edit.casters.boxes
            opaque = np.concatenate([self._edit.casters.before.opaque, self._edit.casters.after.opaque])
            with ChangedRays(old, self._tracer, self._edit.change, low, high, opaque) as rays:
                yield from self._check(rays, self._seen_first(self._rows.check), whole[thin:])
        else:
            yield from self._trace_whole(whole[thin:])
        return SurfaceRays(
            self._tally,
            np.unique(np.concatenate(self._changed)),
            rays_traced=self._traced,
            rays_tested=self._tested,
            rays_changed=self._found,
        )

    def _trace_whole(self, rows: Int64Array) -> Generator[Progress | Partial]:
        settings, tally = self._edit.settings, self._tally
        step = max(1, min(self._tracer.batch_size, _CHUNK_RAYS // settings.rays))
        for begin in range(0, len(rows), step):
            part = rows[begin : begin + step]
            found = traced(self._tracer, self._samples.only(part))
            known = ~self._lacking[part]
            before = np.where(known[:, None], tally.ao[part], np.float32(np.nan))
            valid = _some(tally, part).valid(settings.back_face_threshold)
            differs = ~known | (found.ao != before).any(axis=1) | (found.valid(settings.back_face_threshold) != valid)
            self._changed.append(part[differs])
            _put(tally, part, found)
            self._count(len(part), len(part) * settings.rays, len(part) * settings.rays)
            yield self._progress()
            moved = np.where(known[:, None], found.ao - before, found.ao)
            yield self._preview.partial(part, moved, known, self._done * settings.rays, self._total)

    def _check(self, rays: ChangedRays, rows: Int64Array, whole: Int64Array) -> Generator[Progress | Partial]:
        """The samples to be checked: a few rays of each, then the rest of those traced whole, then all rays."""
        if self._exact or rays.whole_samples:
            yield from self._trace_whole(whole)
            yield from self._check_exactly(rays, rows)
            return
        strong = self._rows.bound[rows] > STRONG
        parts = _parts(self._edit.settings.rays)
        yield from self._check_in_parts(rays, rows[strong], parts, whole)
        # Most samples can only be struck by a ray now and then: looked at once, they take a fraction of the time.
        yield from self._check_in_parts(rays, rows[~strong], [slice(0, parts[-1].stop)], whole[:0])

    def _check_in_parts(
        self, rays: ChangedRays, rows: Int64Array, parts: list[slice], whole: Int64Array
    ) -> Generator[Progress | Partial]:
        """The same part of the rays of all samples, then the next; `whole` is traced after the first."""
        count, k = self._edit.settings.rays, self._edit.settings.distance_count
        ao: Float64Array = np.zeros((len(rows), k))
        hits, backs, found = (np.zeros(len(rows), np.int32) for _ in range(3))
        doubtful = np.zeros(len(rows), np.bool_)
        spans = [slice(begin, min(begin + _CHUNK, len(rows))) for begin in range(0, len(rows), _CHUNK)]
        chunks = [(own, self._samples.only(rows[own])) for own in spans]
        for number, part in enumerate(parts):
            for own, samples in chunks:
                change = rays.trace(samples, rays=part)
                moved = np.flatnonzero(change.changed) + own.start
                ao[own] += change.ao
                hits[own] += change.hits
                backs[own] += change.back_faces
                found[own] += change.changed
                doubtful[own] |= change.doubtful
                self._add(change)
                self._done += round(len(change) * (part.stop - part.start) / count)
                yield self._progress()
                if len(moved):
                    some = moved if number == 0 else np.flatnonzero(found[own]) + own.start
                    estimate = (ao[some] * (count / part.stop)).astype(np.float32)
                    yield self._preview.spread(rows[some], estimate, self._done * count, self._total)
            if number == 0:
                yield from self._trace_whole(whole)
        none = np.zeros(0, np.int64)
        self._done -= int(np.count_nonzero(doubtful))  # counted once more, now that they are traced whole
        yield from self._trace_whole(rows[doubtful])
        some = np.flatnonzero((found > 0) & ~doubtful)
        once = found[some]
        change = TallyChange(ao[some], hits[some], backs[some], once, once, once, once < 0, none, Tally.empty(0, k))
        self._apply(rows[some], change)

    def _check_exactly(self, rays: ChangedRays, rows: Int64Array) -> Generator[Progress | Partial]:
        step = max(1, _CHUNK_RAYS // self._edit.settings.rays)
        for begin in range(0, len(rows), step):
            part = rows[begin : begin + step]
            change = rays.trace(self._samples.only(part), exact=True)
            before = self._tally.ao[part]
            self._add(change)
            self._done += len(part)
            self._apply(part, change)
            yield self._progress()
            known = np.ones(len(part), np.bool_)
            moved = self._tally.ao[part] - before
            yield self._preview.partial(part, moved, known, self._done * self._edit.settings.rays, self._total)

    def _apply(self, rows: Int64Array, change: TallyChange) -> None:
        touched = change.changed > 0
        touched[change.whole] = True
        before = _some(self._tally, rows)
        after = change.applied(before)
        threshold = self._edit.settings.back_face_threshold
        differs = (after.ao != before.ao).any(axis=1) | (after.valid(threshold) != before.valid(threshold))
        _put(self._tally, rows[touched], _some(after, np.flatnonzero(touched)))
        self._changed.append(rows[touched & differs])

    def _add(self, change: TallyChange) -> None:
        self._tested += int(change.tested.sum(dtype=np.int64))
        self._traced += int(change.traced.sum(dtype=np.int64))
        self._found += int(change.changed.sum(dtype=np.int64))

    def _count(self, done: int, traced: int, found: int) -> None:
        self._done += done
        self._traced += traced
        self._found += found

    def _progress(self) -> Progress:
        seconds, done = time.perf_counter() - self._begin, self._done * self._edit.settings.rays
        return Progress("trace", min(done, self._total), self._total, seconds, self._traced / max(seconds, 1e-9))

    def _seen_first(self, rows: Int64Array) -> Int64Array:
        if self._seen is None:
            return rows
        seen = np.zeros(self._edit.world.vertex_count, np.bool_)
        seen[self._seen] = True
        is_seen = seen[self._edit.world.faces[self._samples.face[rows]]].any(axis=1)
        return np.concatenate([rows[is_seen], rows[~is_seen]])

    def _in_order(self, rows: Int64Array) -> Int64Array:
        """A thin spread over everything, then what is in view, then by what the edit may do."""
        if not len(rows):
            return rows
        strength = self._rows.bound[rows].copy()
        if self._seen is not None:
            seen = np.zeros(self._edit.world.vertex_count, np.bool_)
            seen[self._seen] = True
            strength += np.float32(4.0) * seen[self._edit.world.faces[self._samples.face[rows]]].any(axis=1)
        strength[::_FIRST] += np.float32(8.0)
        return rows[np.argsort(-strength, kind="stable")]


def traced(tracer: Tracer, samples: SampleSet) -> Tally:
    """Some samples with all of their rays."""
    found = Tally.empty(len(samples), tracer.settings.distance_count)
    for batch in samples.batches(tracer.batch_size):
        tracer.accumulate(samples, batch, found)
    return found


def _parts(rays: int) -> list[slice]:
    """Numbers of rays in parts that grow: 16 and 48 of 64."""
    ends = sorted({max(rays >> (2 * left), 1) for left in range(PASSES - 1)})
    return [slice(begin, end) for begin, end in zip([0, *ends[:-1]], ends, strict=True)]


def _some(tally: Tally, rows: Int64Array) -> Tally:
    return Tally(tally.ao[rows], tally.rays[rows], tally.hits[rows], tally.back_faces[rows])


def _put(tally: Tally, rows: Int64Array, found: Tally) -> None:
    tally.ao[rows], tally.rays[rows] = found.ao, found.rays
    tally.hits[rows], tally.back_faces[rows] = found.hits, found.back_faces
