"""The benchmark of the window: how soon it is there, and how soon it answers."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from app.window_bench.start import TIMES_FILE
from bake.bench.large_level import write_large_level
from bake.bench.table import Measurements
from bake.errors import ObscuraError
from bake.pipeline import BakeRequest, run_bake
from bake.results import load_result
from bake.types import BakeResult

START_S, SLICE_MS = 4.0, 50.0
_STARTS = 5
_ROOT = Path(__file__).resolve().parents[2]
_CHEAP: Mapping[str, Any] = {"quality": "preview", "region-directions": "64"}


def measure_window(path: Path | None, options: Mapping[str, Any]) -> Iterator[Measurements]:
    """Three tables: starts, answers, and the longest slices of work in the window's thread.

    Args:
        path: A result, or a scene that is baked first; None for a level of a million triangles that it makes itself.
        options: Bake options by long name.

    Raises:
        InputError: the scene or the options cannot be used.
        ObscuraError: there is no display, or the window did not answer.
    """
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="obscura-bench-")))
        result = path if path is not None and path.is_dir() else baked(path, options, folder)
        loaded = load_result(result)
        about = about_result(loaded, path)
        starts = [_start(result, folder) for _ in range(_STARTS + 1)][
            1:
        ]  # the first one compiles modules and warms the disk's cache
        seeds = {"bake": loaded.settings.seed, "slides": 1, "places": 7}
        yield Measurements("window start", start_rows(starts), [about, *_START_NOTES], seeds=seeds)
        answers, slices = _drive(result, folder)
        yield Measurements("window answers", answers, [about, *_ANSWER_NOTES], seeds=seeds)
        yield Measurements("window slices", slices, [about, *_SLICE_NOTES], seeds=seeds)


_START_NOTES = (
    f"seconds from the start of the process, medians of {_STARTS}; drawing is subtracted and stands apart: what VTK "
    "draws, its shaders made, and the window put together and handed to the screen",
    f"gate: {START_S:g} s to the first picture of the level with its values",
)
_ANSWER_NOTES = (
    "medians from the input to the picture that shows the answer, work of other threads and of the engine process "
    "included; drawing is subtracted and stands apart",
)
_SLICE_NOTES = (
    "the longest event in the window's thread while something was done, drawing subtracted",
    f"gate: {SLICE_MS:g} ms",
)


def about_result(result: BakeResult, path: Path | None) -> str:
    """What a level is, in a line; without a path it is the benchmark's own."""
    world, regions = result.world, result.regions
    name = "the benchmark's own level" if path is None else path.name
    boxes = "" if regions is None else f", {len(regions.graph):,} regions"
    return (
        f"{name}: {world.face_count:,} triangles, {world.vertex_count:,} vertices, {world.object_count:,} objects, "
        f"{len(result.samples):,} samples of {result.settings.rays} rays{boxes}"
    )


def baked(path: Path | None, options: Mapping[str, Any], folder: Path) -> Path:
    """Bakes a scene, or the benchmark's own level; returns the result's folder."""
    wanted = dict(options)
    if path is None:
        path, regions = write_large_level(folder)
        wanted = {**_CHEAP, "regions": str(regions), **wanted}
    result = folder / "result"
    for _ in run_bake(BakeRequest(path, result, wanted)):
        pass
    return result


def _start(result: Path, folder: Path) -> dict[str, float]:
    file = folder / TIMES_FILE
    file.unlink(missing_ok=True)
    words = [sys.executable, "-m", "app.window_bench.start", str(result.resolve()), str(folder), str(time.time())]
    # With compiled modules, as an installer leaves them, even where the environment writes none.
    own = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environment = {**own, "PYTHONPYCACHEPREFIX": str(folder / "compiled")}
    done = subprocess.run(words, cwd=_ROOT, env=environment, capture_output=True, text=True, timeout=300)
    if not file.is_file():
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise ObscuraError(f"the window did not start: {last}", where="bench window", remedy="see that it opens")
    return json.loads(file.read_text())


def start_rows(starts: list[dict[str, float]]) -> list[dict[str, Any]]:
    """Medians of starts as `app.window_bench.start` times them, drawing subtracted."""
    rows: list[dict[str, Any]] = []
    names = {"window": "window, empty", "geometry": "window with the level", "picture": "the level with its values"}
    for key, what in names.items():
        drawing = np.array([start["drawing" if key == "picture" else f"{key} drawing"] for start in starts])
        own = float(np.median(np.array([start[key] for start in starts]) - drawing))
        row = {"what": what, "own s": own, "drawing s": float(np.median(drawing)), "times": len(starts)}
        rows.append({**row, "gate s": START_S, "passed": own <= START_S} if key == "picture" else row)
    imports = float(np.median([start["imports"] for start in starts]))
    return [{"what": "everything imported", "own s": imports, "drawing s": 0.0, "times": len(starts)}, *rows]


def _drive(result: Path, folder: Path) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    from app.style import styled
    from app.window_bench.driver import Driver
    from app.window_bench.slices import TimedApplication
    from app.window_bench.tasks import TASKS

    app = styled(TimedApplication())
    driver = Driver(app, result, folder)
    answers: list[dict[str, Any]] = []
    for name, task in TASKS:
        driver.phase(name, lambda task=task: answers.extend(task(driver)))
    driver.close()
    slices = [
        {
            "while": name,
            "own ms": 1000.0 * found[0].seconds,
            "drawing ms": 1000.0 * found[0].drawing,
            "event": found[0].what,
            "next ms": ", ".join(f"{1000.0 * item.seconds:.0f}" for item in found[1:]),
            "gate ms": SLICE_MS,
            "passed": 1000.0 * found[0].seconds <= SLICE_MS,
        }
        for name, found in driver.phases.items()
        if found
    ]
    return answers, slices
