"""Promises about the code itself."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
HEAVY = ("warp", "embreex", "open3d", "PyQt6", "pyvista", "vtkmodules", "matplotlib", "PIL", "trimesh")


@pytest.mark.parametrize("module", ["bake", "bake.pipeline", "bake.scene", "bake.results", "bake.trace", "bake.solve"])
def test_importing_the_engine_is_light(module: str) -> None:
    """In a fresh interpreter no module of the engine's surface loads Warp, Embree or a toolkit."""
    code = f"import sys, {module}; print([m for m in {HEAVY!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_files_can_be_read_in_one_sitting() -> None:
    """No source file is longer than 400 lines."""
    sources = [p for folder in ("app", "bake", "viewer", "assets") for p in (ROOT / folder).rglob("*.py")]
    long = {str(p.relative_to(ROOT)): n for p in sources if (n := len(p.read_text().splitlines())) > 400}
    assert sources
    assert not long
