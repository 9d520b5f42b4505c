"""What a choice in the tracer costs: processor time on runs of samples spread over a scene, the choices in turn."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bake.arrays import Int64Array
from bake.bench.scaling_scenes import write_field
from bake.decorator_types import FogBoxes
from bake.decorators.fog import make_fog
from bake.samples import place_samples
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.types import SampleSet, World

REPEATS = 3
_RUNS, _LENGTH = 8, 2048
_FIELD = 1_000_000


@dataclass(frozen=True, slots=True)
class Subject:
    """A scene made ready, and the samples that are traced.

    Attributes:
        name: The scene's.
        world, fog: As for `create_tracer`.
        samples: Runs of neighbours, one after another, spread evenly over all samples.
        runs: Where each begins and ends.
    """

    name: str
    world: World
    fog: FogBoxes | None
    samples: SampleSet
    runs: Sequence[slice]

    @staticmethod
    def of(scene: Path, settings: BakeSettings, *, runs: int = _RUNS, length: int = _LENGTH) -> Subject:
        """Loads a scene and takes `runs` runs of `length` samples of it, or all where there are fewer."""
        world = flatten(load_scene(scene, crease_angle=settings.crease_angle), settings)
        placed = place_samples(world, settings)
        rows: Int64Array = np.arange(len(placed))
        if len(placed) > runs * length:
            firsts = np.linspace(0, len(placed) - length, runs).astype(np.int64)
            rows = (firsts[:, None] + np.arange(length)).ravel()
        samples = placed.only(rows)
        fog = None if "fog" in settings.skip else make_fog(world, settings)
        return Subject(scene.stem, world, fog, samples, list(samples.batches(length)))


def subjects(scenes: Sequence[Path], settings: BakeSettings) -> list[Subject]:
    """The scenes made ready, and a rolling field of a million triangles."""
    with tempfile.TemporaryDirectory() as folder:
        field = write_field(Path(folder) / "field of 1.0 M.glb", _FIELD)
        return [Subject.of(scene, settings) for scene in (*scenes, field)]


def processor_seconds(ways: Mapping[str, Callable[[slice], object]], runs: Sequence[slice]) -> dict[str, float]:
    """Seconds of the processor for each way of tracing all runs, least of a few times; in turn, run by run.

    What else the machine does slows all ways alike, and is not counted itself.
    """
    least: dict[str, float] = {}
    for _ in range(REPEATS):
        taken = dict.fromkeys(ways, 0.0)
        for run in runs:
            for name, trace in ways.items():
                begin = time.process_time()
                trace(run)
                taken[name] += time.process_time() - begin
        least = {name: min(seconds, least.get(name, seconds)) for name, seconds in taken.items()}
    return least


def rate(rays: int, seconds: float) -> dict[str, Any]:
    """Columns of a rate."""
    return {"Mrays/s a core": rays / seconds / 1e6, "ns a ray": seconds / rays * 1e9}
