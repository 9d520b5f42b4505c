"""Export from the window, and the command lines of its jobs."""

from __future__ import annotations

import logging
import shlex
from pathlib import Path

import numpy as np
import pytest
from PyQt6.QtCore import QPoint, QPointF, Qt
from PyQt6.QtTest import QTest
from PyQt6.QtWidgets import QApplication, QMenu
from pytestqt.qtbot import QtBot

from app.cli import main
from app.parts.export import ExportPart
from app.window import Window
from bake.types import BakeResult

PATIENCE_MS = 180_000
pytestmark = pytest.mark.gui


def _clipboard() -> list[str]:
    clipboard = QApplication.clipboard()
    assert clipboard is not None
    words = shlex.split(clipboard.text())
    assert words[:2] == ["python", "main.py"]
    return words[2:]


def _pin(window: Window) -> None:
    window.commands.select_path("Crate")
    bounds = window.document.object_bounds(window.document.selected)
    assert bounds is not None
    window.area.main.frame(*bounds, fly=False)
    view = window.area.main.view
    window.readouts.click(window.area.main.pick_at(QPointF(view.width() / 2, view.height() / 2)))


def test_export_writes_the_file_and_offers_its_command(
    shown: Window, qtbot: QtBot, tmp_path: Path, baked: BakeResult
) -> None:
    """The numbers in the file are those in view; the command line that is offered writes the same file."""
    target = tmp_path / "out.npz"
    shown.part(ExportPart).export(target)
    qtbot.waitUntil(lambda: "Exported to" in shown.banner.text(), timeout=PATIENCE_MS)
    np.testing.assert_array_equal(np.load(target)["ao"], np.where(np.isnan(baked.field.ao), 1.0, baked.field.ao))
    content = target.read_bytes()
    shown.banner._choices[0].click()
    words = _clipboard()
    assert words == ["export", str(shown.document.result_path), str(target)]
    target.unlink()
    assert main(words) == 0
    assert target.read_bytes() == content
    shown.part(ExportPart).export(tmp_path / "missing" / "out.npz")
    qtbot.waitUntil(lambda: shown.banner.level == logging.ERROR, timeout=PATIENCE_MS)


def test_commands_of_the_jobs_run(shown: Window, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """What is copied for the clicked point is understood by the command line, and means that point."""
    assert not shown.actions_by_id["copy-explain"].isEnabled()
    _pin(shown)
    shown.actions_by_id["copy-explain"].trigger()
    words = _clipboard()
    assert words[:2] == ["explain", str(shown.document.result_path)]
    assert main(words) == 0
    assert "Crate" in capsys.readouterr().out
    shown.actions_by_id["copy-report"].trigger()
    assert _clipboard()[0] == "report"
    assert not shown.actions_by_id["copy-walk"].isEnabled()


def test_right_click_asks_what_to_do(shown: Window) -> None:
    """A click of the right button selects what is under it and opens a menu; a drag looks around instead."""
    _pin(shown)
    crate, view = shown.document.selected, shown.area.main.view
    shown.document.select(-1)
    middle = QPoint(view.width() // 2, view.height() // 2)
    QTest.mouseClick(view, Qt.MouseButton.RightButton, pos=middle)
    popup = QApplication.activePopupWidget()
    assert isinstance(popup, QMenu)
    assert shown.document.selected == crate
    assert shown.actions_by_id["hide"] in popup.actions()
    popup.close()
    QTest.mousePress(view, Qt.MouseButton.RightButton, pos=middle)
    QTest.mouseMove(view, middle + QPoint(40, 0))
    QTest.mouseRelease(view, Qt.MouseButton.RightButton, pos=middle + QPoint(40, 0))
    assert QApplication.activePopupWidget() is None
