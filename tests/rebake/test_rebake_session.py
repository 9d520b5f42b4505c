"""Sessions: what they adopt, what they leave, what they tell on the way."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from bake.bench.rebake_edits import RandomEdits
from bake.bench.rebake_error import rebake_errors
from bake.rebake.changes import changed_objects, compare
from bake.rebake.session import RebakeSession
from bake.rebake.types import Partial, RebakeOutcome
from bake.results import load_result, save_result
from bake.types import BakeResult, Role, Scene
from tests.rebake.small_scene import ALONE, CPU, SETTINGS, baked, drained, small_scene


def moved(scene: Scene, path: str, by: tuple[float, float, float]) -> Scene:
    """The scene with an object shifted."""
    objects = list(scene.objects)
    for number, item in enumerate(objects):
        if item.path == path:
            transform = item.transform.copy()
            transform[:3, 3] += by
            objects[number] = dataclasses.replace(item, transform=transform)
    return dataclasses.replace(scene, objects=tuple(objects))


def largest(one: BakeResult, other: BakeResult) -> float:
    """Largest difference of any kind of values."""
    return max(error.largest for error in rebake_errors(one, other).values())


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The small level."""
    return small_scene()


@pytest.fixture(scope="module")
def result(scene: Scene) -> BakeResult:
    """Its bake."""
    return baked(scene)


def test_nothing_changed_is_nothing_done(scene: Scene, result: BakeResult) -> None:
    """A rebake of an unchanged scene traces no ray and changes no value."""
    with RebakeSession(result, scene, CPU) as session:
        outcome = drained(session.rebake(scene, SETTINGS))
    report = outcome.report
    assert (report.changed, report.rays_traced, report.rays_elsewhere, report.vertices_changed) == ((), 0, 0, 0)
    assert largest(outcome.result, result) == 0.0


def test_closing_leaves_the_old_state(scene: Scene, result: BakeResult) -> None:
    """Closed at any of its steps, a rebake leaves the session as it was; the next one is right all the same."""
    edited = moved(scene, "ball", (0.4, 0.0, 0.3))
    whole = baked(edited)
    with RebakeSession(result, scene, CPU, bound=0.0) as session:
        for steps in (1, 4, 9, 14, 20):
            work = session.rebake(edited, SETTINGS)
            for _ in range(steps):
                if next(work, None) is None:
                    break
            work.close()
            if session.result is not result:
                break
            assert session.scene is scene
        assert largest(drained(session.rebake(edited, SETTINGS)).result, whole) <= 1e-5


def test_partial_values_come_early_and_end_final(scene: Scene, result: BakeResult) -> None:
    """Values come before the last ray, get closer, and the last ones are those of the result."""
    edited = moved(scene, "crate#1", (0.3, 0.0, -0.2))
    partials: list[Partial] = []
    with RebakeSession(result, scene, CPU, bound=0.0) as session:
        work = session.rebake(edited, SETTINGS)
        try:
            while True:
                step = next(work)
                if isinstance(step, Partial):
                    partials.append(step)
        except StopIteration as end:
            outcome: RebakeOutcome = end.value
    assert len(partials) >= 2
    assert [part.final for part in partials[:-1]] == [False] * (len(partials) - 1)
    last = partials[-1]
    assert last.final
    lods = np.array([role is Role.LOD for role in outcome.result.world.object_roles])
    owner = np.repeat(np.arange(len(lods)), np.diff(outcome.result.world.first_vertex))
    own = ~lods[owner[last.vertices]]
    assert np.array_equal(last.ao[own], outcome.result.field.ao[last.vertices[own]], equal_nan=True)
    shown = partials[-2]
    error = np.abs(shown.ao - outcome.result.field.ao[shown.vertices])
    assert np.nanmean(error) < 0.02


def test_first_vertices_are_asked_for(scene: Scene, result: BakeResult) -> None:
    """What is to be right first may be any vertices; the result is the same."""
    edited = moved(scene, "ball", (0.4, 0.0, 0.3))
    asked: list[int] = []

    def first() -> np.ndarray:
        asked.append(1)
        return np.arange(50)

    with RebakeSession(result, scene, CPU, bound=0.0) as session:
        outcome = drained(session.rebake(edited, SETTINGS, first=first))
    assert asked == [1]
    assert largest(outcome.result, baked(edited)) <= 1e-5


def test_selected_objects_alone_change(scene: Scene, result: BakeResult) -> None:
    """With a selection only its values change; what else is reached is stale, and brought up to date by the next."""
    edited = moved(scene, "crate", (0.5, 0.0, 0.5))
    with RebakeSession(result, scene, CPU, bound=0.0) as session:
        outcome = drained(session.rebake(edited, SETTINGS, objects=frozenset({"floor"})))
        world, first = outcome.result.world, outcome.result.world.first_vertex
        for number, path in enumerate(world.object_paths):
            own = slice(int(first[number]), int(first[number + 1]))
            if path != "floor" and world.object_roles[number].receives_per_vertex:
                assert np.array_equal(outcome.result.field.ao[own], result.field.ao[own], equal_nan=True), path
        assert "crate" in outcome.report.stale
        assert "floor" not in outcome.report.stale
        assert outcome.result.stale == outcome.report.stale
        again = drained(session.rebake(edited, SETTINGS))
        assert again.result.stale == ()
        assert largest(again.result, baked(edited)) <= 1e-5


