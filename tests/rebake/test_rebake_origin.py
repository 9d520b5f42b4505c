"""A rebake rounds positions as a whole bake does: about the same origin."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from bake.rebake.session import RebakeSession
from bake.types import BakeResult, Role, Scene
from tests.rebake.small_scene import ALONE, CPU, baked, drained, placed, small_scene


def followed(before: Scene, after: Scene) -> tuple[BakeResult, str]:
    """A rebake's result at the default bound, and why it was a whole bake, if it was."""
    with RebakeSession(baked(before, ALONE), before, CPU) as session:
        outcome = drained(session.rebake(after, ALONE))
    return outcome.result, outcome.report.full


def with_prop(role: Role, x: float) -> Scene:
    """The small level with a crate far out."""
    scene = small_scene()
    return dataclasses.replace(scene, objects=(*scene.objects, placed("outlier", 2, x, 0.501, 0.0, role)))


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ((Role.BLOCKER, 40.0), (Role.SHRUB, 40.0)),
        ((Role.STATIC, 4.0), (Role.STATIC, 60.0)),
        ((Role.STATIC, 40.0), None),
    ],
)
def test_an_outlying_prop_keeps_it(before: tuple[Role, float], after: tuple[Role, float] | None) -> None:
    """A prop at the edge takes another role, moves off or goes: a rebake follows, and the origin stays a bake's."""
    now = small_scene() if after is None else with_prop(*after)
    result, full = followed(with_prop(*before), now)
    assert full == ""
    world = baked(now, ALONE).world
    np.testing.assert_array_equal(result.world.origin, world.origin)
    np.testing.assert_array_equal(result.world.positions, world.positions)


def test_another_origin_is_baked_whole() -> None:
    """Where a bake would take another origin, however good the old one still is, it is baked whole, and said so."""
    scene = small_scene()
    shift = np.array([4.0, 0.0, 0.0])
    objects = list(scene.objects)
    for number, item in enumerate(objects):
        transform = item.transform.copy()
        transform[:3, 3] += shift
        objects[number] = dataclasses.replace(item, transform=transform)
    edited = dataclasses.replace(scene, objects=tuple(objects))
    result, full = followed(scene, edited)
    whole = baked(edited, ALONE)
    assert "origin" in full
    np.testing.assert_array_equal(result.world.origin, whole.world.origin)
    np.testing.assert_array_equal(result.field.ao, whole.field.ao)
