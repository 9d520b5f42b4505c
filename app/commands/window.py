"""No command: the window, or without a display the sample level baked to a page that any browser shows."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from app.commands.console import note, say
from bake.errors import InputError

_ROOT = Path(__file__).resolve().parents[2]
SAMPLE_LEVEL = _ROOT / "assets" / "sample_level" / "level.glb"
_SAMPLE_RESULT = _ROOT / "results" / "sample_level"


def has_display() -> bool:
    """Whether a window could open; only Linux is ever without."""
    if not sys.platform.startswith("linux"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def run_window(path: Path | None) -> int:
    """Opens the window on a scene or a result, or on the sample level.

    Raises:
        InputError: the path is no result, or there is no display to show it on.
    """
    if path is not None and path.is_dir():
        from bake.results import read_manifest

        read_manifest(path)
    if has_display():
        from app.window import open_window

        return open_window(path)
    if path is not None:
        raise InputError(
            "no display to open a window on", where=str(path), remedy="use the commands bake, export and report"
        )
    return _bake_sample_level()


def _bake_sample_level() -> int:
    from app.commands.progress import drive
    from app.commands.report import write_report
    from app.commands.summary import summary_text
    from bake.pipeline import BakeRequest, run_bake

    note("no display: baking the sample level without a window")
    outcome = drive(run_bake(BakeRequest(SAMPLE_LEVEL, _SAMPLE_RESULT)))
    say(summary_text(outcome.result, _SAMPLE_RESULT, outcome.seconds, unchanged=outcome.unchanged))
    page = _SAMPLE_RESULT.with_suffix(".html")
    write_report(_SAMPLE_RESULT, page)
    say(f"\nThe result, with pictures: {page}")
    return 0
