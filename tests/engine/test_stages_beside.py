"""Stages that run beside others give what they give alone, tell their own time, and fail before any ray."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np
import pytest

from bake.bench.synthetic import write_ply
from bake.errors import SceneError
from bake.pipeline import BakeRequest, run_bake
from bake.scene import flatten, load_scene, load_unchecked, looked_over
from bake.scene.remembered import remembered
from bake.settings import BakeSettings, MappingKind
from bake.solve import map_ahead, map_to_vertices
from bake.stages import Running, StageClock, drained, patiently
from tests.solve.solve_cases import moved, random_samples
from tests.worlds import box, icosphere, make_world


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A ball with a triangle twice, and a vertex that nobody uses."""
    positions, faces = icosphere(2)
    path = tmp_path / "ball.ply"
    write_ply(
        path, (np.concatenate((positions, [[9.0, 0.0, 0.0]])), np.concatenate((faces, faces[:1])).astype(np.int32))
    )
    return path


def test_the_halves_of_loading_are_the_whole(scene: Path) -> None:
    """Findings included, which the first half does not have yet."""
    whole, half = load_scene(scene), load_unchecked(scene)
    assert len(half.findings) < len(whole.findings)
    assert {"duplicate-faces", "unreferenced-vertices"} <= {item.what for item in whole.findings}
    assert looked_over(half).findings == whole.findings
    np.testing.assert_array_equal(half.meshes[0].faces, whole.meshes[0].faces)


def test_what_is_refused_is_refused_unchecked_too(tmp_path: Path) -> None:
    """An object too far away, with the same words."""
    path = tmp_path / "far.ply"
    positions, faces = icosphere(1)
    write_ply(path, (np.asarray(positions) + 1e12, np.asarray(faces, np.int32)))
    for load in (load_scene, load_unchecked):
        with pytest.raises(SceneError, match="m from the origin"):
            load(path)


@pytest.mark.parametrize("mapping", list(MappingKind))
@pytest.mark.parametrize("weld", [False, True])
def test_a_mapping_begun_ahead_is_the_same(mapping: MappingKind, weld: bool) -> None:
    """To the bit, with vertices that have no sample of their own."""
    ball, crate = icosphere(1), box()
    world = make_world(ball, (moved(crate[0], 2.5), crate[1]), (moved(ball[0], 5.0), ball[1]))
    samples = random_samples(world, 3)
    random = np.random.default_rng(1)
    ao, valid = random.random((len(samples), 2)).astype(np.float32), random.random(len(samples)) < 0.4
    settings = BakeSettings(mapping=mapping, weld_instances=weld)
    alone = map_to_vertices(world, samples, ao, valid, settings)
    ahead = map_to_vertices(world, samples, ao, valid, settings, ahead=map_ahead(world, settings))
    np.testing.assert_array_equal(ahead.ao, alone.ao)
    np.testing.assert_array_equal(ahead.state, alone.state)
    assert ahead.report == alone.report


@pytest.mark.parametrize("mapping", ["average", "least-squares"])
def test_a_bake_has_the_findings_of_its_scene(scene: Path, tmp_path: Path, mapping: str) -> None:
    """First and in their order; the report says what ran beside other stages."""
    options = {"rays": 4, "samples-per-face": "1:1", "device": "cpu", "mapping": mapping}
    outcome = drained(run_bake(BakeRequest(scene, tmp_path / "result", options)))
    found = load_scene(scene).findings
    assert outcome.result.findings[: len(found)] == found
    rows = {row.name: row for row in outcome.result.stages}
    assert "looked over beside other stages" in rows["process geometry"].why
    assert "welded beside other stages" in rows["map to vertices"].why


def test_running_work_is_waited_for() -> None:
    """Its value comes with its own seconds, however late it is asked for; what it raises is raised then."""
    running = Running("stage", lambda: threading.get_ident())
    time.sleep(0.2)
    value, seconds = drained(running.ended())
    assert value != threading.get_ident()
    assert seconds < 0.2

    def fail() -> None:
        raise SceneError("no")

    failing = Running("stage", fail)
    with pytest.raises(SceneError, match="no"):
        drained(failing.ended())


def test_work_that_cannot_be_divided_gives_a_sign_of_life() -> None:
    """However short it is; and closing the generator does not wait for it."""
    assert [step.stage for step in patiently("quick", lambda: None)][:1] == ["quick"]
    let_go = threading.Event()
    waiting = patiently("slow", let_go.wait)
    next(waiting)
    waiting.close()
    let_go.set()


def test_what_ran_beside_joins_its_row() -> None:
    """With its seconds and its reason; rows that were skipped stay as they are."""
    clock = StageClock()
    clock.ran("load", "1 object", 1.0)
    clock.skipped("fog", "none")
    clock.beside("load", "checked", 0.5)
    clock.beside("fog", "checked", 0.5)
    assert [(row.name, row.seconds) for row in clock.rows] == [("load", 1.5), ("fog", 0.0)]
    assert clock.rows[0].why == "1 object; checked beside other stages: 0.50 s"


def test_threads_that_want_one_result_wait_for_the_first() -> None:
    """It is worked out once; what is told is not worked out at all, and a failure is not kept."""
    begun, let_go, calls = threading.Event(), threading.Event(), list[int]()

    @remembered
    def total(values: np.ndarray) -> float:
        calls.append(1)
        begun.set()
        assert let_go.wait(10.0)
        if values[0] < 0.0:
            raise ValueError("negative")
        return float(values.sum())

    values = np.arange(4.0)
    running = [Running("one", lambda: total(values))]
    assert begun.wait(10.0)
    running.append(Running("other", lambda: total(values)))
    let_go.set()
    assert [drained(each.ended())[0] for each in running] == [6.0, 6.0]
    assert len(calls) == 1
    told = np.arange(5.0)
    total.tell(-1.0, told)
    assert total(told) == -1.0
    negative = np.full(2, -1.0)
    for _ in range(2):
        with pytest.raises(ValueError, match="negative"):
            total(negative)
    assert len(calls) == 3


def test_flattening_needs_no_check_before(scene: Path) -> None:
    """A world is the same from either half of loading."""
    worlds = [flatten(load(scene), BakeSettings()) for load in (load_scene, load_unchecked)]
    np.testing.assert_array_equal(worlds[0].face_samples, worlds[1].face_samples)
    assert worlds[0].object_hash == worlds[1].object_hash
