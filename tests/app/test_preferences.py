"""Preferences: stored, checked, applied at once; room for results; mouse styles."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from PyQt6.QtCore import QEvent, QPoint, QPointF, QSettings, Qt
from PyQt6.QtGui import QMouseEvent
from PyQt6.QtTest import QTest
from PyQt6.QtWidgets import QApplication, QDialogButtonBox
from pytestqt.qtbot import QtBot
from settling import settle

from app.navigation import Navigation
from app.navigation_styles import STYLES, Motion
from app.parts.habits import HabitsPart
from app.parts.hints import HintsPart
from app.preferences import Preferences
from app.preferences_dialog import PreferencesDialog
from app.result_cache import cached_results, note_use, size_of, trim
from app.style import is_dark
from app.window import Window

PATIENCE_MS = 180_000
Button, Modifier = Qt.MouseButton, Qt.KeyboardModifier
gui = pytest.mark.gui


def test_preferences_come_back(store: QSettings) -> None:
    """What was stored is read; what makes no sense is as for a new user; defaults take no room."""
    wanted = Preferences(scheme="dark", navigation="maya", up_axis=2, threads=3, cache_mb=0, autosave_s=5)
    wanted.write(store)
    assert Preferences.read(store) == wanted
    for name, value in (("scheme", "pink"), ("navigation", 7), ("threads", "many"), ("undo_depth", -4)):
        store.setValue(f"preferences/{name}", value)
    read = Preferences.read(store)
    assert (read.scheme, read.navigation, read.threads, read.undo_depth) == ("", "obscura", 0, 0)
    Preferences().write(store)
    assert not [key for key in store.allKeys() if key.startswith("preferences")]


@gui
def test_changes_hold_at_once(window: Window, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each control of the dialog changes the window, without a button to confirm it."""
    monkeypatch.setenv("OBSCURA_THREADS", "")
    window.actions_by_id["preferences"].trigger()
    dialog = window.findChild(PreferencesDialog)
    assert dialog is not None
    dialog.scheme.setCurrentIndex(dialog.scheme.findData("dark"))
    assert is_dark(QApplication.palette())
    assert window.actions_by_id["dark-palette"].isChecked()
    dialog.navigation.setCurrentIndex(dialog.navigation.findData("blender"))
    assert window.area.main.navigation.style is STYLES["blender"]
    dialog.up_axis.setCurrentIndex(dialog.up_axis.findData(2))
    assert window.controller.up_axis == 2
    dialog.undo.setValue(5)
    assert window.bench.undo.undoLimit() == 5
    pid = window.engine.pid
    dialog.threads.setValue(1)
    assert os.environ["OBSCURA_THREADS"] == "1"
    assert window.engine.pid != pid
    qtbot.waitUntil(lambda: "MB in" in dialog._used.text(), timeout=PATIENCE_MS)
    buttons = dialog.findChild(QDialogButtonBox)
    assert buttons is not None
    defaults = buttons.button(QDialogButtonBox.StandardButton.RestoreDefaults)
    assert defaults is not None
    defaults.click()
    assert not window.actions_by_id["dark-palette"].isChecked()
    assert "OBSCURA_THREADS" not in os.environ
    dialog.close()


@gui
def test_preferences_apply_to_the_next_window(make_window: Callable[..., Window]) -> None:
    """A new window starts with what was set in the last one."""
    first = make_window()
    first.part(HabitsPart).change(navigation="maya", undo_depth=7)
    second = make_window()
    assert second.area.main.navigation.style is STYLES["maya"]
    assert second.bench.undo.undoLimit() == 7
    first.part(HabitsPart).set(Preferences())


@gui
def test_device_of_the_preferences_is_the_form_s(window: Window, qtbot: QtBot, level: Path) -> None:
    """A scene that names no device is baked on the preferred one."""
    window.part(HabitsPart).change(device="cpu")
    window.controller.open(level)
    qtbot.waitUntil(lambda: window.document.world is not None and window.controller.is_idle, timeout=PATIENCE_MS)
    settings = window.panels.bake.settings()
    assert settings is not None
    assert settings.device == "cpu"


@gui
@pytest.mark.parametrize("style", STYLES)
def test_mouse_styles_move_the_camera(shown: Window, style: str) -> None:
    """Every drag that a style names does what it says, and the table of the mouse lists it."""
    shown.part(HabitsPart).change(navigation=style)
    navigation, view = shown.area.main.navigation, shown.area.main.view
    middle = QPoint(view.width() // 2, view.height() // 2)
    for button, modifiers, motion in STYLES[style].drags:
        before = navigation.camera
        QTest.mousePress(view, button, modifiers, middle)
        _drag(navigation, button, modifiers)
        QTest.mouseRelease(view, button, modifiers, middle)
        after = navigation.camera
        assert after != before, (button, modifiers)
        turned = after.azimuth != before.azimuth
        moved = after.focal != before.focal
        assert (turned, moved) == {
            Motion.ORBIT: (True, False),
            Motion.PAN: (False, True),
            Motion.ZOOM: (False, False),
            Motion.LOOK: (True, True),
        }[motion]
    assert len(STYLES[style].gestures()) >= 5
    shown.part(HabitsPart).set(Preferences())


def _drag(navigation: Navigation, button: Qt.MouseButton, modifiers: Qt.KeyboardModifier) -> None:
    """Moves with modifiers, which the moves of Qt's test mouse do not have."""
    for step in (30.0, 60.0):
        position = navigation._last + QPointF(step, step / 2)
        navigation._on_move(QMouseEvent(QEvent.Type.MouseMove, position, position, button, button, modifiers))


@gui
def test_first_steps_are_dismissed_for_good(make_window: Callable[..., Window]) -> None:
    """A new user sees hints; once dismissed they come back only when asked for."""
    first = make_window()
    card = first.part(HintsPart).card
    assert card.isVisible()
    card.dismissed.emit()
    assert not card.isVisible()
    second = make_window()
    assert not second.part(HintsPart).card.isVisible()
    second.actions_by_id["hints"].trigger()
    settle()
    assert second.part(HintsPart).card.isVisible()


def _stored(folder: Path, age: int, size: int) -> Path:
    folder.mkdir(parents=True)
    (folder / "manifest.json").write_text('{"format": "obscura-result"}')
    (folder / "data.npy").write_bytes(bytes(size))
    os.utime(folder, (1_000_000 - age, 1_000_000 - age))
    return folder


def test_results_used_least_lately_go_first(tmp_path: Path) -> None:
    """Room is made by the oldest results; what is in view, and what is no result, stays."""
    old, middle, new = (_stored(tmp_path / "results" / f"r{age}", age, 1000) for age in (300, 200, 100))
    notes = tmp_path / "results" / "notes"
    notes.mkdir()
    assert cached_results(tmp_path) == [new, middle, old]
    assert trim(tmp_path, 2500, keep=[old]) == 1
    assert cached_results(tmp_path) == [new, old]
    note_use(old)
    assert cached_results(tmp_path) == [old, new]
    assert trim(tmp_path, 0) == 2
    assert notes.exists()
    assert cached_results(tmp_path / "nowhere") == []


def test_shared_files_count_once(tmp_path: Path) -> None:
    """Kept results share files with those in use; the room is that of the disk."""
    (tmp_path / "a").write_bytes(bytes(5000))
    os.link(tmp_path / "a", tmp_path / "b")
    assert size_of(tmp_path) == 5000
