"""The origin lies where values are baked, whatever stands far off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bake.bench.shapes import flat
from bake.bench.stability_level import Level, as_scene, make_level, part
from bake.scene import flatten
from bake.scene.flatten import origin_of
from bake.scene_types import Role
from bake.settings import BakeSettings


@pytest.mark.parametrize("distance", [1e3, 1e4, 1e6])
@pytest.mark.parametrize("role", [Role.STATIC, Role.BLOCKER, Role.IGNORE])
def test_backdrops_do_not_pull_it_away(role: Role, distance: float) -> None:
    """The level's own positions are the same to the bit with a backdrop on one side and without."""
    alone = flatten(as_scene(make_level()), BakeSettings())
    far = part("far", flat(-10.0, 10.0, -10.0, 10.0, 0.0, 2).moved(distance, 0.0, 0.0), role)
    world = flatten(as_scene(make_level().with_parts(far)), BakeSettings())
    np.testing.assert_array_equal(world.origin, alone.origin)
    np.testing.assert_array_equal(world.positions[: alone.vertex_count], alone.positions)


def test_two_towns_share_it() -> None:
    """Where both hold many vertices, it lies between them."""
    level = make_level()
    twin = level.moved(np.array([1000.0, 0.0, 0.0])).each(lambda item: replace(item, name=f"{item.name} 2"))
    world = flatten(as_scene(Level((*level.parts, *twin.parts))), BakeSettings())
    assert 250.0 < world.origin[0] < 750.0


def test_something_always_decides() -> None:
    """Even if all objects are ignored, in one point, or each alone far from the others."""
    low = np.array([[0.0, 0.0, 0.0], [1e6, 0.0, 0.0], [0.0, 1e6, 0.0]])
    counts = np.array([3, 3, 3])
    for roles in ([Role.IGNORE] * 3, [Role.BLOCKER] * 3, [Role.STATIC, Role.IGNORE, Role.BLOCKER]):
        assert np.isfinite(origin_of(roles, low, low, counts)).all()
    np.testing.assert_array_equal(origin_of([Role.STATIC] * 3, low * 0.0, low * 0.0, counts), 0.0)


@pytest.mark.parametrize("role", [Role.STATIC, Role.SHRUB, Role.BLOCKER, Role.IGNORE])
@pytest.mark.parametrize("distance", [0.0, 3.0, 40.0, 5e3])
def test_a_prop_does_not_decide(role: Role, distance: float) -> None:
    """A prop at the edge may be moved off, come, go and take any role: all else keeps its positions to the bit."""
    alone = flatten(as_scene(make_level()), BakeSettings())
    edge = float(alone.positions[:, 0].max() + alone.origin[0])
    prop = part("prop", flat(-0.5, 0.5, -0.5, 0.5, 0.0, 2).moved(edge + distance, 0.0, 0.0), role)
    world = flatten(as_scene(make_level().with_parts(prop)), BakeSettings())
    np.testing.assert_array_equal(world.positions[: alone.vertex_count], alone.positions)
