"""What the Embree and the Warp tracer share: one fused kernel over one surface, launched batch by batch."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import AbstractContextManager
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.decorator_types import FogBoxes
from bake.devices import initialised_warp
from bake.errors import DeviceError, OutOfMemoryError
from bake.geometry import as_traced
from bake.settings import BakeSettings
from bake.trace.arguments import falloff_argument, surface_argument
from bake.trace.base import Hits, SphereTally, Tracer, check_directions
from bake.trace.primitives import Primitives
from bake.trace.recorder import Recorder
from bake.trace.records import RayRecords
from bake.trace.sphere_reader import FusedSphereReader
from bake.trace.veil import DeviceVeil
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, SampleSet, Tally, UInt32Array, World

_PARTS = 8
"""Launches a thread and batch: they even out what the threads get."""


class TracerFused(Tracer):
    """Launches the fused kernel; a body only supplies the addresses that its closest-hit function needs.

    Attributes:
        entry, scene: The two addresses.
        warp: The initialised module `warp`.
        surface, falloff: The kernels' arguments.
        primitives: The faces that a hit may name, in the order of the body's primitives.
        threads: Launches at a time: Warp runs CPU kernels on the calling thread, so the CPU bodies use several.
    """

    entry: int = 0
    scene: int = 0

    def __init__(
        self,
        world: World,
        settings: BakeSettings,
        warp_device: str,
        threads: int,
        fog: FogBoxes | None,
        primitives: Primitives,
        veil: Callable[[Any], DeviceVeil] | None = None,
    ) -> None:
        super().__init__(world, settings)
        self.warp = initialised_warp()
        from bake.kernels import obscurance, sphere

        self._kernels, self._sphere = obscurance, sphere
        self._warp_device = warp_device
        self._pool = ThreadPoolExecutor(threads, "tracer") if threads > 1 else None
        self._threads = threads
        self.fog, self.primitives, self.cast_face = fog, primitives, primitives.faces
        self.points = as_traced(world.positions)
        try:
            self.positions = self.array(self.points, self.warp.vec3)
            self.surface: Any = surface_argument(self.warp, self.array, world, self.cast_face, self.positions)
            self._veil: DeviceVeil | None = (
                veil(self.positions)
                if veil is not None
                else DeviceVeil(self.warp, warp_device, world, settings, fog, self.positions)
            )
        except RuntimeError as error:
            raise _device_failure(error, warp_device) from error
        self.fog_boxes, self.tree_triangles = self._veil.fog_boxes, self._veil.tree_triangles
        self.falloff = falloff_argument(settings)
        # Compiling takes seconds when the cache is cold, so it belongs to the preparation.
        self._compile(self._obscurance_kernel())
        self._work: Any = None
        self._work_of: SampleSet | None = None

    def accumulate(self, samples: SampleSet, batch: slice, tally: Tally, *, rays: int | None = None) -> None:
        """Traces a batch; see `Tracer.accumulate`."""
        if self._work_of is not samples:
            self._work, self._work_of = self._upload_work(samples), samples
        self._work.rays = rays = self.settings.rays if rays is None else rays
        assert self._veil is not None
        inputs = [self.entry, self.scene, self.surface, self._veil.argument, self._work, self.falloff]
        self._trace(batch, inputs)
        tally.ao[batch] = self._download(self._work.ao, batch)
        tally.hits[batch] = self._download(self._work.hits, batch)
        tally.back_faces[batch] = self._download(self._work.back_faces, batch)
        tally.rays[batch] = rays

    def nearest(self, origins: Float32Array, directions: Float32Array, t_max: float) -> Hits:
        """Closest hits; see `Tracer.nearest`."""
        wp, count = self.warp, len(origins)
        distance, face = self.empty(count, wp.float32), self.empty(count, wp.int32)
        cosine, weights = self.empty(count, wp.float32), self.empty(count, wp.vec2)
        inputs = [
            self.entry, self.scene, self.surface.cast_face, self.array(origins, wp.vec3),
            self.array(directions, wp.vec3), t_max, distance, face, cosine, weights,
        ]  # fmt: skip
        self.launch(self._kernels.nearest_kernel(self.name), slice(0, count), inputs)
        return Hits(distance.numpy(), face.numpy(), cosine.numpy(), weights.numpy())

    def transmittance(self, origins: Float32Array, directions: Float32Array, distance: float) -> Float32Array:
        """What fog and trees let through; see `Tracer.transmittance`."""
        assert self._veil is not None
        wp, count = self.warp, len(origins)
        passes = self.empty(count, wp.float32)
        inputs = [
            self.surface, self._veil.argument, self.array(origins, wp.vec3), self.array(directions, wp.vec3),
            distance, passes,
        ]  # fmt: skip
        kernel = self._kernels.transmittance_kernel(self.fog_boxes > 0, self.tree_triangles > 0)
        self.launch(kernel, slice(0, count), inputs)
        return passes.numpy()

    def gather_sphere(
        self, points: Float32Array, seeds: UInt32Array, directions: int, *, trees: bool = True
    ) -> SphereTally:
        """Spherical harmonics of what is open around points; see `Tracer.gather_sphere`."""
        check_directions(directions)
        wp, count, columns = self.warp, len(points), self.settings.distance_count
        work = self._sphere.Points()
        try:
            work.position = self.array(points.astype(np.float32, copy=False), wp.vec3)
            work.seed = self.array(seeds.astype(np.uint32, copy=False), wp.uint32)
            work.directions = directions
            work.sh = self.empty((count, 9, columns), wp.float32)
            work.hits = self.empty(count, wp.uint16)
            work.back_faces = self.empty(count, wp.uint16)
        except RuntimeError as error:
            raise _device_failure(error, self._warp_device) from error
        assert self._veil is not None
        inputs = [self.entry, self.scene, self.surface, self._veil.argument, work, self.falloff]
        self._gather(slice(0, count), inputs, self.fog_boxes > 0, self.tree_triangles > 0 and trees)
        return SphereTally(work.sh.numpy(), directions, work.hits.numpy(), work.back_faces.numpy())

    def sphere_reader(
        self, ao: Float32Array, carries: BoolArray, counts: BoolArray, outward: Float64Array
    ) -> FusedSphereReader:
        """Reads baked AO off the tracer's faces within spheres; it must not outlive the tracer.

        Args:
            ao: Shape (v, k), float32: AO at the world's vertices.
            carries: Shape (m,): faces that have it at all corners; others are passed.
            counts: Shape (r, o): which objects count for spheres of row r.
            outward: Shape (d, 3), float64: unit vectors from the centre to where rays begin.
        """
        from bake.kernels.read_spheres import reading_kernel

        def run(reading: Any, count: int) -> None:
            inputs = [self.entry, self.scene, self.surface, reading]
            self.launch(reading_kernel(self.name), slice(0, count), inputs)

        try:
            return FusedSphereReader(
                self.warp, self.array, run, ao=ao, carries=carries, counts=counts, outward=outward,
                at_once=self.points_at_once(len(outward)),
            )  # fmt: skip
        except RuntimeError as error:
            raise _device_failure(error, self._warp_device) from error

    def record(self, samples: SampleSet) -> RayRecords:
        """Rays one by one; see `Tracer.record`."""
        return self._recorder().record(samples)

    def meets(
        self, samples: SampleSet, wanted: int, low: Float32Array, high: Float32Array, *, rays: int | None = None
    ) -> BoolArray:
        """Which samples have a ray that meets an object; see `Tracer.meets`."""
        return self._recorder().meets(samples, wanted, low, high, rays)

    def trace_without(self, samples: SampleSet, wanted: int, fog: FogBoxes | None, *, rays: int | None = None) -> Tally:
        """Traces as if one object did not cast; see `Tracer.trace_without`."""
        assert self._veil is not None
        work, veil = self._upload_work(samples), self._veil.without(self.world, wanted, fog)
        work.rays = rays = self.settings.rays if rays is None else rays
        own = self.world.face_object[self.cast_face] == wanted
        kernel = self._kernels.obscurance_kernel(f"{self.name}-without", veil.fog_boxes > 0, veil.tree_triangles > 0)
        with self.passing_over(own) as handles:
            inputs = [*handles, self.surface, veil.argument, work, self.falloff]
            self.launch(kernel, slice(0, len(samples)), inputs)
        sent = np.full(len(samples), rays, np.uint16)
        return Tally(work.ao.numpy(), sent, work.hits.numpy(), work.back_faces.numpy())

    def close(self) -> None:
        """Frees device memory and threads."""
        if self._pool is not None:
            self._pool.shutdown()
        self.surface = self._veil = self._work = self._work_of = None

    @property
    def veil(self) -> Any:
        """The kernels' `Veil`."""
        assert self._veil is not None
        return self._veil.argument

    @abstractmethod
    def part(self, faces: Int32Array) -> AbstractContextManager[tuple[int, int]]:
        """The two addresses for a closest-hit function over a few faces alone, at least one, in their order."""

    @abstractmethod
    def passing_over(self, primitives: BoolArray) -> AbstractContextManager[tuple[int, int]]:
        """The two addresses for a closest-hit function that passes over some primitives, besides those that are gone.

        Args:
            primitives: Shape (p,): those.
        """

    def _recorder(self) -> Recorder:
        assert self._veil is not None
        return Recorder(
            self.warp, self.array, self.empty, self.launch, self.world, self.settings, self.name, self.entry,
            self.scene, self.surface, self._veil,
        )  # fmt: skip

    def _obscurance_kernel(self) -> Any:
        return self._kernels.obscurance_kernel(self.name, self.fog_boxes > 0, self.tree_triangles > 0)

    def _trace(self, batch: slice, inputs: list[Any]) -> None:
        """Runs the fused kernel on samples `batch`."""
        self.launch(self._obscurance_kernel(), batch, inputs)

    def _gather(self, batch: slice, inputs: list[Any], fog: bool, trees: bool) -> None:
        """Runs the kernel of spheres on points `batch`."""
        self.launch(self._sphere.sphere_kernel(self.name, fog, trees, self.settings.distance_count), batch, inputs)

    def launch(self, kernel: Any, batch: slice, inputs: list[Any]) -> None:
        """Runs a kernel whose last argument is the first index, over `batch`."""

        def part(begin: int, end: int) -> None:
            self.warp.launch(kernel, dim=end - begin, inputs=[*inputs, begin], device=self._warp_device)

        self.launch_parts(kernel, batch, part)

    def launch_parts(self, kernel: Any, batch: slice, part: Callable[[int, int], None]) -> None:
        """Compiles a kernel, and has `part(begin, end)` launch it over each of the parts of `batch`."""
        count = batch.stop - batch.start
        if count <= 0:
            return
        self._compile(kernel)
        try:
            if self._pool is None:
                part(batch.start, batch.stop)
                return
            parts = min(count, _PARTS * self._threads)
            edges = [batch.start + count * i // parts for i in range(parts + 1)]
            running = [self._pool.submit(part, a, b) for a, b in pairwise(edges)]
            try:
                for done in running:
                    done.result()
            finally:
                # Whatever interrupts us, nobody may free the scene under a thread that still traces.
                wait(running)
        except RuntimeError as error:
            raise _device_failure(error, self._warp_device) from error

    def _compile(self, kernel: Any) -> None:
        # At its first launch a kernel is compiled; several threads at once would compile it several times.
        try:
            self.warp.load_module(kernel.module, device=self._warp_device)
        except (RuntimeError, OSError) as error:
            raise _device_failure(error, self._warp_device) from error

    def array(self, values: NDArray[Any], dtype: Any) -> Any:
        """A NumPy array on the device; on the CPU both share their memory."""
        return self.warp.array(np.ascontiguousarray(values), dtype=dtype, device=self._warp_device, copy=False)

    def empty(self, shape: int | tuple[int, ...], dtype: Any) -> Any:
        """Zeros on the device."""
        return self.warp.zeros(shape, dtype=dtype, device=self._warp_device)

    def _download(self, values: Any, batch: slice) -> NDArray[Any]:
        return values[batch.start : batch.stop].numpy()

    def _upload_work(self, samples: SampleSet) -> Any:
        wp, count = self.warp, len(samples)
        try:
            work = self.sent_by(samples)
            work.ao = self.empty((count, self.settings.distance_count), wp.float32)
            work.hits = self.empty(count, wp.uint16)
            work.back_faces = self.empty(count, wp.uint16)
        except RuntimeError as error:
            raise _device_failure(error, self._warp_device) from error
        return work

    def sent_by(self, samples: SampleSet) -> Any:
        """The kernels' `Work` for some samples, without room for what they find."""
        wp = self.warp
        work: Any = self._kernels.Work()
        work.face = self.array(samples.face, wp.int32)
        work.barycentric = self.array(samples.barycentric, wp.vec2)
        work.index = self.array(samples.index, wp.int32)
        work.face_seed = self.array(samples.face_seed, wp.uint32)
        work.rays = self.settings.rays
        return work


def _device_failure(error: Exception, device: str) -> DeviceError | OutOfMemoryError:
    text = str(error)
    if "allocate" in text.lower() or "memory" in text.lower():
        return OutOfMemoryError(
            f"not enough memory on {device} ({text})", where="trace", remedy="use fewer samples or --device cpu"
        )
    return DeviceError(f"{device} failed ({text})", where="trace", remedy="try again, or use --device cpu")
