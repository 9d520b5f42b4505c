"""Results of which some part is as it was before, by object or by triangles; the next rebake mends all of it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from bake.rebake.mix import differing_objects, differing_vertices, faces_within, with_former
from bake.rebake.session import RebakeSession
from bake.types import BakeResult, Scene
from tests.rebake.small_scene import ALONE, CPU, baked, drained, small_scene


def _moved(scene: Scene) -> Scene:
    """The scene with its crate elsewhere on the floor."""
    objects = list(scene.objects)
    number = next(number for number, item in enumerate(objects) if item.path == "crate")
    transform = objects[number].transform.copy()
    transform[:3, 3] += (0.8, 0.0, 0.5)
    objects[number] = dataclasses.replace(objects[number], transform=transform)
    return dataclasses.replace(scene, objects=tuple(objects))


@pytest.fixture(scope="module")
def scenes() -> tuple[Scene, Scene]:
    """Before and after."""
    scene = small_scene()
    return scene, _moved(scene)


@pytest.fixture(scope="module")
def results(scenes: tuple[Scene, Scene]) -> tuple[BakeResult, BakeResult]:
    """Their bakes."""
    former, latest = (baked(scene, ALONE) for scene in scenes)
    return former, latest


def test_triangles_are_taken_over_alone(results: tuple[BakeResult, BakeResult]) -> None:
    """Only vertices and samples of the chosen triangles are as before; their object is stale, nothing else is."""
    former, latest = results
    world = latest.world
    floor = world.object_paths.index("floor")
    faces = faces_within(world, np.array((-5.0, -1.0, -5.0)) - world.origin, np.array((0.0, 1.0, 5.0)) - world.origin)
    faces &= np.asarray(world.face_object) == floor
    assert faces.any()
    mixed = with_former(latest, former, world.object_paths, faces=faces)
    assert mixed.stale == ("floor",)
    inside = np.zeros(world.vertex_count, bool)
    inside[world.faces[faces]] = True
    np.testing.assert_array_equal(mixed.field.ao[inside], former.field.ao[inside])
    np.testing.assert_array_equal(mixed.field.ao[~inside], latest.field.ao[~inside])
    rows = faces[latest.samples.face]
    np.testing.assert_array_equal(mixed.tally.ao[rows], former.tally.ao[rows])
    np.testing.assert_array_equal(mixed.tally.ao[~rows], latest.tally.ao[~rows])
    assert 0 < differing_vertices(mixed, latest) < differing_vertices(former, latest)


def test_all_triangles_of_an_object_are_the_object(results: tuple[BakeResult, BakeResult]) -> None:
    """By its path or by every triangle of it, the same comes of it; by none, nothing."""
    former, latest = results
    world = latest.world
    faces = np.asarray(world.face_object) == world.object_paths.index("floor")
    by_faces = with_former(latest, former, world.object_paths, faces=faces)
    by_path = with_former(latest, former, ("floor",))
    np.testing.assert_array_equal(by_faces.field.ao, by_path.field.ao)
    np.testing.assert_array_equal(by_faces.tally.ao, by_path.tally.ao)
    assert by_faces.stale == by_path.stale == ("floor",)
    assert "floor" not in differing_objects(by_path, former)
    assert with_former(latest, former, world.object_paths, faces=np.zeros(world.face_count, bool)) is latest


def test_a_rebake_mends_what_was_rejected(scenes: tuple[Scene, Scene], results: tuple[BakeResult, BakeResult]) -> None:
    """What is stale in part is brought up to date as a whole: the values are those of the bake again."""
    former, latest = results
    world = latest.world
    faces = np.asarray(world.positions)[world.faces].mean(axis=1)[:, 0] < -np.asarray(world.origin)[0]
    mixed = with_former(latest, former, differing_objects(latest, former), faces=faces)
    assert mixed is not latest
    with RebakeSession(mixed, scenes[1], CPU) as session:
        outcome = drained(session.rebake(scenes[1], ALONE))
    assert outcome.result.stale == ()
    np.testing.assert_allclose(outcome.result.field.ao, latest.field.ao, atol=2.0 / 255.0)
