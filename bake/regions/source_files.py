"""The region file that a bake reads besides its scene."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from bake.regions.graph import regions_asked_for
from bake.regions.region_file import read_region_file
from bake.settings import BakeSettings
from bake.types import Scene


def region_files(scene: Scene, settings: BakeSettings) -> dict[str, str]:
    """The file of regions, if the settings name one, with its SHA-256, as `Scene.files` lists those of a scene.

    Raises:
        SceneError: it cannot be used.
    """
    source = regions_asked_for(scene, settings)
    if source in ("", "automatic", "scene") or "regions" in settings.skip:
        return {}
    path = Path(source)
    read_region_file(path)
    try:
        name = Path(os.path.relpath(path, scene.path.parent)).as_posix()
    except ValueError:  # on another drive
        name = path.resolve().as_posix()
    return {name: hashlib.sha256(path.read_bytes()).hexdigest()}
