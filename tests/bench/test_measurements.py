"""What every benchmark says about itself."""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

import pytest

from app.cli import main
from bake.bench.table import Measurements, bake_seed

ROOT = Path(__file__).resolve().parents[2]
MADE = [
    (path.relative_to(ROOT).as_posix(), node)
    for folder in ("bake", "app")
    for path in sorted((ROOT / folder).rglob("*.py"))
    if "Measurements(" in (text := path.read_text())
    for node in ast.walk(ast.parse(text))
    if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("Measurements", "_WithFigures")
]


def test_json_holds_machine_versions_and_seeds() -> None:
    """Every table says where it was measured, with what, and what decided what is random."""
    found = Measurements("t", [{"a": 1}], ["n"], seeds={"bake": 7}, settings={"rays": 4}).to_json()
    assert {"processor", "cores", "system", "python"} <= set(found["machine"])
    assert {"obscura", "numpy", "scipy", "warp-lang"} <= set(found["versions"])
    assert found["seeds"] == {"bake": 7}
    assert found["settings"] == {"rays": 4}
    json.dumps(found)


def test_no_table_goes_without_seeds() -> None:
    """They cannot be left out, and there are tables to hold that for."""
    untold: Any = Measurements
    with pytest.raises(TypeError, match="seeds"):
        untold("t", [])
    assert len(MADE) > 20


@pytest.mark.parametrize("call", [call for _, call in MADE], ids=[f"{where}:{call.lineno}" for where, call in MADE])
def test_every_table_names_a_seed(call: ast.Call) -> None:
    """An empty mapping stands only beside rows that say why nothing was measured."""
    seeds = next(item.value for item in call.keywords if item.arg == "seeds")
    assert not isinstance(seeds, ast.Dict) or seeds.keys or "skipped" in ast.unparse(call)


def test_the_seed_is_the_options_or_the_default() -> None:
    """As the command line gives it, or as settings have it."""
    assert bake_seed({"seed": "5"}) == 5
    assert bake_seed({}) == 1


@pytest.mark.slow
def test_printed_json_says_what_was_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    """The command's JSON has the subject, the scenes and the settings besides."""
    level = ROOT / "assets/sample_level/level.glb"
    main(["bench", "scenes", str(level), "--rays", "1", "--samples-per-face", "1:1", "--skip", "fog,trees,regions",
               "--mapping", "average", "--json"])  # fmt: skip
    told = json.loads(capsys.readouterr().out)
    assert {"machine", "versions", "seeds", "rows", "asked"} <= set(told)
    assert told["asked"]["subject"] == "scenes"
    assert told["asked"]["paths"] == ["level.glb"]
    assert told["asked"]["settings"]["rays"] == "1"
    assert told["seeds"] == {"bake": 1}
