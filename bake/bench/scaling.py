"""How each stage's time and the memory grow with the scene: rolling fields by triangles, and copies of one ball."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bake.arrays import Float64Array
from bake.bench.isolation import isolated
from bake.bench.scaling_device import runnable, warm_up
from bake.bench.scaling_scenes import SEED, write_field, write_instances
from bake.bench.table import Measurements, Row
from bake.pipeline import BakeOutcome, BakeRequest, run_bake

EXPONENT_GATE = 1.2
PLAIN = {"rays": 16, "samples-per-face": "4:4"}
"""Unless the options say otherwise: as many samples on every face, so that the work is in proportion to the triangles,
and few rays, so that ten million triangles take minutes."""

STAGES = {
    "load s": "process geometry",
    "flatten s": "flatten",
    "samples s": "sample surface",
    "BVH s": "build BVH",
    "trace s": "trace",
    "solve s": "map to vertices",
}
STORE, TOTAL = "store s", "total s"
COUNTS = (1, 10, 100, 316, 1_000, 3_162, 10_000)

_LEAST_S = 0.02
_BESIDE = "a stage's seconds are its own, and some work goes on beside other stages, so that they may add up to more"


def scales(largest: int) -> tuple[int, ...]:
    """Triangles of the fields: half powers of ten from ten thousand up to `largest`, and `largest` itself."""
    powers = [round(10**4 * 10 ** (i / 2)) for i in range(16)]
    return (*(size for size in powers if size < largest), largest)


def measure_scaling(
    options: Mapping[str, Any], *, largest: int = 1_000_000, counts: Sequence[int] = COUNTS
) -> tuple[Measurements, Measurements, Measurements]:
    """Bakes fields and copies from load to stored result, a fresh process each; fits how each stage grows.

    Args:
        options: Bake options by long name.
        largest: Triangles of the largest field.
        counts: Numbers of copies.

    Returns:
        Seconds by triangles, seconds by copies, and the exponents of both.
    """
    options, _ = runnable({**PLAIN, **options})
    with tempfile.TemporaryDirectory() as folder:
        fields = [_measured(write_field, Path(folder) / f"{n}.glb", n, options) for n in scales(largest)]
        copies = [_measured(write_instances, Path(folder) / f"{n} copies.glb", n, options) for n in counts]
    seeds = {"scene": SEED, "bake": int(options.get("seed", 1))}
    how = (
        f"{options['rays']} rays a sample, {options['samples-per-face']} samples a face; each in a fresh process in "
        f"which a lone cube was baked before; {_BESIDE}"
    )
    notes = [how, f"{STORE}: writing the result; peak memory is the process's"]
    by_triangles = Measurements("speed by triangles", fields, notes, seeds=seeds)
    by_copies = Measurements("speed by copies", copies, [how], seeds=seeds)
    exponents = [
        *exponent_rows(fields, "triangles", EXPONENT_GATE),
        *exponent_rows([row for row in copies if row.get("objects", 0) >= 100], "objects", EXPONENT_GATE),
    ]
    told = [
        "seconds ~ size^exponent, least squares on logarithms of both over the sizes at which the stage took "
        f"{_LEAST_S:g} s or more, and of the last two of them; a stage that has fewer than two is left out",
        f"gate: fitted exponent at most {EXPONENT_GATE:g}",
    ]
    return by_triangles, by_copies, Measurements("growth", exponents, told, seeds=seeds)


def measure_largest(options: Mapping[str, Any], *, largest: int) -> tuple[Measurements, Measurements]:
    """One field and one of a tenth of it alone, so that a size that takes minutes can be baked in a run of its own.

    Returns:
        Seconds of both, and the exponents between them.
    """
    options, _ = runnable({**PLAIN, **options})
    sizes = (max(largest // 10, 1_000), largest)
    with tempfile.TemporaryDirectory() as folder:
        rows = [_measured(write_field, Path(folder) / f"{n}.glb", n, options) for n in sizes]
    how = f"{options['rays']} rays a sample, {options['samples-per-face']} samples a face; {_BESIDE}"
    seeds = {"scene": SEED, "bake": int(options.get("seed", 1))}
    exponents = exponent_rows([row for row in rows if "triangles" in row], "triangles", EXPONENT_GATE)
    told = [f"seconds ~ size^exponent between the two; gate: at most {EXPONENT_GATE:g}"]
    return (
        Measurements("largest field", rows, [how], seeds=seeds),
        Measurements("growth to the largest", exponents, told, seeds=seeds),
    )


def exponent_rows(rows: Sequence[Row], size: str, gate: float) -> list[dict[str, Any]]:
    """One row a stage: the exponent with which its seconds grow with the column `size`."""
    found: list[dict[str, Any]] = []
    for stage in (*STAGES, STORE, TOTAL):
        pairs = [(float(row[size]), float(row[stage])) for row in rows if row.get(stage, 0.0) >= _LEAST_S]
        if len(pairs) < 2:
            continue
        logarithms: Float64Array = np.log(np.array(pairs))
        x, y = logarithms[:, 0], logarithms[:, 1]
        slope = float(np.polyfit(x, y, 1)[0])
        last = float((y[-1] - y[-2]) / (x[-1] - x[-2]))
        over = f"{pairs[0][0]:,.0f} to {pairs[-1][0]:,.0f}"
        found.append(
            {
                "by": size, "stage": stage.removesuffix(" s"), "exponent": slope, "last step": last, "from … to": over,
                "passed": slope <= gate,
            }
        )  # fmt: skip
    return found


def _measured(write: Callable[[Path, int], Path], path: Path, count: int, options: Mapping[str, Any]) -> dict[str, Any]:
    row = isolated(bake_by_stage, write(path, count), options)
    path.unlink()
    return row


def _run(scene: Path, result: Path, options: Mapping[str, Any]) -> tuple[BakeOutcome, float]:
    """A whole bake, and the seconds that storing took at its end."""
    work = run_bake(BakeRequest(scene, result, options))
    storing = time.perf_counter()
    while True:
        try:
            progress = next(work)
        except StopIteration as done:
            return done.value, time.perf_counter() - storing
        if progress.stage == "store":
            storing = time.perf_counter()


def bake_by_stage(scene: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Bakes a scene from its file to the stored result: counts, seconds by stage, rays per second and peak memory."""
    warm_up(options)
    with tempfile.TemporaryDirectory() as folder:
        outcome, stored = _run(scene, Path(folder) / "result", options)
    result = outcome.result
    spent = {row.name: row.seconds for row in result.stages}
    rays = int(result.tally.rays.astype(np.int64).sum())
    return {
        "triangles": result.world.face_count,
        "objects": result.world.object_count,
        "samples": len(result.samples),
        "Mrays": rays / 1e6,
        **{key: spent[name] for key, name in STAGES.items()},
        STORE: stored,
        TOTAL: outcome.seconds,
        "Mrays/s trace": rays / spent["trace"] / 1e6,
        "Mrays/s end to end": rays / outcome.seconds / 1e6,
        "peak memory MB": max(row.peak_memory_mb for row in result.stages),
        "tracer": f"{result.tracer} on {result.device}",
    }
