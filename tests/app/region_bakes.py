"""The small level baked with four regions around and in its room."""

from __future__ import annotations

import json
from pathlib import Path

from bake.pipeline import BakeRequest, run_bake

OPTIONS = {"rays": 16, "samples-per-face": "1:2", "tracer": "embree", "device": "cpu", "region-directions": 64}


def write_regions(folder: Path) -> Path:
    """Writes the region file; returns its path."""
    boxes = {
        "west": ((-5.0, -0.6, -5.0), (-1.4, 3.0, 5.0)),
        "room": ((-1.5, 0.1, -1.5), (1.5, 1.9, 1.5)),
        "north": ((-1.5, 0.2, -5.0), (5.0, 3.0, -1.4)),
        "east": ((1.4, 0.2, -1.5), (5.0, 3.0, 5.0)),
    }
    regions = [{"name": name, "min": low, "max": high} for name, (low, high) in boxes.items()]
    path = folder / "regions.json"
    path.write_text(json.dumps({"regions": regions}))
    return path


def bake_with_regions(scene: Path, folder: Path) -> Path:
    """Bakes the level with its regions; returns the result folder."""
    options = {**OPTIONS, "regions": str(write_regions(folder))}
    result = folder / "result"
    for _ in run_bake(BakeRequest(scene, result, options)):
        pass
    return result
