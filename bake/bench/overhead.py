"""What a whole bake costs beyond its rays: end to end against the bare tracer on the same rays in the same run."""

from __future__ import annotations

import importlib
import tempfile
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.synthetic import field_with_props, write_ply
from bake.bench.table import Measurements
from bake.devices import worker_count
from bake.geometry import as_traced
from bake.pipeline import BakeRequest, run_bake
from bake.trace.brute import sample_rays
from bake.types import BakeResult

_CHUNK_RAYS = 1 << 18
_GATE = 0.75


def measure_overhead(scene: Path | None, options: Mapping[str, Any], *, chunks: int = 32) -> Measurements:
    """Bakes a scene from load to stored result and divides its rays per second by the bare tracer's.

    The bare tracer is Embree through its own Python interface, robust like ours, on prepared arrays of rays and on as
    many threads; it traces the bake's own rays, in chunks spread evenly over the samples, and nothing else.

    Args:
        scene: A scene file; without one, a field with props of about a million triangles is made.
        options: Bake options by long name.
        chunks: Chunks of a quarter of a million rays that the bare tracer is timed on.
    """
    with tempfile.TemporaryDirectory() as folder:
        if scene is None:
            scene = Path(folder) / "field.ply"
            write_ply(scene, field_with_props(670, subdivisions=2))
        on_embree = {**options, "device": "cpu", "tracer": "embree"}
        result, seconds = _bake(BakeRequest(scene, Path(folder) / "result", on_embree))
        bare = _bare_rays_per_s(result, chunks)
    traced = int(result.tally.rays.astype(np.int64).sum())
    whole = traced / seconds
    trace_row = next(row for row in result.stages if row.name == "trace")
    row = {
        "scene": scene.name,
        "triangles": result.world.face_count,
        "samples": len(result.samples),
        "rays": traced,
        "seconds end to end": seconds,
        "Mrays/s end to end": whole / 1e6,
        "Mrays/s trace stage": traced / trace_row.seconds / 1e6,
        "Mrays/s bare tracer": bare / 1e6,
        "ratio": whole / bare,
        "peak memory MB": max(stage.peak_memory_mb for stage in result.stages),
        "passed": whole / bare >= _GATE,
    }
    stages = ", ".join(f"{row.name} {row.seconds:.1f} s" for row in result.stages if row.status == "ran")
    return Measurements("overhead", [row], [f"gate: ratio at least {_GATE}", f"stages: {stages}"])


def _bake(request: BakeRequest) -> tuple[BakeResult, float]:
    work = run_bake(request)
    while True:
        try:
            next(work)
        except StopIteration as done:
            return done.value.result, done.value.seconds


def _bare_rays_per_s(result: BakeResult, chunks: int) -> float:
    embree: Any = importlib.import_module("embreex.rtcore_scene")
    meshes: Any = importlib.import_module("embreex.mesh_construction")
    world, samples, rays = result.world, result.samples, result.settings.rays
    scene = embree.EmbreeScene(robust=True)
    meshes.TriangleMesh(scene, as_traced(world.positions), world.faces[world.face_casts])
    size = max(1, _CHUNK_RAYS // rays)
    firsts = np.linspace(0, max(0, len(samples) - size), chunks).astype(int)
    prepared = [sample_rays(world, samples, slice(int(a), min(int(a) + size, len(samples))), rays) for a in firsts]
    arrays = [(o.astype(np.float32), d.astype(np.float32)) for o, d, _ in prepared]

    def trace(pair: tuple[Any, Any]) -> None:
        scene.run(pair[0], pair[1], output=1)

    with ThreadPoolExecutor(worker_count()) as pool:
        list(pool.map(trace, arrays[: worker_count()]))  # build and warm up
        seconds = _median(lambda: list(pool.map(trace, arrays)))
    return sum(len(o) for o, _ in arrays) / seconds


def _median(work: Callable[[], object], repeats: int = 3) -> float:
    """Median seconds of a few runs."""
    times: list[float] = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return sorted(times)[repeats // 2]
