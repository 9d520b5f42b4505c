"""Points in space are told apart by whether one of their rays can have changed, and only those are traced anew."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from bake.change_types import WorldChange
from bake.pipeline import open_tracer
from bake.rebake.find_edit import find_edit
from bake.rebake.session import RebakeSession
from bake.rebake.state import Edit, State
from bake.trace import Tracer
from bake.trace.changed_points import ChangedPoints
from bake.types import BakeResult, Scene
from tests.rebake.small_scene import CPU, SETTINGS, baked, drained, small_scene

DIRECTIONS = 96
COUNT = 3000


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The small level."""
    return small_scene()


@pytest.fixture(scope="module")
def result(scene: Scene) -> BakeResult:
    """Its bake."""
    return baked(scene)


def moved(scene: Scene, path: str, *shift: float) -> Scene:
    """The scene with one object elsewhere."""
    transform = np.eye(4)
    transform[:3, 3] = shift
    objects = [
        dataclasses.replace(item, transform=transform @ item.transform) if item.path == path else item
        for item in scene.objects
    ]
    return dataclasses.replace(scene, objects=tuple(objects))


@pytest.mark.parametrize(
    ("path", "shift"), [("crate", (0.4, 0.0, 0.2)), ("tree", (0.1, 0.0, 0.2)), ("shrub", (1, 0, 0))]
)
def test_points_that_are_not_found_see_the_same(
    scene: Scene, result: BakeResult, path: str, shift: tuple[float, float, float]
) -> None:
    """What is gathered at them is the same to the bit; and most points far from a prop are not found."""
    edit = find_edit(State(result, scene), moved(scene, path, *shift), SETTINGS)
    assert isinstance(edit, Edit)
    random = np.random.default_rng(3)
    points = random.uniform((-9.0, 0.1, -9.0), (9.0, 6.0, 9.0), (COUNT, 3)).astype(np.float32)
    points -= np.asarray(result.world.origin, np.float32)
    seeds = random.integers(0, 1 << 32, COUNT, dtype=np.uint32)
    fog = None if result.decorators is None else result.decorators.fog
    with (
        drained(open_tracer(result.world, SETTINGS, CPU, fog))[0] as old,
        drained(open_tracer(edit.world, SETTINGS, CPU, edit.fog))[0] as new,
    ):
        found = looked(edit, old, new, points, seeds)
        before, after = (tracer.gather_sphere(points, seeds, DIRECTIONS) for tracer in (old, new))
    same = (before.sh == after.sh).all(axis=(1, 2)) & (before.back_faces == after.back_faces)
    same &= before.hits == after.hits
    assert not (~same & ~found).any()
    assert 0.0 < found.mean() < 0.9
    assert same[found].mean() < (0.7 if path == "crate" else 1.0)  # leaves and fog count by their boxes


def looked(edit: Edit, old: Tracer, new: Tracer, points: np.ndarray, seeds: np.ndarray) -> np.ndarray:
    """Which points are found."""
    low, high = edit.casters.boxes
    opaque = np.concatenate([edit.casters.before.opaque, edit.casters.after.opaque])
    change: WorldChange = edit.change
    with ChangedPoints(old, new, change, low, high, opaque) as changed:
        found = changed.find(points, seeds, DIRECTIONS)
        assert changed.tested < COUNT * DIRECTIONS
        return found


def test_a_moved_prop_leaves_most_voxels_alone_and_trees_are_seen_alone_once(scene: Scene, result: BakeResult) -> None:
    """The volume is that of a whole bake to the bit; what trees show alone is found in the first rebake only."""
    rays: list[int] = []
    with RebakeSession(result, scene, CPU) as session:
        for shift in (0.3, 0.5):
            edited = moved(scene, "crate", shift, 0.0, 0.0)
            outcome = drained(session.rebake(edited, SETTINGS))
            whole, rebaked = baked(edited).decorators, outcome.result.decorators
            assert whole is not None
            assert rebaked is not None
            assert whole.volume is not None
            assert rebaked.volume is not None
            np.testing.assert_array_equal(rebaked.volume.sh, whole.volume.sh)
            np.testing.assert_array_equal(rebaked.volume.valid, whole.volume.valid)
            assert 0 < outcome.report.voxels_traced < outcome.report.voxels
            rays += [row.rays for row in outcome.result.stages if row.name == "trees"]
    assert rays[0] > 0
    assert rays[1] == 0
