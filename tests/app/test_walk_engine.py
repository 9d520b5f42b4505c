"""The engine traces walks through stored results: progress, cancel, and that nothing else is stopped."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from app.engine import Engine, EngineState
from app.engine_protocol import TaskJob
from app.walk_task import TracedWalk, WalkRequest
from bake.results import load_result
from bake.walk import path_through

PATIENCE_MS = 180_000

pytestmark = pytest.mark.gui


@pytest.fixture
def engine(qapp: object) -> Iterator[Engine]:
    """An engine process."""
    engine = Engine()
    engine.start()
    yield engine
    engine.close()


def test_walk_is_traced_along_a_path(engine: Engine, qtbot: QtBot, regions_folder: Path) -> None:
    """The truth comes back by place, with as many distances as were baked, and progress on the way."""
    world = load_result(regions_folder).world
    path = path_through(np.array([[-3.0, 1.6, 3.0], [-3.0, 1.6, -3.0]]) - world.origin)
    stages: list[str] = []
    engine.task_progressed.connect(lambda job, progress: stages.append(progress.stage))
    with qtbot.waitSignal(engine.task_finished, timeout=PATIENCE_MS) as finished:
        engine.task("walk", regions_folder, WalkRequest(path, True))
    job, traced = finished.args
    assert isinstance(job, TaskJob)
    assert isinstance(traced, TracedWalk)
    assert traced.truth is not None
    assert traced.truth.sh.shape[1:] == (9, 2)
    assert traced.path.length == pytest.approx(6.0)
    assert "trace the walk" in stages
    assert engine.state is EngineState.IDLE


def test_walk_can_be_cancelled_without_touching_other_jobs(engine: Engine, qtbot: QtBot, regions_folder: Path) -> None:
    """Cancelling a walk stops it and leaves what waits behind it."""
    world = load_result(regions_folder).world
    rows = np.stack([np.tile([-4.0, 4.0], 400), np.full(800, 1.6), np.linspace(-4.0, 4.0, 800)], axis=1)
    long_path = path_through(rows - world.origin)
    short_path = path_through(rows[:2] - world.origin)
    with qtbot.waitSignal(engine.task_progressed, timeout=PATIENCE_MS):
        engine.task("walk", regions_folder, WalkRequest(long_path, True))
    with qtbot.waitSignal(engine.cancelled, timeout=PATIENCE_MS) as stopped:
        engine.cancel_task("something else")
        engine.cancel_task("walk")
    assert stopped.args[0].arguments.path.length == pytest.approx(long_path.length)
    with qtbot.waitSignal(engine.task_finished, timeout=PATIENCE_MS):
        engine.task("walk", regions_folder, WalkRequest(short_path, False))


def test_result_without_regions_is_refused_in_one_line(engine: Engine, qtbot: QtBot, result_folder: Path) -> None:
    """A walk needs regions; the message says how to get them."""
    with qtbot.waitSignal(engine.failed, timeout=PATIENCE_MS) as failed:
        engine.task("walk", result_folder, WalkRequest(None, True))
    assert "no regions" in str(failed.args[1])
    assert "--regions auto" in str(failed.args[1])
