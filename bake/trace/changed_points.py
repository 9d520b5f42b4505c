"""Which points in space have a ray that an edit can have changed."""

from __future__ import annotations

from contextlib import ExitStack
from types import TracebackType
from typing import Any, Self

import numpy as np

from bake.change_types import WorldChange
from bake.trace.base import Tracer
from bake.trace.changed_rays import boxes_argument, differing, side_argument
from bake.trace.fused import TracerFused
from bake.types import BoolArray, Float32Array, UInt32Array


class ChangedPoints:
    """Tells points with a ray that can have changed; to be used in a `with` statement while both tracers are open.

    Points whose every ray misses what differs would find to the bit what they found. Tracers without the fused kernel
    cannot tell, so that all points count.
    """

    def __init__(
        self, old: Tracer, new: Tracer, change: WorldChange, low: Float32Array, high: Float32Array, opaque: BoolArray
    ) -> None:
        """Builds structures over the faces that differ; the arguments are those of `ChangedRays`.

        Raises:
            DeviceError: the tracer's library failed.
            OutOfMemoryError: the structures do not fit.
        """
        self._stack = ExitStack()
        self._tracer: TracerFused | None = None
        self._inputs: list[Any] = []
        self.tested = 0
        """Rays held against the faces that differ so far."""
        if isinstance(old, TracerFused) and isinstance(new, TracerFused) and type(old) is type(new):
            gone, added = differing(old.cast_face, change.new_face), differing(new.cast_face, change.old_face)
            sides = [side_argument(tracer, own, self._stack) for tracer, own in ((old, gone), (new, added))]
            self._tracer, self._inputs = new, [*sides, boxes_argument(new, low, high, opaque)]

    def find(self, points: Float32Array, seeds: UInt32Array, directions: int) -> BoolArray:
        """Which of some points have such a ray, shape (n,).

        Args:
            points: Shape (n, 3), float32, metres relative to `World.origin`.
            seeds: Shape (n,): what scrambles their directions, as for `Tracer.gather_sphere`.
            directions: Rays from each.
        """
        new, count = self._tracer, len(points)
        if new is None or not count:
            return np.ones(count, np.bool_)
        from bake.kernels import changed_points

        wp = new.warp
        asked: Any = changed_points.Asked()
        asked.position = new.array(points.astype(np.float32, copy=False), wp.vec3)
        asked.seed = new.array(seeds.astype(np.uint32, copy=False), wp.uint32)
        asked.directions = directions
        asked.found, asked.tested = new.empty(count, wp.int32), new.empty(count, wp.int32)
        kernel = changed_points.changed_points_kernel(new.name)
        new.launch(kernel, slice(0, count), [*self._inputs, asked, float(new.settings.trace_distance)])
        self.tested += int(asked.tested.numpy().sum(dtype=np.int64))
        return asked.found.numpy() > 0

    def close(self) -> None:
        """Frees what was built."""
        self._tracer, self._inputs = None, []
        self._stack.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
