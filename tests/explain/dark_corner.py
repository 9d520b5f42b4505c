"""The dark corner of the sample level by itself: small enough to bake in a test."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

from bake.devices import resolve
from bake.pipeline import bake
from bake.scene import load_scene
from bake.settings import BakeSettings
from bake.stages import StageClock
from bake.types import BakeResult, Scene

FOLDER = Path(__file__).resolve().parents[2] / "assets" / "sample_level"
SETTINGS = BakeSettings(rays=16, device="cpu")


def dark_corner() -> Scene:
    """The sample level without all but the dark corner."""
    scene = load_scene(FOLDER / "level.glb")
    kept = tuple(item for item in scene.objects if "/DarkCorner/" in item.path)
    return dataclasses.replace(scene, objects=kept, regions=())


def baked(scene: Scene, settings: BakeSettings = SETTINGS) -> BakeResult:
    """A bake of a scene in memory."""
    work = bake(scene, settings, resolve("cpu"), StageClock())
    while True:
        try:
            next(work)
        except StopIteration as done:
            return done.value


def planted_spots() -> list[dict[str, Any]]:
    """The planted dark spots."""
    return json.loads((FOLDER / "planted.json").read_text())["spots"]
