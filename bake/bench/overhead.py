"""What a whole bake costs beyond its rays: end to end against the bare tracer on the same rays in the same run."""

from __future__ import annotations

import importlib
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.isolation import isolated
from bake.bench.synthetic import field_with_props, write_ply
from bake.bench.table import Measurements
from bake.devices import worker_count
from bake.geometry import as_traced
from bake.pipeline import BakeRequest, run_bake
from bake.results import load_result
from bake.trace.brute import sample_rays
from bake.types import BakeResult

RATIO_GATE = 0.75
MEMORY_GATE_MB = 6000.0
_CHUNK_RAYS = 1 << 18
_CHUNKS = 32
_FIELDS = {"field of 1.0 M": 670, "field of 1.8 M": 922}  # cells along an edge


def measure_overhead(scenes: Sequence[Path], options: Mapping[str, Any]) -> Measurements:
    """Bakes scenes from load to stored result and divides their rays per second by the bare tracer's.

    The bare tracer is Embree through its own Python interface, robust like ours, on prepared arrays of rays and on as
    many threads; it traces the bake's own rays, in chunks spread evenly over the samples, and nothing else.

    Args:
        scenes: Scene files; without any, rolling fields with props of 1.0 and 1.8 million triangles are made.
        options: Bake options by long name.
    """
    on_embree = {**options, "device": "cpu", "tracer": "embree"}
    with tempfile.TemporaryDirectory() as folder:
        made = [] if scenes else [_made(Path(folder), name, cells) for name, cells in _FIELDS.items()]
        rows = [_row(scene, on_embree) for scene in (scenes or made)]
    notes = [
        f"gates: ratio at least {RATIO_GATE}, peak memory of the bake's process under {MEMORY_GATE_MB:,.0f} MB",
        f"bare tracer: {_CHUNKS} chunks of {_CHUNK_RAYS:,} of the bake's rays, median of 3",
    ]
    return Measurements("overhead", rows, notes)


def _made(folder: Path, name: str, cells: int) -> Path:
    path = folder / f"{name}.ply"
    write_ply(path, field_with_props(cells, subdivisions=2))
    return path


def _row(scene: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        row = isolated(bake_timed, scene, Path(folder) / "result", options)
        if "refused" in row:
            return row
        bare = _bare_rays_per_s(load_result(Path(folder) / "result"))
    ratio = row["Mrays/s end to end"] * 1e6 / bare
    passed = ratio >= RATIO_GATE and row["peak memory MB"] < MEMORY_GATE_MB
    return {**row, "Mrays/s bare tracer": bare / 1e6, "ratio": ratio, "passed": passed}


def bake_timed(scene: Path, result_path: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Bakes a scene and tells how fast each part was."""
    work = run_bake(BakeRequest(scene, result_path, options))
    while True:
        try:
            next(work)
        except StopIteration as done:
            result, seconds = done.value.result, done.value.seconds
            break
    rays = int(result.tally.rays.astype(np.int64).sum())
    spent = {row.name: row.seconds for row in result.stages}
    return {
        "scene": scene.stem,
        "triangles": result.world.face_count,
        "samples": len(result.samples),
        "Mrays": rays / 1e6,
        "seconds": seconds,
        "of which load": spent["process geometry"] + spent["flatten"] + spent["sample surface"],
        "BVH": spent["build BVH"],
        "trace": spent["trace"],
        "solve": spent["map to vertices"],
        "peak memory MB": max(row.peak_memory_mb for row in result.stages),
        "Mrays/s end to end": rays / seconds / 1e6,
        "Mrays/s trace": rays / spent["trace"] / 1e6,
    }


def _bare_rays_per_s(result: BakeResult) -> float:
    embree: Any = importlib.import_module("embreex.rtcore_scene")
    meshes: Any = importlib.import_module("embreex.mesh_construction")
    world, samples, rays = result.world, result.samples, result.settings.rays
    scene = embree.EmbreeScene(robust=True)
    meshes.TriangleMesh(scene, as_traced(world.positions), np.ascontiguousarray(world.faces[world.face_casts]))
    size = max(1, _CHUNK_RAYS // rays)
    firsts = np.linspace(0, max(0, len(samples) - size), _CHUNKS).astype(int).tolist()
    prepared = [sample_rays(world, samples, slice(a, min(a + size, len(samples))), rays) for a in firsts]
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
