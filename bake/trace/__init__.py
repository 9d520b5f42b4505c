"""What is hit: one tracer interface, three bodies, each imported on demand."""

from __future__ import annotations

from bake.decorator_types import FogBoxes
from bake.devices import Device
from bake.errors import SettingsError
from bake.settings import BakeSettings, TracerKind
from bake.trace.base import Hits, SphereTally, Tracer
from bake.types import World

__all__ = ["Hits", "SphereTally", "Tracer", "create_tracer"]


def create_tracer(world: World, settings: BakeSettings, device: Device, *, fog: FogBoxes | None = None) -> Tracer:
    """The tracer that the settings ask for, ready to trace `world` on `device`.

    Faces of trees dim rays unless the settings skip trees; `fog` dims them besides.

    Raises:
        SettingsError: the tracer cannot run on the device.
        DeviceError: the tracer's library is missing or failed.
        OutOfMemoryError: the scene does not fit.
    """
    kind = settings.tracer
    if kind is TracerKind.AUTO:
        kind = TracerKind.WARP if device.is_cuda else TracerKind.EMBREE
    if device.is_cuda and kind is not TracerKind.WARP:
        raise SettingsError(f"{kind} traces on the CPU only", where="--tracer", remedy="use --device cpu or warp")
    if kind is TracerKind.EMBREE:
        from bake.trace.embree import TracerEmbree

        return TracerEmbree(world, settings, fog)
    if kind is TracerKind.WARP:
        from bake.trace.warp import TracerWarp

        return TracerWarp(world, settings, device, fog)
    from bake.trace.brute import TracerBrute

    return TracerBrute(world, settings, fog)
