"""No command: the window, or a page where there is no display."""

from __future__ import annotations

import sys
import types
from pathlib import Path

import pytest
from conftest import Run

from app.commands import pictures, window
from bake.results import load_result


@pytest.fixture
def without_display(monkeypatch: pytest.MonkeyPatch) -> None:
    """A Linux machine without a display."""
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)


@pytest.mark.usefixtures("without_display")
def test_a_scene_without_a_display(run: Run, level: Path) -> None:
    """A scene cannot be shown, but the commands are named."""
    code, out, err = run(level)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "no display" in err


@pytest.mark.usefixtures("without_display")
def test_the_sample_level_without_a_display(
    run: Run, level: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without an argument the sample level becomes a result and a page."""
    monkeypatch.setattr(window, "SAMPLE_LEVEL", level)
    monkeypatch.setattr(window, "_SAMPLE_RESULT", tmp_path / "results" / "sample_level")
    monkeypatch.setattr(pictures, "run_off_screen", lambda *_: False)
    code, out, err = run()
    assert code == 0
    assert load_result(tmp_path / "results" / "sample_level").tally.rays.sum() > 0
    assert (tmp_path / "results" / "sample_level.html").is_file()
    assert "sample_level.html" in out
    assert "no display" in err


@pytest.mark.parametrize("given", ["nothing", "scene", "result"])
def test_the_window_gets_the_path(
    run: Run, level: Path, stored: Path, monkeypatch: pytest.MonkeyPatch, given: str
) -> None:
    """With a display the window opens on what was given, and its exit code is ours."""
    opened: list[Path | None] = []

    def open_window(path: Path | None) -> int:
        opened.append(path)
        return 5

    stand_in = types.ModuleType("app.window")
    stand_in.open_window = open_window  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "app.window", stand_in)
    monkeypatch.setenv("DISPLAY", ":7")
    path = {"nothing": None, "scene": level, "result": stored}[given]
    assert run(*([] if path is None else [path]))[0] == 5
    assert opened == [path]
