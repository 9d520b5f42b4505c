"""What reads the baked surface is read anew wherever that surface changed."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from bake.bench.rebake_error import rebake_errors
from bake.rebake.session import RebakeSession
from bake.types import Role, Scene, SceneObject
from tests.rebake.small_scene import CPU, SETTINGS, baked, drained, placed, small_scene


def far_level() -> Scene:
    """The small level, with a lower level of two balls that lies far from both."""
    scene = small_scene()
    objects = (
        *scene.objects,
        placed("pair/a", 3, -3.0, 0.7, 3.0),
        placed("pair/b", 3, 3.5, 0.7, 0.5),
        placed("pair far", 3, 0.0, 30.0, 0.0, Role.LOD, of="pair"),
    )
    return dataclasses.replace(scene, objects=objects)


def without(objects: tuple[SceneObject, ...], path: str) -> tuple[SceneObject, ...]:
    """All but one."""
    return tuple(item for item in objects if item.path != path)


def shifted(objects: tuple[SceneObject, ...], path: str, *by: float) -> tuple[SceneObject, ...]:
    """One of them elsewhere."""
    shift = np.eye(4)
    shift[:3, 3] = by
    return tuple(
        dataclasses.replace(item, transform=shift @ item.transform) if item.path == path else item for item in objects
    )


@pytest.mark.parametrize("edit", ["gone", "moved", "near", "level"])
def test_lower_levels_far_from_their_finest_follow_it(edit: str) -> None:
    """One of its objects is gone or moved, something casts on it, or the lower level itself moves."""
    scene = far_level()
    objects = {
        "gone": without(scene.objects, "pair/b"),
        "moved": shifted(scene.objects, "pair/a", 0.5, 0.0, -1.0),
        "near": shifted(scene.objects, "crate#1", 1.6, 0.0, -0.4),
        "level": shifted(scene.objects, "pair far", 0.0, -29.0, 0.0),
    }[edit]
    edited = dataclasses.replace(scene, objects=objects)
    with RebakeSession(baked(scene), scene, CPU, bound=0.0) as session:
        outcome = drained(session.rebake(edited, SETTINGS))
    errors = rebake_errors(outcome.result, baked(edited))
    assert max(error.largest for error in errors.values()) <= 1e-5, errors
