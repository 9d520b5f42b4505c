"""Fixtures for tests of the window: a small baked level, a window over it, and the search for what it leaves behind."""

from __future__ import annotations

import multiprocessing
import shutil
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "viewer"))

import pyvistaqt  # noqa: F401 - sets the OpenGL format before any window
from PyQt6.QtCore import QSettings
from PyQt6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot
from region_bakes import bake_with_regions
from settling import settle
from small_level import bake_level, write_level

from app.document import default_result_folder
from app.engine_worker import Bake, bake_job
from app.window import Window
from bake.results import load_result
from bake.types import BakeResult

PATIENCE_MS = 180_000


@pytest.fixture(scope="session")
def level(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small level as a scene file."""
    return write_level(tmp_path_factory.mktemp("level"))


@pytest.fixture(scope="session")
def result_folder(level: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small level, baked for real."""
    return bake_level(level, tmp_path_factory.mktemp("baked") / "result")


@pytest.fixture(scope="session")
def regions_folder(level: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small level baked with regions."""
    return bake_with_regions(level, tmp_path_factory.mktemp("regions"))


@pytest.fixture(scope="session")
def baked(result_folder: Path) -> BakeResult:
    """The result of the small level, read back."""
    return load_result(result_folder)


@pytest.fixture
def store(tmp_path: Path) -> QSettings:
    """Habits of a new user, kept in a file of their own."""
    return QSettings(str(tmp_path / "habits.ini"), QSettings.Format.IniFormat)


@pytest.fixture
def make_window(qtbot: QtBot, tmp_path: Path, store: QSettings) -> Iterator[Callable[..., Window]]:
    """Makes windows; closes them afterwards and fails if one leaves a thread, a process or a widget behind."""
    windows: list[Window] = []

    def make(bake: Bake = bake_job) -> Window:
        window = Window(tmp_path / "cache", store, bake)
        windows.append(window)
        window.resize(1000, 700)
        window.show()
        qtbot.waitExposed(window)
        return window

    yield make
    for window in windows:
        window.close()
        window.deleteLater()
    windows.clear()
    settle()
    assert not [thread.name for thread in threading.enumerate() if thread.name == "engine-reader"]
    assert not [child.name for child in multiprocessing.active_children() if child.name == "obscura-engine"]
    assert not [widget for widget in QApplication.topLevelWidgets() if isinstance(widget, Window)]


@pytest.fixture
def window(make_window: Callable[..., Window]) -> Window:
    """An empty window."""
    return make_window()


def _opened(window: Window, qtbot: QtBot, result_folder: Path) -> Window:
    window.controller.open(result_folder)
    qtbot.waitUntil(lambda: window.document.result is not None, timeout=PATIENCE_MS)
    window.picker.finish()
    settle()
    return window


@pytest.fixture
def shown(window: Window, qtbot: QtBot, result_folder: Path) -> Window:
    """A window over the baked small level, ready to be picked in."""
    return _opened(window, qtbot, result_folder)


@pytest.fixture
def shown_regions(window: Window, qtbot: QtBot, regions_folder: Path) -> Window:
    """The same over the bake with regions."""
    return _opened(window, qtbot, regions_folder)


@pytest.fixture
def scene(level: Path, tmp_path: Path) -> Path:
    """A copy of the small level that may be edited."""
    folder = tmp_path / "own"
    shutil.copytree(level.parent, folder)
    return folder / level.name


@pytest.fixture
def opened(window: Window, qtbot: QtBot, scene: Path) -> Window:
    """A window over that copy and its result."""
    bake_level(scene, default_result_folder(scene, window.bench.cache))
    window.controller.open(scene)
    qtbot.waitUntil(lambda: window.document.result is not None and window.controller.is_idle, timeout=PATIENCE_MS)
    return window
