"""What a benchmark of speed can run on here: a machine may lack CUDA, Embree, or both."""

from __future__ import annotations

import importlib.util
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bake.bench.scaling_glb import Placed, write_scene
from bake.bench.synthetic import cube
from bake.devices import Device, resolve
from bake.pipeline import BakeOutcome, BakeRequest, run_bake


def runnable(options: Mapping[str, Any]) -> tuple[dict[str, Any], Device]:
    """The options with a tracer that this machine has, and the device that they mean.

    On the CPU that is Embree where it is installed, and else Warp, unless the options name one.
    """
    device = resolve(str(options.get("device", "auto")))
    found = dict(options)
    if not device.is_cuda and not has_embree() and str(found.get("tracer", "auto")) == "auto":
        found["tracer"] = "warp"
    return found, device


def has_embree() -> bool:
    """Whether Embree is installed."""
    return importlib.util.find_spec("embreex") is not None


def run_to_end(scene: Path, result: Path, options: Mapping[str, Any]) -> BakeOutcome:
    """Bakes a scene from its file to the stored result."""
    work = run_bake(BakeRequest(scene, result, options))
    while True:
        try:
            next(work)
        except StopIteration as done:
            return done.value


def warm_up(options: Mapping[str, Any]) -> None:
    """Loads libraries and kernels by a bake of a lone cube: what is timed afterwards is the scene's own work."""
    with tempfile.TemporaryDirectory(prefix="obscura-warm-") as folder:
        scene = write_scene(Path(folder) / "cube.glb", {"cube": cube()}, [Placed("cube", "cube")])
        run_to_end(scene, Path(folder) / "result", options)
