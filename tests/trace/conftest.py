"""The tracers under test; CUDA joins them where there is a device."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from bake.decorator_types import FogBoxes
from bake.devices import Device, cuda_devices
from bake.samples import place_samples
from bake.settings import BakeSettings, TracerKind
from bake.trace import Tracer, create_tracer
from bake.types import SampleSet, Tally, World

CPU = Device("cpu", "CPU")
BODIES: dict[str, tuple[TracerKind, str]] = {
    "embree": (TracerKind.EMBREE, "cpu"),
    "warp-cpu": (TracerKind.WARP, "cpu"),
    "brute": (TracerKind.BRUTE, "cpu"),
    "cuda": (TracerKind.WARP, "cuda:0"),
}


def open_tracer(body: str, world: World, settings: BakeSettings, *, fog: FogBoxes | None = None) -> Tracer:
    """A tracer by the name of its body; skips the test where the machine lacks it."""
    kind, alias = BODIES[body]
    if kind is TracerKind.EMBREE:
        pytest.importorskip("embreex", reason="Embree is not installed")
    device = CPU
    if alias != "cpu":
        found = cuda_devices()
        if not found:
            pytest.skip("no CUDA device")
        device = found[0]
    return create_tracer(world, settings.replaced(tracer=kind), device, fog=fog)


def trace_all(
    body: str, world: World, settings: BakeSettings, *, fog: FogBoxes | None = None
) -> tuple[SampleSet, Tally]:
    """Samples of a world and what their rays found."""
    samples = place_samples(world, settings)
    tally = Tally.empty(len(samples), settings.distance_count)
    with open_tracer(body, world, settings, fog=fog) as tracer:
        for batch in samples.batches(tracer.batch_size):
            tracer.accumulate(samples, batch, tally)
    return samples, tally


@pytest.fixture(params=[pytest.param(b, marks=pytest.mark.cuda) if b == "cuda" else b for b in BODIES])
def body(request: pytest.FixtureRequest) -> str:
    """The name of each tracer body in turn."""
    return request.param


@pytest.fixture(params=["embree", "warp-cpu", pytest.param("cuda", marks=pytest.mark.cuda)])
def fast_body(request: pytest.FixtureRequest) -> str:
    """The bodies that are made for many rays."""
    return request.param


TraceAll = Callable[[str, World, BakeSettings], tuple[SampleSet, Tally]]
