"""`doctor`: what is missing comes with the command that mends it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from conftest import Run

from app.commands import checks
from app.commands.checks import MISSING, OK, OPTIONAL, Check


def test_the_checks_of_this_machine(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """The machine that runs the tests has Python, the libraries, Embree and the sample level."""
    monkeypatch.setattr(checks, "run_off_screen", lambda *_, **__: True)  # the report's tests really draw
    code, out, _ = run("doctor", "--json")
    answer = json.loads(out)
    by_name = {check["name"]: check for check in answer["checks"]}
    for name in ("Python", "numpy", "warp-lang", "Embree", "sample level"):
        assert by_name[name]["status"] == OK, by_name[name]
    assert code == (0 if answer["ok"] else 1)
    assert "display" in by_name


def test_a_missing_thing(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """Something missing gives exit code 1 and its remedy; something optional does not."""
    found = [Check("a", OK, "here"), Check("b", OPTIONAL, "not here", "get b")]
    monkeypatch.setattr(checks, "run_checks", lambda: iter(found))
    code, out, _ = run("doctor")
    assert code == 0
    assert "→ get b" in out
    found.append(Check("c", MISSING, "not here", "get c"))
    code, out, _ = run("doctor")
    assert code == 1
    assert "→ get c" in out


def test_each_way_of_lacking(monkeypatch: pytest.MonkeyPatch) -> None:
    """Libraries, drivers, displays and drawing that do not work are each named with a command."""
    monkeypatch.setattr(checks, "_loads", lambda library: "xcb" not in library)
    monkeypatch.setattr(checks, "run_off_screen", lambda *_, **__: False)
    monkeypatch.setattr(checks, "has_display", lambda: False)
    monkeypatch.setattr(checks, "_has_nvidia_card", lambda: True)
    monkeypatch.setattr(checks, "_ask", lambda code: ([], "") if code == checks._DEVICES else (None, "boom"))
    monkeypatch.setattr(checks.shutil, "which", lambda program: program if program == "apt-get" else None)
    monkeypatch.setattr(checks, "SAMPLE_LEVEL", Path("/nowhere.glb"))
    found = {check.name: check for check in checks.run_checks()}
    assert "libxcb-cursor0" in found["shared libraries"].remedy
    assert found["shared libraries"].remedy.startswith("sudo apt-get install -y ")
    assert found["CUDA device"].status == OPTIONAL
    assert "nvidia-driver" in found["CUDA device"].remedy
    assert (found["Embree"].status, found["Embree"].remedy) == (MISSING, "make setup")
    assert found["off-screen OpenGL"].remedy == "sudo apt-get install -y libegl1 libosmesa6"
    assert found["display"].remedy == "sudo apt-get install -y xvfb"
    assert found["sample level"].status == MISSING


def test_other_systems(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each system gets its own installer, and none gets no command."""
    for program, start in (("dnf", "sudo dnf install -y x"), ("pacman", "sudo pacman -S --needed y"), ("", "")):
        monkeypatch.setattr(checks.shutil, "which", lambda name, wanted=program: name if name == wanted else None)
        assert checks.installing("w", "x", "y") == start
