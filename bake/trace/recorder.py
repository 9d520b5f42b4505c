"""Launches the recording kernels for a fused tracer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.settings import BakeSettings
from bake.trace.records import RayRecords
from bake.trace.veil import DeviceVeil
from bake.types import BoolArray, Float32Array, Int32Array, SampleSet, World


@dataclass(frozen=True, slots=True)
class Recorder:
    """What a fused tracer lends for it.

    Attributes:
        warp: The initialised module `warp`.
        array, empty: Make arrays on the device.
        launch: Runs a kernel, whose last argument is the first index, over a range.
        world, settings: The tracer's.
        body: "embree" or "warp".
        entry, scene: Addresses for the closest-hit function.
        surface, veil: The kernels' arguments.
    """

    warp: Any
    array: Callable[[NDArray[Any], Any], Any]
    empty: Callable[[int, Any], Any]
    launch: Callable[[Any, slice, list[Any]], None]
    world: World
    settings: BakeSettings
    body: str
    entry: int
    scene: int
    surface: Any
    veil: DeviceVeil

    def record(self, samples: SampleSet) -> RayRecords:
        """Every ray of the samples; see `Tracer.record`."""
        from bake.kernels import records

        wp, count, rays = self.warp, len(samples), self.settings.rays
        out: Any = records.Records()
        out.origin, out.direction = self.empty(count, wp.vec3), self.empty(count * rays, wp.vec3)
        out.distance, out.passes = self.empty(count * rays, wp.float32), self.empty(count * rays, wp.float32)
        out.face, out.first_face = self.empty(count * rays, wp.int32), self.empty(count * rays, wp.int32)
        out.flags = self.empty(count * rays, wp.uint8)
        fog, trees = self.veil.fog_boxes > 0, self.veil.tree_triangles > 0
        inputs = [
            self.entry, self.scene, self.surface, self.veil.argument, self._chosen(records, samples),
            self.settings.trace_distance, out,
        ]  # fmt: skip
        self.launch(records.record_kernel(self.body, fog, trees), slice(0, count), inputs)
        flags = out.flags.numpy().reshape(count, rays)
        crossed = self._crossings(records, out, rays) if fog or trees else _no_crossings()
        return RayRecords(
            origin=out.origin.numpy(),
            direction=out.direction.numpy().reshape(count, rays, 3),
            distance=out.distance.numpy().reshape(count, rays),
            face=out.face.numpy().reshape(count, rays),
            first_face=out.first_face.numpy().reshape(count, rays),
            back=(flags & 4) > 0,
            mirrored=(flags & 8) > 0,
            passes=out.passes.numpy().reshape(count, rays),
            crossed_ray=crossed[0],
            crossed_object=crossed[1],
            crossed_depth=crossed[2],
        )

    def meets(
        self, samples: SampleSet, wanted: int, low: Float32Array, high: Float32Array, rays: int | None = None
    ) -> BoolArray:
        """Which samples have a ray that meets an object; see `Tracer.meets`."""
        from bake.kernels import records

        wp, count = self.warp, len(samples)
        found: Any = self.empty(count, wp.uint8)
        chosen = self._chosen(records, samples)
        if rays is not None:
            chosen.rays = rays
        inputs = [
            self.entry, self.scene, self.surface, chosen, self.settings.trace_distance,
            wanted, self.array(low, wp.vec3), self.array(high, wp.vec3), found,
        ]  # fmt: skip
        self.launch(records.meets_kernel(self.body), slice(0, count), inputs)
        return found.numpy() > 0

    def _chosen(self, records: Any, samples: SampleSet) -> Any:
        wp: Any = self.warp
        chosen: Any = records.Chosen()
        chosen.face = self.array(samples.face, wp.int32)
        chosen.barycentric = self.array(samples.barycentric, wp.vec2)
        chosen.index = self.array(samples.index, wp.int32)
        chosen.face_seed = self.array(samples.face_seed, wp.uint32)
        chosen.rays = self.settings.rays
        return chosen

    def _crossings(self, records: Any, out: Any, rays: int) -> tuple[NDArray[Any], ...]:
        """Rays, objects and depths of all crossings: counted first, then written."""
        wp, count = self.warp, len(out.distance)
        kernel = records.crossings_kernel(self.veil.fog_boxes > 0, self.veil.tree_triangles > 0)
        boxes, leaves = self.empty(count, wp.int32), self.empty(count, wp.int32)
        nowhere = self.array(np.zeros(0, np.int64), wp.int64)

        def walk(begin: Any, place: Any, depth: Any) -> None:
            inputs = [
                self.surface, self.veil.argument, out.origin, out.direction, out.distance, rays, begin, boxes,
                leaves, place, depth,
            ]  # fmt: skip
            self.launch(kernel, slice(0, count), inputs)

        walk(nowhere, self.empty(0, wp.int32), self.empty(0, wp.float32))
        each = boxes.numpy().astype(np.int64) + leaves.numpy()
        total = int(each.sum())
        if total == 0:
            return _no_crossings()
        place, depth = self.empty(total, wp.int32), self.empty(total, wp.float32)
        walk(self.array(np.cumsum(each) - each, wp.int64), place, depth)
        at, ray = place.numpy(), np.repeat(np.arange(count, dtype=np.int64), each)
        there = np.ones(total, np.bool_)
        there[at < 0] = self.veil.tree_face[-1 - at[at < 0]] >= 0  # leaves that are gone dim nothing
        at, ray, depths = at[there], ray[there], depth.numpy()[there]
        objects = np.empty(len(at), np.int32)
        fog = at >= 0
        objects[fog] = self.veil.fog_object[at[fog]]
        objects[~fog] = self.world.face_object[self.veil.tree_face[-1 - at[~fog]]]
        return ray, objects, depths


def _no_crossings() -> tuple[NDArray[Any], Int32Array, Float32Array]:
    return np.zeros(0, np.int64), np.zeros(0, np.int32), np.zeros(0, np.float32)
