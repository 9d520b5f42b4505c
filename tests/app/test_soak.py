"""Many random actions, and many windows, leave nothing broken and nothing behind."""

from __future__ import annotations

import gc
import logging
import os
import sys
import threading
import time
import weakref
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from monkey import Monkey
from PyQt6.QtCore import QObject, QSettings
from PyQt6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot
from settling import settle
from vtkmodules.vtkCommonCore import vtkObjectBase

from app.window import Window
from bake.results import load_result

PATIENCE_MS = 60_000

logger = logging.getLogger(__name__)

pytestmark = pytest.mark.gui


def _let_loose(window: Window, qtbot: QtBot, seed: int, count: int) -> None:
    """Lets a monkey do many things, then looks whether the window still works."""
    monkey = Monkey(window, seed)
    took: defaultdict[str, list[float]] = defaultdict(list)
    for _ in range(count):
        begin = time.perf_counter()
        monkey.act()
        settle()
        took[monkey.done[-1]].append(time.perf_counter() - begin)
    monkey.stop()
    for name, seconds in sorted(took.items(), key=lambda item: -sum(item[1])):
        logger.info("%s: %d times, %.2f s, longest %.2f s", name, len(seconds), sum(seconds), max(seconds))
    window.controller.cancel()
    qtbot.waitUntil(lambda: window.controller.is_idle and not window.bench.jobs.is_busy, timeout=PATIENCE_MS)
    assert len(monkey.done) == count
    assert window.isVisible()
    if window.document.result is None:  # it was undone
        window.actions_by_id["redo"].trigger()
        qtbot.waitUntil(lambda: window.document.result is not None, timeout=PATIENCE_MS)
    path = window.document.result_path
    assert path is not None
    assert window.document.result is not None
    stored = load_result(path, verify=True)
    np.testing.assert_array_equal(stored.field.ao, window.document.result.field.ao)


@pytest.mark.parametrize("seed", [1, 2])
def test_random_actions_raise_nothing(opened: Window, qtbot: QtBot, seed: int) -> None:
    """A seeded monkey over all actions, mouse and lists; what is in view is afterwards what is stored."""
    _let_loose(opened, qtbot, seed, 100)


@pytest.mark.slow
def test_ten_thousand_random_actions_raise_nothing(opened: Window, qtbot: QtBot) -> None:
    """The same for long."""
    _let_loose(opened, qtbot, 3, 10_000)


def _cycle(folder: Path, store: QSettings, qtbot: QtBot, result_folder: Path) -> weakref.ref[Window]:
    """A short life of a window: open, compare, select, undo, look at dialogs, close."""
    window = Window(folder, store)
    window.show()
    qtbot.waitExposed(window)
    window.controller.open(result_folder)
    qtbot.waitUntil(lambda: window.document.result is not None, timeout=PATIENCE_MS)
    actions = window.actions_by_id
    actions["compare"].trigger()
    qtbot.waitUntil(lambda: window.document.other is not None, timeout=PATIENCE_MS)
    actions["compare"].trigger()
    for name in ("select-all", "hide", "undo", "palette", "preferences", "shortcuts", "layout-compare", "reset-layout"):
        actions[name].trigger()
        settle()
    for dialog in window.findChildren(QWidget):
        if dialog.isWindow() and dialog.isVisible():
            dialog.close()
    window.close()
    window.deleteLater()
    return weakref.ref(window)


def _counts() -> dict[str, int]:
    """What Python and the system hold for this process."""
    for _ in range(3):
        settle()
        gc.collect()
    known = gc.get_objects()
    counts = {
        "VTK objects": sum(isinstance(item, vtkObjectBase) for item in known),
        "widgets": sum(isinstance(item, QWidget) for item in known),
        "Qt objects": sum(isinstance(item, QObject) for item in known),
        "threads": threading.active_count(),
    }
    if sys.platform == "linux":
        counts["files"] = len(os.listdir("/proc/self/fd"))
    return counts


def _live(times: int, folder: Path, store: QSettings, qtbot: QtBot, result_folder: Path) -> None:
    seen = []
    for _ in range(times):
        reference = _cycle(folder, store, qtbot, result_folder)
        seen.append(_counts())
        assert reference() is None
    warm = seen[1]
    assert {name: count - warm[name] for name, count in seen[-1].items() if count > warm[name]} == {}


def test_windows_leave_nothing_behind(
    qapp: object, qtbot: QtBot, store: QSettings, tmp_path: Path, result_folder: Path
) -> None:
    """A closed window is freed, with every VTK object, widget, thread and file of its own."""
    _live(5, tmp_path, store, qtbot, result_folder)


@pytest.mark.slow
def test_fifty_windows_leave_nothing_behind(
    qapp: object, qtbot: QtBot, store: QSettings, tmp_path: Path, result_folder: Path
) -> None:
    """The same fifty times over."""
    _live(50, tmp_path, store, qtbot, result_folder)
