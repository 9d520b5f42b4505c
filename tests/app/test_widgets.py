"""Painted widgets, tables and small helpers, driven by the mouse."""

from __future__ import annotations

import logging
import time
from pathlib import Path

import numpy as np
import pytest
from PyQt6.QtCore import QPoint, QSettings, Qt
from PyQt6.QtTest import QTest
from pytestqt.qtbot import QtBot

from app.banner import Banner
from app.curve_widget import CurveWidget
from app.document import default_result_folder
from app.events import Event
from app.findings_table import FindingsTable
from app.jobs import Jobs
from app.log_panel import LogPanel
from app.opening import copy_result
from app.probe_strip import ProbeStrip
from app.progress_panel import ProgressPanel, duration
from app.range_widget import RangeWidget
from app.recent_files import MOST, add_recent_file, clear_recent_files, recent_files
from app.stage_table import StageTable
from bake.errors import SceneError, StorageError
from bake.results import load_result
from bake.types import BakeResult, Finding, Progress
from viewer.colormaps import GREY
from viewer.histogram import histogram_of
from viewer.tone import RemapCurve

pytestmark = pytest.mark.gui
LEFT, RIGHT = Qt.MouseButton.LeftButton, Qt.MouseButton.RightButton


@pytest.fixture
def range_widget(qtbot: QtBot) -> RangeWidget:
    """A range control over a ramp of values."""
    widget = RangeWidget()
    qtbot.addWidget(widget)
    widget.resize(320, widget.sizeHint().height())
    values = np.linspace(0.0, 1.0, 500, dtype=np.float32)
    widget.set_histogram(histogram_of(values, np.ones(500), 0.0, 1.0), GREY)
    widget.set_range(0.2, 0.8)
    widget.show()
    qtbot.waitExposed(widget)
    return widget


def _drag(widget: RangeWidget, start: float, end: float) -> None:
    y = 20
    begin, finish = (QPoint(round(widget._x(value)), y) for value in (start, end))
    QTest.mousePress(widget, LEFT, pos=begin)
    QTest.mouseMove(widget, finish)
    QTest.mouseRelease(widget, LEFT, pos=finish)


def test_handles_move_by_dragging(range_widget: RangeWidget, qtbot: QtBot) -> None:
    """Each handle follows the mouse, they never cross, and between them both move."""
    with qtbot.waitSignal(range_widget.range_changed):
        _drag(range_widget, 0.2, 0.4)
    low, high = range_widget.value_range()
    assert low == pytest.approx(0.4, abs=0.01)
    assert high == 0.8
    _drag(range_widget, low, 0.95)
    assert range_widget.value_range()[0] < range_widget.value_range()[1] == 0.8
    range_widget.set_range(0.2, 0.5)
    _drag(range_widget, 0.35, 0.55)
    low, high = range_widget.value_range()
    assert high - low == pytest.approx(0.3, abs=0.01)
    assert low == pytest.approx(0.4, abs=0.01)


def test_programmatic_range_is_silent(range_widget: RangeWidget, qtbot: QtBot) -> None:
    """Only the user's changes are signalled; a double click asks for the full range."""
    with qtbot.assertNotEmitted(range_widget.range_changed):
        range_widget.set_range(0.0, 1.0)
    with qtbot.waitSignal(range_widget.reset_requested):
        QTest.mouseDClick(range_widget, LEFT, pos=QPoint(100, 20))


