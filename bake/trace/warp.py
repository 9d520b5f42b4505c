"""Tracing with Warp: on CUDA for speed, on the CPU to check the same kernels."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager

import numpy as np

from bake.change_types import WorldChange
from bake.decorator_types import FogBoxes
from bake.devices import Device, worker_count
from bake.settings import BakeSettings
from bake.trace.fused import TracerFused
from bake.trace.primitives import Primitives
from bake.types import BoolArray, Int32Array, World


class TracerWarp(TracerFused):
    """The fused kernel over Warp's BVH."""

    name = "warp"

    def __init__(self, world: World, settings: BakeSettings, device: Device, fog: FogBoxes | None = None) -> None:
        threads = 1 if device.is_cuda else worker_count()
        super().__init__(world, settings, device.alias, threads, fog, Primitives.of(world.face_casts))
        self._given_device = device
        self.device = device.name if device.is_cuda else "cpu"
        self.batch_size = 1 << (18 if device.is_cuda else 11)
        wp = self.warp
        # Warp corrupts its allocator on a mesh without triangles; where nothing casts it gets one that no ray can hit.
        blockers = world.faces[self.cast_face] if len(self.cast_face) else np.zeros((1, 3), np.int32)
        indices = self.array(blockers.ravel(), wp.int32)
        self._mesh = wp.Mesh(
            points=self.positions, indices=indices, bvh_constructor="sah" if not device.is_cuda else None
        )
        self.scene = int(np.uint64(self._mesh.id))

    def updated(self, world: World, change: WorldChange, fog: FogBoxes | None) -> TracerWarp:
        """A tracer of the edited world, built anew; see `Tracer.updated`."""
        return TracerWarp(world, self.settings, self._given_device, fog)

    @contextmanager
    def part(self, faces: Int32Array) -> Generator[tuple[int, int]]:
        """Closest hits in a few faces; see `TracerFused.part`."""
        indices = self.array(self.world.faces[faces].ravel(), self.warp.int32)
        mesh = self.warp.Mesh(points=self.positions, indices=indices)
        yield 0, int(np.uint64(mesh.id))
        del mesh

    @contextmanager
    def passing_over(self, primitives: BoolArray) -> Generator[tuple[int, int]]:
        """Closest hits without some; see `TracerFused.passing_over`."""
        mask = self.array(primitives.view(np.uint8), self.warp.uint8)
        yield int(mask.ptr or 0), self.scene

    def close(self) -> None:
        """Frees the BVH before what it refers to."""
        self._mesh = None
        super().close()
