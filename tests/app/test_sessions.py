"""Autosave, recovery after a crash, and pages for a review."""

from __future__ import annotations

import dataclasses
import json
import logging
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PyQt6.QtCore import QPointF
from PyQt6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot
from settling import settle

from app.banner import Banner
from app.defects import reported_defects
from app.parts.habits import HabitsPart
from app.parts.review import ReviewPart
from app.parts.session import SessionPart
from app.plain import from_plain, to_plain
from app.session import Session, SessionFile, is_running
from app.window import Window
from viewer.camera import Camera
from viewer.display import Display
from viewer.fields import Quantity
from viewer.tone import RemapCurve

PATIENCE_MS = 180_000
gui = pytest.mark.gui

_NUMBERS = st.floats(-1e6, 1e6)


@given(
    st.builds(
        Session,
        scene=st.text(),
        camera=st.builds(Camera, focal=st.tuples(_NUMBERS, _NUMBERS, _NUMBERS), up_axis=st.integers(0, 2)),
        display=st.builds(
            Display,
            quantity=st.sampled_from(Quantity),
            low=st.one_of(st.none(), _NUMBERS),
            edges=st.booleans(),
            curve=st.builds(RemapCurve, exponent=st.floats(0.2, 5.0)),
        ),
        selected=st.lists(st.text(), max_size=3).map(tuple),
    )
)
def test_sessions_survive_json(session: Session) -> None:
    """Whatever a session holds comes back from its file."""
    assert from_plain(Session, json.loads(json.dumps(to_plain(session)))) == session


@given(
    st.recursive(
        st.none() | st.booleans() | st.floats() | st.text(),
        lambda inner: (
            st.lists(inner)
            | st.dictionaries(st.sampled_from(["scene", "camera", "display", "focal", "quantity", "selected"]), inner)
        ),
    )
)
def test_nonsense_becomes_a_new_session(data: object) -> None:
    """A file of another version, or one that somebody wrote, never makes an error."""
    session = from_plain(Session, data)
    assert isinstance(session.camera, Camera)
    assert isinstance(session.scene, str)


def _dead_pid() -> int:
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def _leave(cache: Path, session: Session, pid: int) -> None:
    """Puts a session aside as a process that has crashed since would have."""
    file = SessionFile(cache)
    file.write(session)
    file._path.rename(file._path.with_name(f"{pid}-0.session.json"))


def test_only_sessions_of_dead_processes_are_offered(tmp_path: Path) -> None:
    """The latest of them is; a session that still runs, and one that ended well, are not."""
    file = SessionFile(tmp_path)
    file.write(Session(scene="mine"))
    assert file.take_left() is None
    file.remove()
    pid = _dead_pid()
    assert not is_running(pid)
    _leave(tmp_path, Session(scene="left"), pid)
    (tmp_path / "sessions" / f"{pid}-9.session.json").write_text("{broken")
    left = file.take_left()
    assert left is not None
    assert left.scene == "left"
    assert file.take_left() is None


@gui
def test_a_crashed_session_is_restored(
    make_window: Callable[..., Window], qtbot: QtBot, result_folder: Path, tmp_path: Path
) -> None:
    """What was open is offered, and comes back with camera, selection, visibility, display, settings and panels."""
    first = make_window()
    first.controller.open(result_folder)
    qtbot.waitUntil(lambda: first.document.result is not None, timeout=PATIENCE_MS)
    document = first.document
    document.set_display(document.display.replaced(quantity=Quantity.DISTANCE, column=1, edges=True))
    document.select_all((0, 2), 2)
    visible = document.visible.copy()
    visible[1] = False
    document.set_visible(visible)
    camera = dataclasses.replace(first.area.main.camera, azimuth=1.25)
    first.area.main.set_camera(camera)
    first.panels.bake.form.editor("rays").set_value(12)
    first.docks["Log"].hide()
    first.part(SessionPart).save()
    qtbot.waitUntil(lambda: not first.bench.jobs.is_busy, timeout=PATIENCE_MS)
    stored = next((tmp_path / "cache" / "sessions").iterdir())
    crashed = stored.with_name(f"{_dead_pid()}-0.session.json")
    shutil.copy(stored, crashed)
    first.close()
    assert not stored.exists()

    second = make_window()
    assert second.part(SessionPart).offer(lambda: None)
    assert not crashed.exists()
    settle()
    buttons = {button.text(): button for button in second.banner.findChildren(QPushButton) if button.isVisible()}
    assert set(buttons) == {"Restore", "Start afresh"}
    buttons["Restore"].click()
    qtbot.waitUntil(lambda: second.document.selection == (0, 2), timeout=PATIENCE_MS)
    assert second.document.selected == 2
    assert second.document.display == document.display
    assert not second.document.visible[1]
    assert second.area.main.camera == camera
    settings = second.panels.bake.settings()
    assert settings is not None
    assert settings.rays == 12
    assert second.docks["Log"].isHidden()
    assert not second.banner.isVisible()


