"""Takes a result's pictures in a process of its own, trying one way to draw off screen after the other."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

_log = logging.getLogger(__name__)
_ROOT = Path(__file__).resolve().parents[2]
_VARIABLE = "VTK_DEFAULT_OPENGL_WINDOW"
# EGL draws on a graphics card or in software, OSMesa in software only; both do without a display.
_WAYS = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")
_PATIENCE_S = 300.0


@dataclass(frozen=True, slots=True)
class Picture:
    """One view of the result at one distance.

    Attributes:
        view: Name of the viewpoint.
        distance: Label of the distance.
        jpeg: The file's content.
    """

    view: str
    distance: str
    jpeg: bytes


def take_pictures(result: Path) -> list[Picture]:
    """Pictures of a stored result; none if nothing on this machine can draw."""
    for way in _WAYS:
        with tempfile.TemporaryDirectory(prefix="obscura-") as folder:
            if run_off_screen(way, ["-m", "viewer.snapshot", str(result.resolve()), folder]):
                return _read(Path(folder))
    return []


def draw_off_screen(arguments: list[str]) -> bool:
    """Runs Python with VTK drawing off screen in whichever way works here; returns whether one did."""
    return any(run_off_screen(way, arguments) for way in _WAYS)


def run_off_screen(way: str, arguments: list[str], *, patience_s: float = _PATIENCE_S) -> bool:
    """Runs Python with VTK drawing off screen in a given way; returns whether it succeeded."""
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environment[_VARIABLE] = way
    try:
        done = subprocess.run(
            [sys.executable, *arguments], cwd=_ROOT, env=environment, capture_output=True, timeout=patience_s
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        _log.info("%s: %s", way, error)
        return False
    if done.returncode:
        _log.info("%s ended with %d: %s", way, done.returncode, done.stderr.decode(errors="replace")[-2000:])
    return done.returncode == 0


def _read(folder: Path) -> list[Picture]:
    index: list[dict[str, str]] = json.loads((folder / "index.json").read_text(encoding="utf-8"))
    return [Picture(item["view"], item["distance"], (folder / item["file"]).read_bytes()) for item in index]
