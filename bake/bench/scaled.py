"""Scenes in other units."""

from __future__ import annotations

import dataclasses

import numpy as np

from bake.types import Scene


def scaled(scene: Scene, scale: float) -> Scene:
    """The scene with all lengths multiplied: `scale` is metres in a unit of it."""
    matrix = np.diag([scale, scale, scale, 1.0])
    objects = tuple(dataclasses.replace(item, transform=matrix @ item.transform) for item in scene.objects)
    return dataclasses.replace(scene, objects=objects)
