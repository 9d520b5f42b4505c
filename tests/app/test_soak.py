"""Many random actions, and many windows, leave nothing broken and nothing behind."""

from __future__ import annotations

import gc
import random
import weakref
from pathlib import Path

import pytest
from PyQt6.QtCore import QPoint, QPointF, QSettings, Qt
from PyQt6.QtTest import QTest
from PyQt6.QtWidgets import QMessageBox, QWidget
from pytestqt.qtbot import QtBot
from settling import settle
from vtkmodules.vtkCommonCore import vtkObjectBase

from app.window import Window

PATIENCE_MS = 30_000
DIALOGS = {"open-scene", "open-result", "save-result", "save-picture", "quit", "bake"}
"""Actions that wait for an answer, end the window or take long."""

pytestmark = pytest.mark.gui


def _poke(window: Window, dice: random.Random, actions: list[str]) -> None:
    view = window.area.main.view
    spot = QPoint(dice.randrange(view.width()), dice.randrange(view.height()))
    match dice.randrange(6):
        case 0:
            QTest.mouseClick(view, Qt.MouseButton.LeftButton, pos=spot)
        case 1:
            view.wheel_turned.emit(QPointF(spot), dice.choice([-2.0, 1.0, 3.0]))
        case 2:
            window.panels.overlays._slider.setValue(dice.randrange(1001))
        case 3:
            low = dice.random()
            window.panels.display._on_range(low, low + dice.random())
        case _:
            window.actions_by_id[dice.choice(actions)].trigger()


@pytest.mark.parametrize("seed", [1, 2])
def test_random_actions_raise_nothing(shown: Window, qtbot: QtBot, seed: int) -> None:
    """A seeded monkey clicks, zooms, slides and triggers actions; the window still reads values afterwards."""
    dice = random.Random(seed)
    actions = [name for name in shown.actions_by_id if name not in DIALOGS and name != "open-sample"]
    for _ in range(80):
        _poke(shown, dice, actions)
        if dice.random() < 0.2:
            qtbot.wait(5)
        for box in shown.findChildren(QMessageBox):
            box.close()
            box.deleteLater()
    qtbot.waitUntil(lambda: shown.controller.is_idle, timeout=PATIENCE_MS)
    assert shown.document.result is not None
    assert shown.isVisible()
    shown.commands.frame_all()


def test_windows_leave_nothing_behind(
    qapp: object, qtbot: QtBot, store: QSettings, tmp_path: Path, result_folder: Path
) -> None:
    """A closed window is freed, with every VTK object and widget of its own."""

    def cycle() -> weakref.ref[Window]:
        window = Window(tmp_path, store)
        window.show()
        qtbot.waitExposed(window)
        window.controller.open(result_folder)
        qtbot.waitUntil(lambda: window.document.result is not None, timeout=PATIENCE_MS)
        window.actions_by_id["compare"].trigger()
        qtbot.waitUntil(lambda: window.document.other is not None, timeout=PATIENCE_MS)
        window.actions_by_id["compare"].trigger()
        window.close()
        window.deleteLater()
        return weakref.ref(window)

    counts = []
    for _ in range(3):
        reference = cycle()
        counts.append(_counts())
        assert reference() is None
    assert counts[-1] == counts[1]


def _counts() -> tuple[int, int]:
    """VTK objects and widgets that Python holds."""
    for _ in range(3):
        settle()
        gc.collect()
    known = gc.get_objects()
    return (
        sum(isinstance(item, vtkObjectBase) for item in known),
        sum(isinstance(item, QWidget) for item in known),
    )
