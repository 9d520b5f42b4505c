"""Many random actions, and many windows, leave nothing broken and nothing behind."""

from __future__ import annotations

import gc
import logging
import os
import statistics
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
from small_level import bake_level
from vtkmodules.vtkCommonCore import vtkObjectBase

from app.document import default_result_folder
from app.parts.explain import ExplainPart
from app.window import Window
from bake.results import load_result
from viewer.picking import Pick

PATIENCE_MS = 180_000
MEMORY = "memory, MiB"
GROWTH = 0.05
WARM = 10
"""Windows after which all libraries are loaded."""

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


def _cycle(folder: Path, store: QSettings, qtbot: QtBot, scene: Path) -> weakref.ref[Window]:
    """A short life of a window: open, bake, explain, compare, select, undo, look at dialogs, close."""
    window = Window(folder, store)
    window.show()
    qtbot.waitExposed(window)
    window.controller.open(scene)
    qtbot.waitUntil(lambda: window.document.result is not None and window.controller.is_idle, timeout=PATIENCE_MS)
    actions = window.actions_by_id
    with qtbot.waitSignal(window.controller.bake_ended, timeout=PATIENCE_MS):
        actions["bake"].trigger()
    qtbot.waitUntil(lambda: window.controller.is_idle, timeout=PATIENCE_MS)
    world = window.document.world
    assert world is not None
    x, y, z = world.positions[world.faces[0]].mean(axis=0)
    window.readouts.click(Pick(0, (1 / 3, 1 / 3, 1 / 3), (float(x), float(y), float(z)), 1.0))
    with qtbot.waitSignal(window.part(ExplainPart).live.explained, timeout=PATIENCE_MS):
        actions["explain"].trigger()
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
        "threads": sum(not thread.name.startswith("parts") for thread in threading.enumerate()),  # those stay
    }
    if sys.platform == "linux":
        counts["files"] = len(os.listdir("/proc/self/fd"))
        resident = int(Path("/proc/self/statm").read_text().split()[1])
        counts[MEMORY] = resident * os.sysconf("SC_PAGE_SIZE") // 2**20
    return counts


def _live(times: int, folder: Path, store: QSettings, qtbot: QtBot, scene: Path) -> None:
    seen = []
    bake_level(scene, default_result_folder(scene, folder))
    for _ in range(times):
        reference = _cycle(folder, store, qtbot, scene)
        seen.append(_counts())
        logger.info("%s", seen[-1])
        assert reference() is None
    memory = [counts.pop(MEMORY, 0) for counts in seen]  # the allocator gives some back, some not: looked at apart
    assert {name: (seen[1][name], count) for name, count in seen[-1].items() if count > seen[1][name]} == {}
    if times >= 2 * WARM:
        before, after = statistics.median(memory[5:WARM]), statistics.median(memory[-5:])
        assert after <= before * (1.0 + GROWTH)


def test_windows_leave_nothing_behind(
    qapp: object, qtbot: QtBot, store: QSettings, tmp_path: Path, scene: Path
) -> None:
    """A closed window is freed, with every VTK object, widget, thread and file of its own."""
    _live(3, tmp_path, store, qtbot, scene)


@pytest.mark.slow
def test_fifty_windows_leave_nothing_behind(
    qapp: object, qtbot: QtBot, store: QSettings, tmp_path: Path, scene: Path
) -> None:
    """The same fifty times over, with memory that grows by no more than a twentieth once all is loaded."""
    _live(50, tmp_path, store, qtbot, scene)