@gui
def test_sessions_are_put_aside_by_themselves(window: Window, qtbot: QtBot, result_folder: Path) -> None:
    """With something open the session is written every so often, and never if that is what the user prefers."""
    folder = window.bench.cache / "sessions"
    window.part(HabitsPart).change(autosave_s=0)
    window.controller.open(result_folder)
    qtbot.waitUntil(lambda: window.document.result is not None, timeout=PATIENCE_MS)
    qtbot.wait(1500)
    assert not folder.exists()
    window.part(HabitsPart).change(autosave_s=1)
    qtbot.waitUntil(lambda: folder.exists() and bool(list(folder.glob("*.json"))), timeout=PATIENCE_MS)
    window.close()
    assert not list(folder.glob("*.json"))


@gui
def test_a_question_goes_with_its_answer(qtbot: QtBot) -> None:
    """A message takes the place of a question, buttons and all."""
    banner, told = Banner(), []
    qtbot.addWidget(banner)
    banner.ask("Really?", {"Yes": lambda: told.append("yes"), "No": lambda: told.append("no")})
    banner._choices[1].click()
    assert told == ["no"]
    assert banner.isHidden()
    banner.ask("Again?", {"Yes": lambda: None})
    banner.show_message(logging.INFO, "done")
    assert banner._choices == []
    assert banner.text() == "done"


@gui
def test_defects_are_shown_and_do_not_end_the_program(qtbot: QtBot) -> None:
    """An error in a slot is logged and shown in a line."""
    banner = Banner()
    qtbot.addWidget(banner)
    former = sys.excepthook
    with reported_defects(banner):
        try:
            raise ZeroDivisionError("by nought")
        except ZeroDivisionError:
            sys.excepthook(*sys.exc_info())  # type: ignore[arg-type]
    assert sys.excepthook is former
    assert "ZeroDivisionError: by nought" in banner.text()
    assert banner.level == logging.ERROR


@gui
def test_review_page_has_the_view_and_the_kept_point(shown: Window, qtbot: QtBot, tmp_path: Path) -> None:
    """The page leads with the picture in view, what was clicked and what is selected, and holds the report."""
    view = shown.area.main.view
    shown.commands.select_path("Crate")
    bounds = shown.document.object_bounds(shown.document.selected)
    assert bounds is not None
    shown.area.main.frame(*bounds, fly=False)
    pick = shown.area.main.pick_at(QPointF(view.width() / 2, view.height() / 2))
    shown.readouts.click(pick)
    target = tmp_path / "review.html"
    shown.part(ReviewPart).save(target, with_pictures=False)
    qtbot.waitUntil(lambda: "Review page saved" in shown.banner.text(), timeout=PATIENCE_MS)
    text = target.read_text()
    assert text.index("For review") < text.index("data:image/jpeg") < text.index("Darkest objects")
    assert "Crate" in text[: text.index("Darkest objects")]
    shown.part(ReviewPart).save(tmp_path / "missing" / "review.html", with_pictures=False)
    qtbot.waitUntil(lambda: shown.banner.level == logging.ERROR, timeout=PATIENCE_MS)
