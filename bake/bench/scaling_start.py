"""How long a bake takes to start: with no kernel compiled yet, with all of them in the cache, and once it runs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bake.bench.scaling_device import runnable
from bake.bench.scaling_glb import Placed, write_scene
from bake.bench.synthetic import cube
from bake.bench.table import Measurements
from bake.errors import DeviceError

_ROOT = Path(__file__).resolve().parents[2]


def measure_start(options: Mapping[str, Any]) -> Measurements:
    """Two fresh processes that each bake a lone cube twice: the first with an empty cache of kernels.

    Args:
        options: Bake options by long name.

    Raises:
        DeviceError: such a process failed.
    """
    options, _ = runnable(options)
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scene = write_scene(folder / "cube.glb", {"cube": cube()}, [Placed("cube", "cube")])
        for start in ("cold", "warm"):
            begin = time.perf_counter()
            seconds = _process(scene, folder / start, folder / "kernels", options)
            rows.append({"start": start, **seconds, "process s": time.perf_counter() - begin})
    notes = [
        "a lone cube, from its file to the stored result, twice in one process; cold: the cache of compiled kernels is "
        "empty, warm: as the cold process left it; files of libraries lie in the system's cache both times",
    ]
    return Measurements("start", rows, notes, seeds={"bake": int(options.get("seed", 1))})


def _process(scene: Path, results: Path, kernels: Path, options: Mapping[str, Any]) -> dict[str, float]:
    results.mkdir()
    request = {"scene": str(scene), "folder": str(results), "options": dict(options)}
    done = subprocess.run(
        [sys.executable, "-m", "bake.bench.scaling_first"],
        input=json.dumps(request),
        capture_output=True,
        text=True,
        cwd=_ROOT,
        env={**os.environ, "WARP_CACHE_PATH": str(kernels)},
        check=False,
    )
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise DeviceError(f"the process that was to bake failed ({last})", where="bench speed", remedy="try bake first")
    return json.loads(done.stdout)
