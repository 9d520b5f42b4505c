"""Does the order pay in which samples and rays are traced? Random, as placed, along a curve; alone and in packets."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bake.arrays import Float32Array, Int64Array
from bake.bench.scaling_device import has_embree
from bake.bench.table import Measurements
from bake.bench.trace_runs import REPEATS, Subject, processor_seconds, rate, subjects
from bake.geometry import as_traced
from bake.settings import BakeSettings, TracerKind
from bake.trace.brute import drawn_rays, sample_rays
from bake.types import SampleSet, Tally

_PRESENT = "one by one, in the sequence's order"
_GROUPINGS = {
    _PRESENT: (False, False),
    "one by one, sorted by direction": (True, False),
    "in packets of 16 neighbours": (True, True),
}
"""Whether sixteen samples are traced at a time, and whether in packets."""


def measure_order(scenes: Sequence[Path], options: Mapping[str, Any]) -> Measurements:
    """Processor time a ray with Embree for orders of samples and of rays; all find the same bits.

    Args:
        scenes: Scene files; a rolling field of a million triangles comes last.
        options: Bake options by long name.
    """
    if not has_embree():
        skipped = {"skipped": "Embree is not installed; the package embreex brings it"}
        return Measurements("order", [skipped], seeds={})
    settings = BakeSettings.from_options({**options, "device": "cpu", "tracer": TracerKind.EMBREE.value})
    rows = [row for subject in subjects(scenes, settings) for row in order_rows(subject, settings)]
    return Measurements("order", rows, _notes(settings), seeds={"bake": settings.seed})


def order_rows(subject: Subject, settings: BakeSettings) -> list[dict[str, Any]]:
    """One row an order; `ratio` is how many times as fast as samples as placed and rays one by one."""
    from bake.trace.embree import TracerEmbree

    samples, count = subject.samples, len(subject.samples)
    orders = {
        "as placed": np.arange(count, dtype=np.int64),
        "along a Morton curve": morton_order(subject, settings),
        "random": np.random.default_rng(1).permutation(count),
    }
    found: dict[tuple[str, str], Tally] = {}
    ways: dict[str, Callable[[slice], object]] = {}
    with TracerEmbree(subject.world, settings, subject.fog) as tracer:

        def way(ordered: SampleSet, tally: Tally, grouped: bool, packets: bool) -> Callable[[slice], object]:
            def trace(run: slice) -> None:
                tracer.grouped, tracer.packets = grouped, packets
                tracer.accumulate(ordered, run, tally)

            return trace

        for order, rows in orders.items():
            ordered = samples.only(rows)
            for grouping, how in _GROUPINGS.items():
                tally = found[order, grouping] = Tally.empty(count, settings.distance_count)
                ways[f"{order} · {grouping}"] = way(ordered, tally, *how)
        bare = _bare(subject, settings)
        seconds = processor_seconds({**ways, "bare": bare}, subject.runs)
    base, rays = seconds[f"as placed · {_PRESENT}"], count * settings.rays
    expected = found["as placed", _PRESENT]
    table: list[dict[str, Any]] = []
    for order, grouping in ((o, g) for o in orders for g in _GROUPINGS):
        taken, tally = seconds[f"{order} · {grouping}"], found[order, grouping]
        same = all(
            np.array_equal(a, b[orders[order]])
            for a, b in ((tally.ao, expected.ao), (tally.hits, expected.hits), (tally.back_faces, expected.back_faces))
        )
        table.append(
            {"scene": subject.name, "samples": order, "rays": grouping, **rate(rays, taken), "ratio": base / taken,
             "same bits": same, "passed": same}
        )  # fmt: skip
    taken = seconds["bare"]
    table.append(
        {"scene": subject.name, "samples": "as placed", "rays": "bare tracer", **rate(rays, taken),
         "ratio": base / taken}
    )  # fmt: skip
    return table


def morton_order(subject: Subject, settings: BakeSettings) -> Int64Array:
    """Samples by 1024³ cells of their bounding box along Morton's curve, in a cell by the octant of their normal."""
    drawn = drawn_rays(subject.world, subject.samples, slice(0, len(subject.samples)), 1)
    origins, normals = drawn.origins, drawn.face_normals
    extent = max(float((origins.max(axis=0) - origins.min(axis=0)).max()), 1e-9)
    cells = ((origins - origins.min(axis=0)) / extent * 1023.0).astype(np.int64)
    curve = np.zeros(len(cells), np.int64)
    for bit in range(10):
        for axis in range(3):
            curve |= (cells[:, axis] >> bit & 1) << (3 * bit + axis)
    return np.lexsort(((normals > 0.0) @ np.array([1, 2, 4]), curve))


def _bare(subject: Subject, settings: BakeSettings) -> Callable[[slice], object]:
    """Embree through its own Python interface, on the same rays, which are made before."""
    library: Any = importlib.import_module("embreex.rtcore_scene")
    meshes: Any = importlib.import_module("embreex.mesh_construction")
    world = subject.world
    scene = library.EmbreeScene(robust=True)
    meshes.TriangleMesh(scene, as_traced(world.positions), np.ascontiguousarray(world.faces[world.face_casts]))
    made: dict[int, tuple[Float32Array, Float32Array]] = {}
    for run in subject.runs:
        origins, directions, _ = sample_rays(world, subject.samples, run, settings.rays)
        made[run.start] = origins.astype(np.float32), directions.astype(np.float32)
    reach = np.full(max(len(o) for o, _ in made.values()), min(settings.trace_distance, 1e30), np.float32)

    def trace(run: slice) -> None:
        origins, directions = made[run.start]
        scene.run(origins, directions, dists=reach[: len(origins)].copy(), output=1)  # it writes the hits into them

    return trace


def _notes(settings: BakeSettings) -> list[str]:
    return [
        f"{settings.rays} rays a sample; 16,384 samples in 8 runs spread over the scene; processor time, so that other "
        f"programs are not counted; all orders in turn, run by run, least of {REPEATS}",
        "random and Morton: the samples of all runs mixed; the latter by position, then by the octant of the normal",
        "ratio: times as fast as rays one by one, samples as placed; same bits: of AO, hits and back faces",
        "bare tracer: Embree through its own Python interface, rays made before, closest hits alone, not weighed",
    ]