def test_selected_faces_alone_are_traced(scene: Scene, result: BakeResult) -> None:
    """With faces selected, no sample elsewhere is traced."""
    edited = moved(scene, "crate", (0.5, 0.0, 0.5))
    faces = np.arange(40)
    with RebakeSession(result, scene, CPU) as session:
        outcome = drained(session.rebake(edited, SETTINGS, faces=faces))
    rest = outcome.result.samples.face >= 40
    assert np.array_equal(outcome.result.tally.ao[rest], result.tally.ao[rest])
    assert not np.array_equal(outcome.result.tally.ao[~rest], result.tally.ao[~rest])


def test_more_rays_for_a_selection(scene: Scene, result: BakeResult) -> None:
    """A higher number of rays for some objects traces those alone and marks the rest."""
    more = SETTINGS.replaced(rays=32)
    with RebakeSession(result, scene, CPU) as session:
        outcome = drained(session.rebake(scene, more, objects=frozenset({"wall"})))
    world, rays = outcome.result.world, outcome.result.tally.rays
    on_wall = world.face_object[outcome.result.samples.face] == world.object_paths.index("wall")
    assert set(rays[on_wall].tolist()) == {32}
    assert set(rays[~on_wall].tolist()) == {16}
    assert "floor" in outcome.result.stale


def test_alpha_and_threshold_trace_nothing(scene: Scene) -> None:
    """Smoothing and the back-face threshold change values without a ray."""
    before = baked(scene, ALONE)
    with RebakeSession(before, scene, CPU, bound=0.0) as session:
        for settings in (ALONE.replaced(alpha=0.2), ALONE.replaced(alpha=0.2, back_face_threshold=0.1)):
            outcome = drained(session.rebake(scene, settings))
            assert outcome.report.rays_traced + outcome.report.rays_elsewhere == 0
            assert largest(outcome.result, baked(scene, settings)) <= 1e-5


def test_other_settings_bake_in_full(scene: Scene, result: BakeResult) -> None:
    """Distances, for one, ask for a whole bake, which the report says."""
    settings = SETTINGS.replaced(distances=(1.0,))
    with RebakeSession(result, scene, CPU) as session:
        outcome = drained(session.rebake(scene, settings))
    assert "distances" in outcome.report.full
    assert largest(outcome.result, baked(scene, settings)) == 0.0


def test_random_edits_at_the_default_bound_stay_close(scene: Scene, result: BakeResult) -> None:
    """After a row of edits no value is off by more than two 255ths."""
    edits = RandomEdits(scene, SETTINGS, 7)
    with RebakeSession(result, scene, CPU) as session:
        for _ in range(12):
            edit = edits.next()
            outcome = drained(session.rebake(edit.scene, edit.settings))
            for kind, error in rebake_errors(outcome.result, baked(edit.scene, edit.settings)).items():
                assert error.largest <= 2 / 255, (edit.kind, kind)
                assert error.rms <= 1e-3, (edit.kind, kind)


def test_a_stored_result_goes_on(tmp_path: Path, scene: Scene, result: BakeResult) -> None:
    """Stored after a rebake and loaded again, a result with stale objects and skipped bounds follows further edits."""
    edited = moved(scene, "pebble", (0.2, 0.0, 0.2))
    with RebakeSession(result, scene, CPU) as session:
        outcome = drained(session.rebake(moved(edited, "crate", (0.1, 0, 0)), SETTINGS, objects=frozenset({"floor"})))
    save_result(outcome.result, tmp_path)
    stored = load_result(tmp_path)
    assert stored.stale == outcome.result.stale
    assert (stored.skipped is None) == (outcome.result.skipped is None)
    with RebakeSession(stored, None, CPU, bound=0.0) as session:
        again = drained(session.rebake(edited, SETTINGS))
    assert largest(again.result, baked(edited)) <= 1e-5


def test_comparing_finds_what_moved(scene: Scene, result: BakeResult) -> None:
    """Comparing a world with itself carries all of it; a moved object alone is not carried."""
    world = result.world
    same = compare(world, world)
    assert np.array_equal(same.old_face, np.arange(world.face_count))
    assert not same.object_casts_anew.any()
    assert not same.object_receives_anew.any()
    other = baked(moved(scene, "ball", (0.1, 0.0, 0.0)), ALONE).world
    change = compare(world, other)
    number = world.object_paths.index("ball")
    assert changed_objects(world, other) == ("ball",)
    assert np.flatnonzero(change.object_casts_anew).tolist() == [number]
    assert (change.old_face < 0).sum() == world.first_face[number + 1] - world.first_face[number]
