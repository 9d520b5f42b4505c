"""The engine process: jobs, progress, cancel, errors, and its death."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import bake_doubles
import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from app.engine import QUICK_DEATHS, Engine, EngineState
from app.engine_worker import Bake, bake_job
from bake.errors import SettingsError
from bake.results import load_result
from bake.settings import BakeSettings, MappingKind
from bake.solve import map_to_vertices
from bake.types import BakeResult

PATIENCE_MS = 180_000
SCENE, RESULT = Path("scene.glb"), Path("result")

pytestmark = pytest.mark.gui


@pytest.fixture
def make_engine(qapp: object) -> Iterator[Callable[[Bake], Engine]]:
    """Makes engines; closes them and fails if one leaves a process, a thread or shared memory behind."""
    engines: list[Engine] = []

    def make(bake: Bake) -> Engine:
        engine = Engine(bake)
        engine.start()
        engines.append(engine)
        return engine

    yield make
    for engine in engines:
        engine.close()
        assert engine.state is EngineState.DOWN
        assert not engine._memories
    assert not [child for child in multiprocessing.active_children() if child.name == "obscura-engine"]
    assert not [thread for thread in threading.enumerate() if thread.name == "engine-reader"]


def test_progress_is_coalesced_and_the_end_arrives(make_engine, qtbot: QtBot) -> None:
    """A thousand quick steps give a handful of reports, one a stage at least, and then the outcome."""
    engine = make_engine(bake_doubles.counting)
    reports: list[tuple[str, float]] = []
    engine.progressed.connect(lambda progress, memory: reports.append((progress.stage, memory)))
    with qtbot.waitSignal(engine.bake_finished, timeout=PATIENCE_MS) as finished:
        engine.bake(SCENE, RESULT, BakeSettings())
    assert finished.args[0].result == str(RESULT)
    assert finished.args[0].seconds == 0.5
    assert {stage for stage, _ in reports} == {"load", "trace"}
    assert len(reports) < 100
    assert all(memory > 1.0 for _, memory in reports)
    assert engine.state is EngineState.IDLE


def test_cancel_stops_between_steps_and_keeps_the_process(make_engine, qtbot: QtBot) -> None:
    """A job that looks at the flag stops, and the same process takes the next one."""
    engine = make_engine(bake_doubles.endless)
    with qtbot.waitSignal(engine.progressed, timeout=PATIENCE_MS):
        engine.bake(SCENE, RESULT, BakeSettings())
    pid = engine.pid
    for _ in range(2):
        with qtbot.waitSignals([engine.cancelled, engine.state_changed], timeout=PATIENCE_MS):
            engine.cancel()
        qtbot.waitUntil(lambda: engine.state is EngineState.IDLE, timeout=PATIENCE_MS)
        with qtbot.waitSignal(engine.progressed, timeout=PATIENCE_MS):
            engine.bake(SCENE, RESULT, BakeSettings())
    assert engine.pid == pid
    assert engine.is_baking


def test_cancel_of_a_hanging_job_answers_and_restarts(make_engine, qtbot: QtBot) -> None:
    """A job that hangs counts as cancelled at once; its process is replaced, and the next job is served."""
    engine = make_engine(bake_doubles.hanging)
    with qtbot.waitSignal(engine.logged, timeout=PATIENCE_MS):
        engine.bake(SCENE, RESULT, BakeSettings())
    pid = engine.pid
    with qtbot.waitSignal(engine.cancelled, timeout=PATIENCE_MS):
        engine.cancel()
    assert engine.pid == pid  # the answer does not wait for the process
    assert not engine.is_baking
    with qtbot.waitSignal(engine.bake_finished, timeout=PATIENCE_MS):
        engine.bake(SCENE, RESULT, BakeSettings(seed=2))
    assert engine.pid != pid


def test_cancel_drops_what_waits(make_engine, qtbot: QtBot) -> None:
    """Every queued job is answered for, once."""
    engine = make_engine(bake_doubles.endless)
    answered: list[int] = []
    engine.cancelled.connect(lambda job: answered.append(job.id))
    ids = [engine.bake(SCENE, RESULT, BakeSettings()) for _ in range(3)]
    with qtbot.waitSignal(engine.progressed, timeout=PATIENCE_MS):
        pass
    engine.cancel()
    qtbot.waitUntil(lambda: sorted(answered) == ids, timeout=PATIENCE_MS)


def test_errors_arrive_whole(make_engine, qtbot: QtBot) -> None:
    """An error keeps its type and its three parts on the way out of the process."""
    engine = make_engine(bake_doubles.refusing)
    with qtbot.waitSignal(engine.failed, timeout=PATIENCE_MS) as failed:
        engine.bake(SCENE, RESULT, BakeSettings())
    error = failed.args[1]
    assert isinstance(error, SettingsError)
    assert (error.what, error.where, error.remedy) == ("7 is below 8", "--rays", "use 8 to 64")
    assert engine.state is EngineState.IDLE


def test_a_defect_is_reported_and_logged(make_engine, qtbot: QtBot) -> None:
    """An unexpected exception ends the job, not the process, and its traceback is in the log."""
    engine = make_engine(bake_doubles.defective)
    lines: list[tuple[int, str]] = []
    engine.logged.connect(lambda level, name, text: lines.append((level, text)))
    with qtbot.waitSignal(engine.failed, timeout=PATIENCE_MS) as failed:
        engine.bake(SCENE, RESULT, BakeSettings())
    pid = engine.pid
    assert "ZeroDivisionError" in str(failed.args[1])
    assert any(level == logging.ERROR and "Traceback" in text for level, text in lines)
    with qtbot.waitSignal(engine.failed, timeout=PATIENCE_MS):
        engine.bake(SCENE, RESULT, BakeSettings())
    assert engine.pid == pid


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_kill_is_survived(make_engine, qtbot: QtBot) -> None:
    """kill -9 in the middle of a bake is told in words, and a new process serves the next job."""
    engine = make_engine(bake_doubles.endless)
    with qtbot.waitSignal(engine.progressed, timeout=PATIENCE_MS):
        engine.bake(SCENE, RESULT, BakeSettings())
    pid = engine.pid
    assert pid is not None
    with qtbot.waitSignal(engine.crashed, timeout=PATIENCE_MS) as crashed:
        os.kill(pid, signal.SIGKILL)
    assert "SIGKILL" in crashed.args[0]
    assert "stored results are untouched" in crashed.args[0]
    with qtbot.waitSignal(engine.progressed, timeout=PATIENCE_MS):
        engine.bake(SCENE, RESULT, BakeSettings())
    assert engine.pid not in (None, pid)


def test_an_engine_that_keeps_dying_stays_down_until_asked(make_engine, qtbot: QtBot) -> None:
    """After some quick deaths there is no restart loop; the next bake starts it again."""
    engine = make_engine(bake_doubles.dying)
    for _ in range(QUICK_DEATHS):
        with qtbot.waitSignal(engine.crashed, timeout=PATIENCE_MS) as crashed:
            engine.bake(SCENE, RESULT, BakeSettings())
    assert "exit code 3" in crashed.args[0]
    assert engine.state is EngineState.DOWN
    assert engine.pid is None
    with qtbot.waitSignal(engine.progressed, timeout=PATIENCE_MS):
        engine.bake(SCENE, RESULT, BakeSettings())


def test_real_bake_and_solve(make_engine, qtbot: QtBot, level: Path, baked: BakeResult, tmp_path: Path) -> None:
    """The pipeline in the process gives what it gives here; a re-solve equals mapping the stored samples."""
    engine = make_engine(bake_job)
    folder = tmp_path / "result"
    with qtbot.waitSignal(engine.bake_finished, timeout=PATIENCE_MS) as finished:
        engine.bake(level, folder, baked.settings)
    assert not finished.args[0].unchanged
    stored = load_result(folder)
    np.testing.assert_array_equal(stored.field.ao, baked.field.ao)

    settings = baked.settings.replaced(mapping=MappingKind.AVERAGE, back_face_threshold=0.6)
    vertices, columns = np.shape(stored.field.ao)
    with qtbot.waitSignal(engine.solve_finished, timeout=PATIENCE_MS) as solved:
        engine.solve("test", folder, settings, vertices, columns)
    valid = stored.tally.valid(0.6)
    expected = map_to_vertices(stored.world, stored.samples, stored.tally.ao, valid, settings)
    job, field, _ = solved.args
    assert job.purpose == "test"
    np.testing.assert_array_equal(field.ao, expected.ao)
    np.testing.assert_array_equal(field.state, expected.state)
    assert field.report.rmse == pytest.approx(expected.report.rmse)


def test_a_waiting_solve_is_replaced(make_engine, qtbot: QtBot, result_folder: Path, baked: BakeResult) -> None:
    """While one solve runs only the last of those asked for is kept, by purpose."""
    engine = make_engine(bake_job)
    solved: list[tuple[str, float]] = []
    engine.solve_finished.connect(
        lambda job, field, seconds: solved.append((job.purpose, job.options["back-face-threshold"]))
    )
    vertices, columns = np.shape(baked.field.ao)
    for threshold in (0.1, 0.2, 0.3, 0.4):
        settings = baked.settings.replaced(back_face_threshold=threshold)
        engine.solve("threshold", result_folder, settings, vertices, columns)
    engine.solve("other", result_folder, baked.settings, vertices, columns)
    qtbot.waitUntil(lambda: engine.state is EngineState.IDLE and len(solved) >= 3, timeout=PATIENCE_MS)
    assert solved == [("threshold", 0.1), ("threshold", 0.4), ("other", 0.25)]
