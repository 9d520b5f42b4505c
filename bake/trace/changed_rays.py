"""What an edit changes about samples, found by the rays that it can have changed."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Any, Self

import numpy as np

from bake.change_types import WorldChange
from bake.trace.base import Tracer
from bake.trace.fused import TracerFused
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array, SampleSet, Tally

MOST_BOXES = 24
"""Boxes that a ray is held against, of opaque faces and of what dims each; more are put together."""


@dataclass(frozen=True, slots=True)
class TallyChange:
    """How the tally of n samples changes.

    Attributes:
        ao: Shape (n, k), float64: to be added to AO.
        hits, back_faces: Shape (n,), int32: to be added to the counts.
        tested: Shape (n,), int32: rays that cross a box of what changed, held against that alone.
        traced: Shape (n,), int32: rays traced through a scene, each time counted.
        changed: Shape (n,), int32: rays that found something else; of samples traced whole, all.
        doubtful: Shape (n,), bool: what was found may not be all, so that the sample has to be traced whole.
        whole: Shape (w,), int64: samples that were traced whole; the changes of theirs are 0.
        tally: What those found, in the order of `whole`.
    """

    ao: Float64Array
    hits: Int32Array
    back_faces: Int32Array
    tested: Int32Array
    traced: Int32Array
    changed: Int32Array
    doubtful: BoolArray
    whole: Int64Array
    tally: Tally

    def __len__(self) -> int:
        return len(self.ao)

    def applied(self, before: Tally) -> Tally:
        """The tally after the edit of the samples whose tally before it is given, in the same order."""
        ao = np.clip(before.ao + self.ao, 0.0, 1.0).astype(np.float32)
        hits, back_faces = before.hits + self.hits, before.back_faces + self.back_faces
        counts = [np.clip(values, 0, before.rays).astype(np.uint16) for values in (hits, back_faces)]
        after = Tally(ao, before.rays.copy(), *counts)
        after.ao[self.whole], after.rays[self.whole] = self.tally.ao, self.tally.rays
        after.hits[self.whole], after.back_faces[self.whole] = self.tally.hits, self.tally.back_faces
        return after


class ChangedRays:
    """Traces what an edit changes; close it, or use it in a `with` statement, before the two tracers are closed.

    A ray that misses every box, or all faces that differ, finds what it found. The others are traced through what both
    scenes have in common; what they meet of the faces that differ is known by then. Only behind a partly open face
    both scenes are followed. Crossing a box of fog or leaves that differ is enough to be traced.

    The second look at doubtful escapes (`bake/kernels/follow.py`) is given to the first ray of a sample alone, since
    whether it is due hangs on rays that are not traced. Where a ray newly escapes, or no longer does, while so few did
    before it that later ones are doubted in one scene only, the sample is told to be `doubtful`.

    Tracers without the fused kernel trace all samples whole.
    """

    def __init__(
        self,
        old: Tracer,
        new: Tracer,
        change: WorldChange,
        low: Float32Array,
        high: Float32Array,
        opaque: BoolArray,
    ) -> None:
        """Builds structures over the faces that differ.

        Args:
            old, new: Tracers of the worlds before and after, of one kind and with the same settings.
            change: What differs.
            low, high: Shape (b, 3) each, float32, relative to `World.origin`: boxes around all that differs, before
                and after.
            opaque: Shape (b,): whether a box holds opaque or partly open faces; else it is fog, or leaves.

        Raises:
            DeviceError: the tracer's library failed.
            OutOfMemoryError: the structures do not fit.
        """
        self.old, self.new = old, new
        self._stack = ExitStack()
        self._fused: _Fused | None = None
        if isinstance(old, TracerFused) and isinstance(new, TracerFused) and type(old) is type(new):
            self._fused = _Fused(old, new, change, low, high, opaque, self._stack)

    @property
    def whole_samples(self) -> bool:
        """Whether the tracers have no fused kernel, so that samples can only be traced whole."""
        return self._fused is None

    def trace(self, samples: SampleSet, *, rays: slice | None = None, exact: bool = False) -> TallyChange:
        """Traces the rays that can have changed.

        Args:
            samples: Of the new world, on faces that are carried; send about `Tracer.batch_size` a call, or some more.
            rays: Numbers of the rays to look at, without a step; all by default. The changes found for parts add up.
            exact: Trace all rays of each sample that has one that can have changed, in the new scene: to the bit what
                `Tracer.accumulate` finds. Then `rays` has to be None.
        """
        count, settings = len(samples), self.new.settings
        if self._fused is None:
            if rays is not None and rays.stop != settings.rays:  # all of them with the last part
                return _unchanged(count, settings.distance_count)
            return self._whole(samples, np.arange(count), _unchanged(count, settings.distance_count))
        if not exact:
            return self._fused.trace(samples, rays or slice(0, settings.rays))
        found = self._fused.find(samples)
        return self._whole(samples, np.flatnonzero(found.changed), found)

    def close(self) -> None:
        """Frees what was built."""
        self._fused = None
        self._stack.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _whole(self, samples: SampleSet, rows: Int64Array, found: TallyChange) -> TallyChange:
        settings = self.new.settings
        own, tally = samples.only(rows), Tally.empty(len(rows), settings.distance_count)
        for batch in own.batches(self.new.batch_size):
            self.new.accumulate(own, batch, tally)
        rays = np.zeros(len(samples), np.int32)
        rays[rows] = settings.rays
        none = np.zeros(len(samples), np.bool_)
        return TallyChange(found.ao, found.hits, found.back_faces, found.tested, rays, rays, none, rows, tally)


def _unchanged(count: int, columns: int) -> TallyChange:
    zero, none = np.zeros(count, np.int32), np.zeros(count, np.bool_)
    nothing = np.zeros(0, np.int64)
    return TallyChange(np.zeros((count, columns)), zero, zero, zero, zero, zero, none, nothing, Tally.empty(0, columns))


class _Fused:
    """The arguments of the kernel for two fused tracers."""

    def __init__(
        self,
        old: TracerFused,
        new: TracerFused,
        change: WorldChange,
        low: Float32Array,
        high: Float32Array,
        opaque: BoolArray,
        stack: ExitStack,
    ) -> None:
        from bake.kernels import changed

        self._kernels, self._old, self._new = changed, old, new
        gone = differing(old.cast_face, change.new_face)
        added = differing(new.cast_face, change.old_face)
        self._sides = [side_argument(tracer, primitives, stack) for tracer, primitives in ((old, gone), (new, added))]
        passed_over = np.zeros(len(new.cast_face), np.bool_)
        passed_over[added] = True
        self._shared = stack.enter_context(new.passing_over(passed_over))
        self._boxes = boxes_argument(new, low, high, opaque)

    def trace(self, samples: SampleSet, rays: slice) -> TallyChange:
        """The changes of some of the rays."""
        out = self._run(samples, rays, find=False)
        return TallyChange(
            ao=out.ao.numpy() / self._new.settings.rays,
            hits=out.hits.numpy(),
            back_faces=out.back_faces.numpy(),
            tested=out.tested.numpy(),
            traced=out.traced.numpy(),
            changed=out.changed.numpy(),
            doubtful=out.doubtful.numpy() > 0,
            whole=np.zeros(0, np.int64),
            tally=Tally.empty(0, self._new.settings.distance_count),
        )

    def find(self, samples: SampleSet) -> TallyChange:
        """Which samples have a ray that can have changed, as `changed`."""
        settings = self._new.settings
        out = self._run(samples, slice(0, settings.rays), find=True)
        nothing = _unchanged(len(samples), settings.distance_count)
        return replace(nothing, tested=out.tested.numpy(), changed=out.candidates.numpy())

    def _run(self, samples: SampleSet, rays: slice, *, find: bool) -> Any:
        new, old, count = self._new, self._old, len(samples)
        wp, rows = new.warp, 0 if find else count
        out: Any = self._kernels.Change()
        out.first_ray, out.last_ray, out.find = rays.start or 0, rays.stop, int(find)
        out.ao = new.empty((rows, new.settings.distance_count), wp.float64)
        out.hits, out.back_faces = new.empty(rows, wp.int32), new.empty(rows, wp.int32)
        out.traced, out.changed = new.empty(rows, wp.int32), new.empty(rows, wp.int32)
        out.doubtful = new.empty(rows, wp.int32)
        out.tested, out.candidates = new.empty(count, wp.int32), new.empty(count, wp.int32)
        fog = max(old.fog_boxes, new.fog_boxes) > 0
        trees = max(old.tree_triangles, new.tree_triangles) > 0
        inputs = [
            *self._shared, *self._sides, old.surface, new.surface, old.veil, new.veil, self._boxes,
            new.sent_by(samples), new.falloff, out,
        ]  # fmt: skip
        new.launch(self._kernels.changed_kernel(new.name, fog, trees), slice(0, count), inputs)
        return out


def side_argument(tracer: TracerFused, primitives: Int64Array, stack: ExitStack) -> Any:
    """The kernels' `Side`: some primitives of a tracer, with a structure of their own that lasts as long as the stack.

    Args:
        tracer: Of one of the two worlds.
        primitives: What that world alone has.
        stack: Closes what is built.
    """
    from bake.kernels import changed

    side: Any = changed.Side()
    side.entry, side.scene, side.count = tracer.entry, tracer.scene, len(primitives)
    side.primitive = tracer.array(primitives.astype(np.int32), tracer.warp.int32)
    if len(primitives):
        side.part_entry, side.part_scene = stack.enter_context(tracer.part(tracer.cast_face[primitives]))
    return side


def boxes_argument(tracer: TracerFused, low: Float32Array, high: Float32Array, opaque: BoolArray) -> Any:
    """The kernels' `Boxes`, opaque ones first; see `ChangedRays`."""
    from bake.kernels import changed

    boxes: Any = changed.Boxes()
    solid, soft = (_put_together(low[which], high[which]) for which in (opaque, ~opaque))
    vec3 = tracer.warp.vec3
    boxes.low = tracer.array(np.concatenate((solid[0], soft[0])), vec3)
    boxes.high = tracer.array(np.concatenate((solid[1], soft[1])), vec3)
    boxes.first_soft = len(solid[0])
    return boxes


def differing(face: Int32Array, counterpart: Int32Array) -> Int64Array:
    """Primitives whose faces are not in the other world, shape (d,), ascending.

    Args:
        face: Shape (p,): face of each primitive, -1 for none.
        counterpart: Shape (m,): of each face, that in the other world, -1 where there is none.
    """
    return np.flatnonzero((face >= 0) & (counterpart[face] < 0))


def _put_together(low: Float32Array, high: Float32Array) -> tuple[Float32Array, Float32Array]:
    """At most `MOST_BOXES` boxes that hold all those given: neighbours along the widest axis are put together."""
    if len(low) <= MOST_BOXES:
        return low, high
    centre = 0.5 * (low + high)
    order = np.argsort(centre[:, int(np.argmax(np.ptp(centre, axis=0)))])
    begins = np.arange(MOST_BOXES) * len(low) // MOST_BOXES
    return np.minimum.reduceat(low[order], begins), np.maximum.reduceat(high[order], begins)
