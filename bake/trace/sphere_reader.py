"""Reads baked AO within spheres by a fused tracer's kernel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.decorator_types import Readings, ReadingSpheres
from bake.types import BoolArray, Float32Array, Float64Array


class FusedSphereReader:
    """One baked surface on the device, for any number of spheres.

    Attributes:
        at_once: Spheres that a call of `read` handles well.
    """

    def __init__(
        self,
        wp: Any,
        array: Callable[[NDArray[Any], Any], Any],
        run: Callable[[Any, int], None],
        *,
        ao: Float32Array,
        carries: BoolArray,
        counts: BoolArray,
        outward: Float64Array,
        at_once: int,
    ) -> None:
        """Puts the surface on the device.

        Args:
            wp: The initialised module `warp`.
            array: Puts an array on the device.
            run: Launches the kernel over that many spheres.
            ao, carries, counts, outward: As for `TracerFused.sphere_reader`.
            at_once: Spheres that a call handles well.
        """
        from bake.kernels.read_spheres import Reading

        self._wp, self._array, self._run = wp, array, run
        self.at_once = at_once
        self._columns = ao.shape[1]
        reading: Any = Reading()
        reading.ao = array(ao, wp.float32)
        reading.carries = array(carries.astype(np.uint8), wp.uint8)
        reading.counts = array(counts.astype(np.uint8), wp.uint8)
        reading.outward = array(outward, wp.vec3d)
        self._reading = reading

    def read(self, spheres: ReadingSpheres) -> Readings:
        """What the spheres find."""
        wp, array, count, reading = self._wp, self._array, len(spheres), self._reading
        reading.centre, reading.least = array(spheres.centre, wp.vec3d), array(spheres.least, wp.float64)
        reading.most, reading.row = array(spheres.most, wp.float64), array(spheres.row, wp.int32)
        reading.own_face = array(spheres.own_face, wp.int32)
        reading.mean = array(np.empty((count, self._columns)), wp.float64)
        reading.hits = array(np.empty(count, np.int32), wp.int32)
        reading.rays = array(np.empty(count, np.int32), wp.int32)
        self._run(reading, count)
        return Readings(reading.mean.numpy(), reading.hits.numpy(), int(reading.rays.numpy().sum(dtype=np.int64)))
