"""The command line as users meet it, in this process or in one of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "results"))  # the synthetic results live there

from small_gltf import small_document, write_glb  # noqa: E402
from synthetic_results import build_result  # noqa: E402

from app import cli  # noqa: E402
from bake.results import save_result  # noqa: E402

Run = Callable[..., tuple[int, str, str]]
QUICK = ("--device", "cpu", "--rays", "8", "--samples-per-face", "2:4")


def in_process(*words: object, **variables: str) -> subprocess.CompletedProcess[str]:
    """Runs `main.py` in a process of its own, without a display."""
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY", "OBSCURA_DEBUG")}
    return subprocess.run(
        [sys.executable, str(ROOT / "main.py"), *map(str, words)],
        capture_output=True,
        text=True,
        timeout=120,
        env={**environment, **variables},
    )


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs a command line here; returns exit code, stdout and stderr."""
    monkeypatch.setattr(sys, "argv", ["main.py"])
    monkeypatch.delenv("OBSCURA_DEBUG", raising=False)

    def call(*words: object) -> tuple[int, str, str]:
        try:
            code = cli.main([str(word) for word in words])
        except SystemExit as end:  # --help and --version end by themselves
            code = int(end.code or 0)
        output = capsys.readouterr()
        return code, output.out, output.err

    return call


@pytest.fixture
def level(tmp_path: Path) -> Path:
    """A small glTF level."""
    document, binary = small_document()
    return write_glb(tmp_path / "level.glb", document, binary)


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    """A stored result of three small objects, from a scene that is not there."""
    save_result(build_result(), tmp_path / "stored")
    return tmp_path / "stored"
