"""What the regions bench traced, kept in a file so that models and walks can be measured again without it."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from bake.region_types import RegionGraph, RegionPoints
from bake.settings import BakeSettings
from bake.walk import PathTruth, WalkPath

_FREE = ("region_beta", "region_sweeps", "region_tolerance", "region_smallest", "optimise_centre", "device")
"""Settings that may differ: they change models, not what was traced."""


@dataclass(frozen=True, slots=True)
class Traced:
    """What was traced of a scene.

    Attributes:
        graph, points: Its regions.
        path: The tour through them.
        truth: Along it.
        toured: Regions that the tour visits.
        coverage: Share of the walkable floor in the regions; NaN if they were stated.
        seconds: By stage, as measured when it was traced.
    """

    graph: RegionGraph
    points: RegionPoints
    path: WalkPath
    truth: PathTruth
    toured: int
    coverage: float
    seconds: dict[str, float]


_PARTS = {"graph": RegionGraph, "points": RegionPoints, "path": WalkPath, "truth": PathTruth}
_PLAIN = {"graph": ("names", "origin"), "truth": ("directions",)}


def kept_file(folder: Path, scene: Path, settings: BakeSettings) -> Path:
    """Where what was traced of a scene under some settings is kept: the name tells file and settings apart."""
    said = {item.name: str(getattr(settings, item.name)) for item in dataclasses.fields(settings)}
    asked = json.dumps({name: value for name, value in sorted(said.items()) if name not in _FREE})
    digest = hashlib.sha256(scene.read_bytes() + asked.encode()).hexdigest()
    return folder / f"{scene.stem}-{digest[:16]}.npz"


def keep(file: Path, traced: Traced) -> None:
    """Writes it."""
    arrays: dict[str, Any] = {}
    said: dict[str, Any] = {"toured": traced.toured, "coverage": traced.coverage, "seconds": traced.seconds}
    for part in _PARTS:
        value = getattr(traced, part)
        for item in dataclasses.fields(value):
            if item.name in _PLAIN.get(part, ()):
                said[f"{part}.{item.name}"] = getattr(value, item.name)
            else:
                arrays[f"{part}.{item.name}"] = getattr(value, item.name)
    file.parent.mkdir(parents=True, exist_ok=True)
    np.savez(file, said=np.array(json.dumps(said)), **arrays)


def kept(file: Path) -> Traced | None:
    """Reads it; None if it is not there."""
    if not file.exists():
        return None
    with np.load(file, allow_pickle=False) as stored:
        said = json.loads(str(stored["said"]))
        parts: dict[str, Any] = {}
        for part, kind in _PARTS.items():
            plain = _PLAIN.get(part, ())
            names = [item.name for item in dataclasses.fields(kind)]
            parts[part] = kind(
                **{
                    name: _tuple(said[f"{part}.{name}"]) if name in plain else stored[f"{part}.{name}"]
                    for name in names
                }
            )
    return Traced(**parts, toured=said["toured"], coverage=said["coverage"], seconds=said["seconds"])


def _tuple(value: Any) -> Any:
    return tuple(cast("list[Any]", value)) if isinstance(value, list) else value
