"""Where rays may end: what cutting the kernel's tail saves, and what it changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.table import Measurements
from bake.bench.trace_runs import REPEATS, Subject, processor_seconds, rate, subjects
from bake.devices import Device
from bake.settings import BakeSettings, Kernel
from bake.trace import Tracer, create_tracer
from bake.types import Tally

TAILS = (1 / 256, 1 / 512, 1 / 1024, 1 / 4096)
DISTANCES = ((2.0,), (2.0, 300.0))
_WHOLE = 2.0**-20
"""What is compared with: no more than this is cut."""


def measure_tail(scenes: Sequence[Path], options: Mapping[str, Any]) -> Measurements:
    """Processor time a ray and change of AO for several tail bounds, at 2 m alone and at 2 m and 300 m.

    Args:
        scenes: Scene files; a rolling field of a million triangles comes last.
        options: Bake options by long name; those of kernel, distances, tail and what is skipped are set here.
    """
    given = {"tracer": "auto", **options, "device": "cpu"}
    settings = BakeSettings.from_options(given).replaced(
        kernel=Kernel.OBSCURANCE, max_distance=None, skip=("fog", "trees")
    )
    rows = [row for subject in subjects(scenes, settings) for row in tail_rows(subject, settings)]
    notes = [
        f"{settings.rays} rays a sample; 16,384 samples in 8 runs spread over the scene; processor time; all tails in "
        f"turn, run by run, least of {REPEATS}",
        "change: of the samples' AO against a tail of 2^-20, largest over the distances; ratio: times as fast; "
        f"gate: greatest change at most the tail; the default is 1/{1 / BakeSettings().tail:.0f}",
        "without fog and trees: what dims a ray that nothing stops does so up to the ray's end, however far away",
    ]
    return Measurements("tail", rows, notes, seeds={"bake": settings.seed})


def tail_rows(subject: Subject, settings: BakeSettings) -> list[dict[str, Any]]:
    """One row a set of distances and tail."""
    rows: list[dict[str, Any]] = []
    for distances in DISTANCES:
        tallies: dict[str, Tally] = {}
        ways: dict[str, Callable[[slice], object]] = {}
        tracers: list[Tracer] = []
        reach: dict[str, float] = {}
        try:
            for tail in (_WHOLE, *TAILS):
                own = settings.replaced(distances=distances, tail=tail)
                tracer = create_tracer(subject.world, own, Device("cpu", "CPU"), fog=subject.fog)
                tracers.append(tracer)
                name = f"1/{1 / tail:.0f}"
                tallies[name], reach[name] = Tally.empty(len(subject.samples), len(distances)), own.trace_distance
                ways[name] = _way(tracer, subject, tallies[name])
                for run in subject.runs:  # kernels are loaded before the clock starts
                    ways[name](run)
            seconds = processor_seconds(ways, subject.runs)
        finally:
            for tracer in tracers:
                tracer.close()
        whole, *cut = ways
        rays = len(subject.samples) * settings.rays
        for name in cut:
            change = np.abs(tallies[name].ao.astype(np.float64) - tallies[whole].ao)
            bound = 1.0 / float(name.removeprefix("1/"))
            rows.append(
                {
                    "scene": subject.name, "distances m": ", ".join(f"{d:g}" for d in distances), "tail": name,
                    "rays end at m": reach[name], **rate(rays, seconds[name]), "ratio": seconds[whole] / seconds[name],
                    "mean change": float(change.mean(axis=0).max()), "greatest change": float(change.max()),
                    "of the bound": float(change.max()) / bound, "passed": bool(change.max() <= bound + 1e-6),
                }
            )  # fmt: skip
    return rows


def _way(tracer: Tracer, subject: Subject, tally: Tally) -> Callable[[slice], object]:
    return lambda run: tracer.accumulate(subject.samples, run, tally)
