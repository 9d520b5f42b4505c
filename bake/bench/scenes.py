"""Bakes whole folders of scenes, each in a process of its own, and tables what came of it."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.isolation import isolated
from bake.bench.table import Measurements, bake_seed
from bake.errors import ObscuraError
from bake.pipeline import BakeRequest, run_bake
from bake.types import BakeResult, VertexState

SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".usd", ".usda", ".usdc", ".usdz")


def measure_scenes(paths: Iterable[Path], options: Mapping[str, Any]) -> Measurements:
    """One row a scene: what it holds, what the bake found, and what it cost; or why it was refused.

    Args:
        paths: Scene files, or folders that are searched for them.
        options: Bake options by long name.
    """
    rows = [isolated(bake_row, scene, options) for scene in find_scenes(paths)]
    notes = ["seconds: from the file to the stored result, in a fresh process"]
    return Measurements("scenes", rows, notes, seeds={"bake": bake_seed(options)})


def find_scenes(paths: Iterable[Path]) -> list[Path]:
    """The scene files among and below `paths`, sorted."""
    found: set[Path] = set()
    for path in paths:
        found.update([path] if path.is_file() else (p for p in path.rglob("*") if p.suffix.lower() in SUFFIXES))
    return sorted(found)


def bake_row(scene: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Bakes one scene into a temporary folder; any error outside the error tree fails the row."""
    with tempfile.TemporaryDirectory() as folder:
        work = run_bake(BakeRequest(scene, Path(folder) / "result", options))
        try:
            while True:
                next(work)
        except StopIteration as done:
            return {"scene": _short(scene), **_figures(done.value.result, done.value.seconds)}
        except ObscuraError as error:
            return {"scene": _short(scene), "refused": str(error).replace(str(scene.parent), "…")}
        except Exception as error:  # noqa: BLE001  # a crash is a result of this benchmark, not its end
            return {"scene": _short(scene), "refused": f"{type(error).__name__}: {error}", "passed": False}


def _short(scene: Path) -> str:
    """The file with its folder: names alone repeat."""
    return f"{scene.parent.name}/{scene.name}"


def _figures(result: BakeResult, seconds: float) -> dict[str, Any]:
    tally, state = result.tally, result.field.state
    trace = next(row for row in result.stages if row.name == "trace")
    valid = tally.valid(result.settings.back_face_threshold)
    rays = int(tally.rays.astype(np.int64).sum())
    return {
        "faces": result.world.face_count,
        "samples": len(result.samples),
        "Mrays": rays / 1e6,
        "invalid %": 100.0 * float(np.mean(~valid)),
        "filled vertices": int((state == VertexState.FILLED).sum()),
        "iterations": result.field.report.iterations,
        "seconds": seconds,
        "Mrays/s": rays / max(trace.seconds, 1e-9) / 1e6,
        "peak memory MB": max(row.peak_memory_mb for row in result.stages),
    }
