"""Tracing with Embree on the CPU: the fused kernel calls libembree4 for its closest hits."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager

import numpy as np

from bake.decorator_types import FogBoxes
from bake.devices import worker_count
from bake.settings import BakeSettings
from bake.trace.embree_library import EmbreeScene
from bake.trace.fused import TracerFused
from bake.types import World


class TracerEmbree(TracerFused):
    """The fused kernel over an Embree scene."""

    name = "embree"
    device = "cpu"

    def __init__(self, world: World, settings: BakeSettings, fog: FogBoxes | None = None) -> None:
        super().__init__(world, settings, "cpu", worker_count(), fog)
        # About 50 ms of work for two threads at 4 million rays a second each.
        self.batch_size = max(64, (1 << 19) // settings.rays)
        self._embree = EmbreeScene(self.points, world.faces[self.cast_face].astype(np.uint32))
        self.entry, self.scene = self._embree.intersect_address, self._embree.address

    @contextmanager
    def _passing_over(self, first: int, last: int) -> Generator[tuple[int, int]]:
        held = np.array([self.scene, first, last], np.uint64)
        yield self.entry, held.ctypes.data

    def close(self) -> None:
        """Frees the Embree scene."""
        self._embree.close()
        super().close()