def test_curve_is_edited_by_mouse(qtbot: QtBot) -> None:
    """Double click adds a point, dragging moves it, right click removes it; the ends stay."""
    widget = CurveWidget()
    qtbot.addWidget(widget)
    widget.resize(240, 92)
    widget.show()
    qtbot.waitExposed(widget)

    def at(x: float, y: float) -> QPoint:
        return widget._to_pixel(x, y).toPoint()

    with qtbot.waitSignal(widget.curve_changed):
        QTest.mouseDClick(widget, LEFT, pos=at(0.5, 0.8))
    assert len(widget.curve().points) == 3
    assert widget.curve().points[1] == pytest.approx((0.5, 0.8), abs=0.02)
    QTest.mousePress(widget, LEFT, pos=at(*widget.curve().points[1]))
    QTest.mouseMove(widget, at(0.3, 0.4))
    QTest.mouseRelease(widget, LEFT, pos=at(0.3, 0.4))
    assert widget.curve().points[1] == pytest.approx((0.3, 0.4), abs=0.02)
    QTest.mousePress(widget, RIGHT, pos=at(0.0, 0.0))
    assert len(widget.curve().points) == 3
    QTest.mousePress(widget, RIGHT, pos=at(*widget.curve().points[1]))
    assert widget.curve() == RemapCurve()


def test_progress_shows_rate_share_and_memory(qtbot: QtBot) -> None:
    """Stage, share, rate, time left and memory are in words; unknown totals run to and fro."""
    panel = ProgressPanel()
    qtbot.addWidget(panel)
    panel.begin("Starting")
    assert panel.isVisible()
    panel.set_progress(Progress("load", 0, 0), 120.0)
    assert panel._bar.maximum() == 0
    panel.set_progress(Progress("trace", 250, 1000, 10.0, 2.5e6), 843.0)
    assert panel._bar.value() == 250
    for part in ("2.50 Mrays/s", "30 s left", "843 MB"):
        assert part in panel._detail.text()
    with qtbot.waitSignal(panel.cancel_requested):
        qtbot.mouseClick(panel._cancel, LEFT)
    panel.end()
    assert not panel.isVisible()


@pytest.mark.parametrize(("seconds", "text"), [(8.2, "8 s"), (125, "2 min 5 s"), (4320, "1 h 12 min")])
def test_durations_read_well(seconds: float, text: str) -> None:
    """Times are told as people tell them."""
    assert duration(seconds) == text


def test_findings_are_filtered_and_chosen(qtbot: QtBot) -> None:
    """The most serious stands first; the filter matches object and finding; a click names the object."""
    table = FindingsTable()
    qtbot.addWidget(table)
    table.set_findings(
        [
            Finding("Level/A", "slivers", 12, "thin", "info"),
            Finding("Level/B", "nan-positions", 1, "gone", "set-aside"),
            Finding("Level/C", "invalid-samples", 3000, "many"),
        ]
    )
    proxy = table.view.proxy
    assert [proxy.index(row, 1).data() for row in range(3)] == ["Level/B", "Level/C", "Level/A"]
    with qtbot.waitSignal(table.object_chosen) as chosen:
        table.view.selectRow(1)
    assert chosen.args == ["Level/C"]
    table._filter.setText("sliv")
    assert proxy.rowCount() == 1
    table.set_findings([])
    assert table._count.text() == "No findings."


def test_stage_table_shows_what_was_skipped(qtbot: QtBot, baked: BakeResult) -> None:
    """A row a stage with its reason; totals above."""
    table = StageTable()
    qtbot.addWidget(table)
    table.set_result(baked)
    model = table.view.proxy
    rows = {model.index(row, 0).data(): model.index(row, 6).data() for row in range(model.rowCount())}
    assert set(rows) == {stage.name for stage in baked.stages}
    assert any(model.index(row, 1).data() == "skipped" for row in range(model.rowCount()))
    assert f"{len(baked.samples):,} samples" in table._summary.text()
    table.set_result(None)
    assert model.rowCount() == 0


def test_log_filters_by_level(qtbot: QtBot) -> None:
    """Lines are kept whatever is shown; text from elsewhere is not taken for markup."""
    panel = LogPanel()
    qtbot.addWidget(panel)
    panel.add(logging.DEBUG, "engine", "small talk")
    panel.add(logging.INFO, "engine", "a <b>bold</b> claim")
    panel.add(logging.ERROR, "engine", "broken")
    assert "small talk" not in panel.text()
    assert "<b>bold</b>" in panel.text()
    panel._level.setCurrentIndex(0)
    assert "small talk" in panel.text()
    panel._level.setCurrentIndex(2)
    assert "claim" not in panel.text()
    assert "broken" in panel.text()


