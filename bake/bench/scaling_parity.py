"""Whether the tracer that is timed finds what brute force finds, sample for sample: no rate counts without it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from bake.bench.scaling_device import has_embree, runnable
from bake.bench.scaling_glb import Placed, write_scene
from bake.bench.scaling_scenes import SEED
from bake.bench.synthetic import field_with_props
from bake.bench.table import Measurements
from bake.devices import Device
from bake.samples import place_samples
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings, Kernel, TracerKind
from bake.trace import create_tracer
from bake.types import SampleSet, Tally, World

_CELLS, _PROPS, _RAYS = 12, 6, 32
_TYPICAL = 2e-5


def measure_parity(options: Mapping[str, Any]) -> Measurements:
    """Both kernels by the device's tracer, and by Embree where it is installed, against NumPy's brute force.

    Args:
        options: Bake options by long name; only the device and the tracer count.
    """
    options, device = runnable(options)
    cpu = Device("cpu", "CPU")
    tracers = [(TracerKind(str(options.get("tracer", "auto"))), device)]
    if has_embree() and device.is_cuda:
        tracers.append((TracerKind.EMBREE, cpu))
    rows: list[dict[str, Any]] = []
    with TemporaryDirectory() as folder:
        field = field_with_props(_CELLS, _PROPS, seed=SEED, subdivisions=1)
        scene = load_scene(write_scene(Path(folder) / "field.glb", {"field": field}, [Placed("field", "field")]))
    for kernel in Kernel:
        far = 20.0 if kernel is Kernel.OCCLUSION else None
        settings = BakeSettings(rays=_RAYS, samples_per_face=(1, 1), kernel=kernel, max_distance=far)
        world = flatten(scene, settings)
        samples = place_samples(world, settings)
        expected = _traced(world, samples, settings.replaced(tracer=TracerKind.BRUTE), cpu)[1]
        for kind, where in tracers:
            name, tally = _traced(world, samples, settings.replaced(tracer=kind), where)
            difference = np.abs(tally.ao - expected.ao).max(axis=1)
            typical, worst = float(np.quantile(difference, 0.99)), float(difference.max())
            rows.append(
                {
                    "kernel": kernel.value, "tracer": name, "samples": len(samples), "99 % within": typical,
                    "most": worst, "other hit counts %": 100.0 * float((tally.hits != expected.hits).mean()),
                    "passed": typical < _TYPICAL and worst <= 2.0 / _RAYS,
                }
            )  # fmt: skip
    notes = [
        f"AO of {_RAYS} rays a sample against brute force in NumPy; gate: 99 % of samples within {_TYPICAL:g}, none "
        "off by more than two rays",
    ]
    return Measurements("parity", rows, notes, seeds={"scene": SEED, "bake": 1})


def _traced(world: World, samples: SampleSet, settings: BakeSettings, device: Device) -> tuple[str, Tally]:
    tally = Tally.empty(len(samples), settings.distance_count)
    with create_tracer(world, settings, device) as tracer:
        for batch in samples.batches(tracer.batch_size):
            tracer.accumulate(samples, batch, tally)
        return f"{tracer.name} on {tracer.device}", tally
