"""The rays behind some samples, traced again: the same seeds, the same sequences, the same tracer if it is there."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bake.decorator_types import FogBoxes
from bake.devices import Device, resolve
from bake.errors import DeviceError
from bake.explain.types import Crossings, TracedRays
from bake.settings import BakeSettings, Kernel, TracerKind
from bake.trace import Tracer, create_tracer
from bake.trace.records import RayRecords
from bake.types import BakeResult, Float32Array, Int64Array, SampleSet, UInt16Array, World


def tracer_like(result: BakeResult, world: World | None = None, fog: FogBoxes | None = None) -> Tracer:
    """A tracer as the bake had it, over its world or another one; on the CPU if its device is not here.

    Args:
        result: A bake.
        world: What to trace; the result's if None, and then with its fog.
        fog: The fog of `world`.

    Raises:
        DeviceError: nothing here can trace.
    """
    if world is None:
        world = result.world
        fog = None if result.decorators is None else result.decorators.fog
    kind, device = _body(result)
    return create_tracer(world, result.settings.replaced(tracer=kind, device=device.alias), device, fog=fog)


def _body(result: BakeResult) -> tuple[TracerKind, Device]:
    if result.tracer == "brute":
        return TracerKind.BRUTE, resolve("cpu")
    if result.device != "cpu":
        try:
            device = resolve(result.settings.device if result.settings.device.startswith("cuda") else "auto")
            if device.is_cuda:
                return TracerKind.WARP, device
        except DeviceError:
            pass  # baked elsewhere: the CPU sees the same but for rounding, and the explanation says by how much
        return TracerKind.EMBREE, resolve("cpu")
    return (TracerKind.WARP if result.tracer == "warp" else TracerKind.EMBREE), resolve("cpu")


def trace_again(tracer: Tracer, samples: SampleSet, rows: Int64Array, sent: UInt16Array) -> TracedRays:
    """The rays of some samples.

    Args:
        tracer: As the bake had it.
        samples: All samples of the bake.
        rows: Shape (t,), int64: which.
        sent: Shape (t,): how many rays each of them sent.
    """
    found = _as_sent(tracer.record(samples.only(rows)), sent.astype(np.int64))
    world = tracer.world
    stopped = found.face >= 0
    owner = np.where(stopped, world.face_object[np.maximum(found.face, 0)], -1).astype(np.int32)
    rho = rho_of(found.distance, tracer.settings)
    rho[~stopped] = 1.0
    return TracedRays(
        sample=rows,
        origin=found.origin,
        direction=found.direction,
        distance=found.distance,
        face=found.face,
        object=owner,
        first_face=found.first_face,
        back=found.back,
        mirrored=found.mirrored,
        rho=rho,
        passes=found.passes,
        crossings=Crossings(found.crossed_ray, found.crossed_object, found.crossed_depth),
        sent=sent.astype(np.int64),
    )


def _as_sent(found: RayRecords, sent: Int64Array) -> RayRecords:
    """The first rays of each sample, as many as it sent, again and again up to the most of a sample."""
    rays = found.face.shape[1]
    if (sent == rays).all():
        return found
    column: Int64Array = np.arange(rays, dtype=np.int64) % sent[:, None]
    row = np.arange(len(sent))[:, None]
    of, at = found.crossed_ray // rays, found.crossed_ray % rays
    kept = np.flatnonzero(at < sent[of])
    copies = rays // sent[of[kept]]
    which = np.repeat(kept, copies)
    turn = np.arange(len(which)) - np.repeat(np.cumsum(copies) - copies, copies)
    crossed = found.crossed_ray[which] + turn * sent[of[which]]
    order = np.argsort(crossed, kind="stable")
    return replace(
        found,
        direction=found.direction[row, column],
        distance=found.distance[row, column],
        face=found.face[row, column],
        first_face=found.first_face[row, column],
        back=found.back[row, column],
        mirrored=found.mirrored[row, column],
        passes=found.passes[row, column],
        crossed_ray=crossed[order],
        crossed_object=found.crossed_object[which][order],
        crossed_depth=found.crossed_depth[which][order],
    )


def rho_of(distance: Float32Array, settings: BakeSettings) -> Float32Array:
    """ρ at the distances of hits, of any shape, with a last axis of k columns added (Sloan et al. 2013, equation 1)."""
    if settings.kernel is Kernel.OCCLUSION:
        return np.zeros((*distance.shape, 1), np.float32)
    rates = (-math.log(2.0) / np.asarray(settings.distances)).astype(np.float32)
    return -np.expm1(distance[..., None] * rates)