def test_banner_is_closed_by_the_user(qtbot: QtBot) -> None:
    """A message stays until it is closed or replaced."""
    banner = Banner()
    qtbot.addWidget(banner)
    banner.show_message(logging.ERROR, "level.glb: is truncated; export it again")
    assert banner.isVisible()
    assert "truncated" in banner.text()
    banner.show_message(logging.INFO, "other")
    assert banner.text() == "other"


def test_strip_paints_without_a_point(qtbot: QtBot) -> None:
    """The strip can be painted before anything was hovered."""
    strip = ProbeStrip()
    qtbot.addWidget(strip)
    strip.resize(600, strip.height())
    assert not strip.grab().isNull()
    assert strip.text() == ""


def test_recent_files_keep_order_and_existence(tmp_path: Path, store: QSettings) -> None:
    """The latest first, none twice, none that is gone, not more than fit the menu."""
    paths = [tmp_path / f"{number}.glb" for number in range(MOST + 3)]
    for path in paths:
        path.touch()
        add_recent_file(store, path)
    add_recent_file(store, paths[5])
    assert recent_files(store)[0] == paths[5].resolve()
    assert len(recent_files(store)) == MOST
    paths[5].unlink()
    assert paths[5].resolve() not in recent_files(store)
    clear_recent_files(store)
    assert recent_files(store) == []


def test_jobs_deliver_the_latest_of_a_name(qtbot: QtBot) -> None:
    """A later job of the same name supersedes the earlier; errors reach their own callback."""
    jobs = Jobs()
    done: list[object] = []
    failed: list[object] = []
    jobs.run("read", lambda: (time.sleep(0.1), "old")[1], done.append, failed.append)
    jobs.run("read", lambda: "new", done.append, failed.append)

    def refuse() -> None:
        raise SceneError("no such file", where="a.glb")

    jobs.run("other", refuse, done.append, failed.append)
    qtbot.waitUntil(lambda: not jobs.is_busy, timeout=5000)
    qtbot.wait(200)
    assert done == ["new"]
    assert [str(error) for error in failed] == ["a.glb: no such file"]
    jobs.run("defect", lambda: 1 / 0, done.append, failed.append)
    qtbot.waitUntil(lambda: not jobs.is_busy, timeout=5000)
    assert "ZeroDivisionError" in str(failed[-1])
    jobs.close()


def test_events_call_their_observers() -> None:
    """Observers are called in order; one may leave while being called."""
    event: Event[[int]] = Event()
    calls: list[tuple[str, int]] = []

    def once(value: int) -> None:
        calls.append(("once", value))
        event.disconnect(once)

    event.connect(once)
    event.connect(lambda value: calls.append(("always", value)))
    event.emit(1)
    event.emit(2)
    assert calls == [("once", 1), ("always", 1), ("always", 2)]
    event.clear()
    event.emit(3)
    assert len(calls) == 3


def test_result_is_copied_whole_or_not_at_all(result_folder: Path, tmp_path: Path) -> None:
    """A copy opens like the original; a folder that holds something is left alone."""
    target = copy_result(result_folder, tmp_path / "kept" / "copy")
    assert load_result(target).settings == load_result(result_folder).settings
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "notes.txt").write_text("mine")
    with pytest.raises(StorageError, match="not empty"):
        copy_result(result_folder, tmp_path / "full")
    assert [entry.name for entry in (tmp_path / "full").iterdir()] == ["notes.txt"]


def test_result_folders_are_told_apart(tmp_path: Path) -> None:
    """Two scenes of the same name in different folders have different results."""
    first = default_result_folder(tmp_path / "a" / "level.glb", tmp_path)
    second = default_result_folder(tmp_path / "b" / "level.glb", tmp_path)
    assert first != second
    assert first.name.startswith("level-")
