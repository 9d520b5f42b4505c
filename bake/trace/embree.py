"""Tracing with Embree on the CPU: the fused kernel calls libembree4 for its closest hits."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np

from bake.change_types import WorldChange
from bake.decorator_types import FogBoxes
from bake.devices import worker_count
from bake.settings import BakeSettings
from bake.trace.embree_library import EmbreeScene
from bake.trace.fused import TracerFused
from bake.trace.primitives import Primitives, compact
from bake.trace.veil import DeviceVeil
from bake.types import BoolArray, Int32Array, World

_LEAST_RAYS = 8
"""With fewer a sample there is nothing to sort, and its frame is not worth making twice."""

_LEAST_DIRECTIONS = 64


class TracerEmbree(TracerFused):
    """The fused kernel over two Embree scenes: the one that was built first, and a small one of what was added since.

    What is gone stays in the first and is passed over (`bake/kernels/closest.py`).

    Attributes:
        grouped: Whether sixteen samples, or directions, are traced at a time.
        packets: Whether their first hits are found sixteen at a time. A packet may pass over the nearer of two faces
            that meet at an edge, a last bit apart, where a single ray never does.
    """

    name = "embree"
    device = "cpu"

    def __init__(
        self,
        world: World,
        settings: BakeSettings,
        fog: FogBoxes | None = None,
        *,
        kept: tuple[EmbreeScene, Primitives, Callable[[Any], DeviceVeil]] | None = None,
    ) -> None:
        """Builds the BVH, or takes over that of an earlier world.

        Args:
            world, settings, fog: As for `create_tracer`.
            kept: A scene that the tracer will own, this world's primitives in it, and what makes the veil from the
                positions on the device.
        """
        primitives = Primitives.of(world.face_casts) if kept is None else kept[1]
        self.packets = settings.packets
        # Packets know one scene, of which nothing is passed over.
        self.grouped = not len(primitives.added) and (kept is None or not primitives.gone.any())
        super().__init__(world, settings, "cpu", worker_count(), fog, primitives, None if kept is None else kept[2])
        # About 50 ms of work for two threads at 4 million rays a second each.
        self.batch_size = max(64, (1 << 19) // settings.rays)
        self._first = EmbreeScene(*self._geometry(primitives.kept)) if kept is None else kept[0]
        self._second = EmbreeScene(*self._geometry(primitives.added)) if len(primitives.added) else None
        self.entry = self._first.intersect_address
        gone = primitives.gone if kept is not None else np.zeros(0, np.bool_)
        self._gone = gone.view(np.uint8) if gone.any() else None
        self._held = self._handles(self._gone)
        self.scene = self._held.ctypes.data

    def updated(self, world: World, change: WorldChange, fog: FogBoxes | None) -> TracerEmbree:
        """A tracer of the edited world; see `Tracer.updated`."""
        assert self._veil is not None
        primitives = self.primitives.followed(world.face_casts, change)
        if primitives.worn:
            return TracerEmbree(world, self.settings, fog)
        veil = partial(self._veil.updated, world, self.settings, change, fog)
        return TracerEmbree(world, self.settings, fog, kept=(self._first.shared(), primitives, veil))

    def _obscurance_kernel(self) -> Any:
        if not self.grouped:
            return super()._obscurance_kernel()
        grouped: Any = importlib.import_module("bake.kernels.grouped")
        return grouped.grouped_kernel(self.fog_boxes > 0, self.tree_triangles > 0)

    def _trace(self, batch: slice, inputs: list[Any]) -> None:
        rays = int(inputs[4].rays)
        if not self.grouped or rays < _LEAST_RAYS:
            self.launch(super()._obscurance_kernel(), batch, inputs)
            return
        self._launch_groups(self._obscurance_kernel(), batch, inputs, together=True)

    def _gather(self, batch: slice, inputs: list[Any], fog: bool, trees: bool) -> None:
        directions = int(inputs[4].directions)
        if not self.grouped or directions < _LEAST_DIRECTIONS:
            super()._gather(batch, inputs, fog, trees)
            return
        spheres: Any = importlib.import_module("bake.kernels.grouped_sphere")
        kernel = spheres.grouped_sphere_kernel(fog, trees, self.settings.distance_count)
        self._launch_groups(kernel, batch, inputs, together=False)

    def _launch_groups(self, kernel: Any, batch: slice, inputs: list[Any], *, together: bool) -> None:
        """Launches a kernel that works on a scratch; `together`: one of its threads takes sixteen samples."""
        sizes: Any = importlib.import_module("bake.kernels.packets")
        wp = self.warp

        def part(begin: int, end: int) -> None:
            reals = wp.empty(sizes.REALS, dtype=wp.float32, device="cpu")
            wholes = wp.empty(sizes.WHOLES, dtype=wp.int32, device="cpu")
            threads = -(-(end - begin) // sizes.LANES) if together else end - begin
            bounds = [end, begin] if together else [begin]
            wp.launch(kernel, dim=threads, inputs=[*inputs, int(self.packets), reals, wholes, *bounds], device="cpu")

        self.launch_parts(kernel, batch, part)

    def _geometry(self, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if len(faces) * 3 >= len(self.points):
            return self.points, self.world.faces[faces].astype(np.uint32)
        return compact(self.world, self.points, faces)

    def _handles(self, gone: np.ndarray | None, *, second: bool = True) -> np.ndarray:
        """What the closest-hit function reads; the arrays that it leads to have to stay."""
        added = self._second.address if self._second is not None and second else 0
        mask = 0 if gone is None else gone.ctypes.data
        faces = self.cast_face.ctypes.data
        openness, two_sided = int(self.surface.openness.ptr or 0), int(self.surface.two_sided.ptr or 0)
        return np.array(
            [
                self._first.address, self._first.triangles, added, mask, faces, openness, two_sided,
                self._first.intersect_packet_address,
            ],
            np.uint64,
        )  # fmt: skip

    @contextmanager
    def part(self, faces: Int32Array) -> Generator[tuple[int, int]]:
        """Closest hits in a few faces; see `TracerFused.part`."""
        scene = EmbreeScene(*self._geometry(faces))
        held = np.array([scene.address, len(faces), 0, 0, 0, 0, 0], np.uint64)  # its hits are never settled
        try:
            yield self.entry, held.ctypes.data
        finally:
            scene.close()

    @contextmanager
    def passing_over(self, primitives: BoolArray) -> Generator[tuple[int, int]]:
        """Closest hits without some; see `TracerFused.passing_over`."""
        mask = primitives.view(np.uint8) if self._gone is None else primitives.view(np.uint8) | self._gone
        of_first, of_second = np.split(mask, [self._first.triangles])
        second = not of_second.all()
        masked = of_first.any() or (second and of_second.any())
        held = self._handles(mask if masked else None, second=second)
        yield self.entry, held.ctypes.data

    def close(self) -> None:
        """Frees the Embree scenes, or its share in them."""
        self._first.close()
        if self._second is not None:
            self._second.close()
        super().close()
