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
from bake.bench.scaling_device import has_embree, run_to_end, warm_up
from bake.bench.scaling_glb import Placed, write_scene
from bake.bench.synthetic import field_with_props
from bake.bench.table import Measurements
from bake.devices import Device, initialised_warp, resolve, worker_count
from bake.geometry import as_traced
from bake.results import load_result
from bake.trace.brute import sample_rays
from bake.types import BakeResult, Float32Array, Int32Array

RATIO_GATE = 0.75
MEMORY_GATE_MB = 6000.0
_CHUNK_RAYS = 1 << 18
_CHUNKS = 32
_FIELDS = {"field of 1.0 M": 670, "field of 1.8 M": 922}  # cells along an edge


def measure_overhead(scenes: Sequence[Path], options: Mapping[str, Any]) -> Measurements:
    """Bakes scenes from load to stored result and divides their rays per second by the bare tracer's.

    The bare tracer is Embree through its own Python interface, robust like ours, on prepared arrays of rays and on as
    many threads; on CUDA Warp's own query, on arrays that lie on the card. It traces the bake's own rays, in chunks
    spread evenly over the samples, and nothing else.

    Args:
        scenes: Scene files; without any, rolling fields with props of 1.0 and 1.8 million triangles are made.
        options: Bake options by long name.
    """
    device = resolve(str(options.get("device", "auto")))
    if not device.is_cuda and not has_embree():
        skipped = "neither a CUDA device nor Embree here; the package embreex brings the latter"
        return Measurements("overhead", [{"skipped": skipped}], seeds={"bake": int(options.get("seed", 1))})
    fixed = {**options, "device": device.alias, "tracer": "warp" if device.is_cuda else "embree"}
    with tempfile.TemporaryDirectory() as folder:
        made = [] if scenes else [_made(Path(folder), name, cells) for name, cells in _FIELDS.items()]
        rows = [_row(scene, fixed, device) for scene in (scenes or made)]
    notes = [
        f"gates: ratio at least {RATIO_GATE}, peak memory of the bake's process under {MEMORY_GATE_MB:,.0f} MB",
        f"bare tracer: {'Warp on ' + device.name if device.is_cuda else 'Embree'}, {_CHUNKS} chunks of "
        f"{_CHUNK_RAYS:,} of the bake's rays, median of 3",
    ]
    return Measurements("overhead", rows, notes, seeds={"scene": 1, "bake": int(options.get("seed", 1))})


def _made(folder: Path, name: str, cells: int) -> Path:
    geometry = field_with_props(cells, subdivisions=2)
    return write_scene(folder / f"{name}.glb", {name: geometry}, [Placed(name, name)])


def _row(scene: Path, options: Mapping[str, Any], device: Device) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        row = isolated(bake_timed, scene, Path(folder) / "result", options)
        if "refused" in row:
            return row
        result = load_result(Path(folder) / "result")
        bare = bare_rays_per_s_warp(result, device) if device.is_cuda else _bare_rays_per_s(result)
    ratio = row["Mrays/s end to end"] * 1e6 / bare
    passed = ratio >= RATIO_GATE and row["peak memory MB"] < MEMORY_GATE_MB
    return {**row, "Mrays/s bare tracer": bare / 1e6, "ratio": ratio, "passed": passed}


def bake_timed(scene: Path, result_path: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Bakes a scene and tells how fast each part was."""
    warm_up(options)
    outcome = run_to_end(scene, result_path, options)
    result, seconds = outcome.result, outcome.seconds
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
    scene = embree.EmbreeScene(robust=True)
    meshes.TriangleMesh(scene, as_traced(result.world.positions), blockers(result))
    arrays = ray_chunks(result)

    def trace(pair: tuple[Any, Any]) -> None:
        scene.run(pair[0], pair[1], output=1)

    with ThreadPoolExecutor(worker_count()) as pool:
        list(pool.map(trace, arrays[: worker_count()]))  # build and warm up
        seconds = median_seconds(lambda: list(pool.map(trace, arrays)))
    return sum(len(o) for o, _ in arrays) / seconds


def bare_rays_per_s_warp(result: BakeResult, device: Device) -> float:
    """Rays per second of Warp's own query on the bake's rays, which lie on the device already."""
    wp = initialised_warp()
    kernel: Any = importlib.import_module("bake.kernels.limits").bare_query
    points = wp.array(as_traced(result.world.positions), dtype=wp.vec3, device=device.alias)
    mesh = wp.Mesh(points=points, indices=wp.array(blockers(result).ravel(), dtype=wp.int32, device=device.alias))
    arrays = [tuple(wp.array(a, dtype=wp.vec3, device=device.alias) for a in pair) for pair in ray_chunks(result)]
    distance = wp.zeros(max(len(o) for o, _ in arrays), dtype=wp.float32, device=device.alias)
    t_max = min(result.settings.trace_distance, 1e30)

    def trace() -> None:
        for origins, directions in arrays:
            inputs = [mesh.id, origins, directions, t_max, distance]
            wp.launch(kernel, dim=len(origins), inputs=inputs, device=device.alias)
        wp.synchronize_device(device.alias)

    trace()  # compiles
    return sum(len(o) for o, _ in arrays) / median_seconds(trace)


def blockers(result: BakeResult) -> Int32Array:
    """The faces that stop rays, shape (m, 3)."""
    return np.ascontiguousarray(result.world.faces[result.world.face_casts])


def ray_chunks(result: BakeResult) -> list[tuple[Float32Array, Float32Array]]:
    """Origins and directions of some of the bake's rays, shape (n, 3) each, in chunks spread over its samples."""
    world, samples, rays = result.world, result.samples, result.settings.rays
    size = max(1, _CHUNK_RAYS // rays)
    firsts = np.linspace(0, max(0, len(samples) - size), _CHUNKS).astype(int).tolist()
    prepared = [sample_rays(world, samples, slice(a, min(a + size, len(samples))), rays) for a in firsts]
    return [(o.astype(np.float32), d.astype(np.float32)) for o, d, _ in prepared]


def median_seconds(work: Callable[[], object], repeats: int = 3) -> float:
    """Median seconds of a few runs."""
    times: list[float] = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return sorted(times)[repeats // 2]
