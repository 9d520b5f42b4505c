"""`bake` end to end: the JSON contract, an unchanged scene, and Ctrl+C."""

from __future__ import annotations

import dataclasses
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import QUICK, ROOT, Run
from synthetic_results import build_result, same_results

from app.commands.summary import bake_summary, summary_text
from bake.results import load_result, save_result
from bake.types import Finding


def test_json_contract(tmp_path: Path, run: Run, level: Path) -> None:
    """`bake --json` prints one object with the fields that other tools read."""
    code, out, _ = run("bake", level, "-o", tmp_path / "result", "--json", *QUICK)
    assert (code, out.count("\n")) == (0, 1)
    summary = json.loads(out, parse_constant=lambda text: pytest.fail(text))
    result = load_result(tmp_path / "result")
    assert summary["result"] == str(tmp_path / "result")
    assert summary["rays"] == 8 * summary["samples"]["total"] == int(result.tally.rays.sum())
    assert summary["samples"]["total"] == len(result.samples) > 0
    assert summary["vertices"]["total"] == result.world.vertex_count
    assert {"filled", "unreferenced"} <= set(summary["vertices"])
    assert (summary["device"], summary["tracer"]) == ("cpu", "embree")
    assert summary["seconds"] > 0
    assert summary["mrays_per_s"] > 0
    assert summary["peak_memory_mb"] > 0
    assert summary["rays_skipped"] >= 0
    for stage in summary["stages"]:
        assert {"name", "status", "why", "seconds", "rays"} <= set(stage)
        assert stage["status"] in ("ran", "skipped")
        assert stage["status"] == "ran" or stage["why"]
    assert all({"object", "what", "count"} <= set(warning) for warning in summary["warnings"])


def test_an_unchanged_scene_is_not_traced(tmp_path: Path, run: Run, level: Path) -> None:
    """The second bake traces nothing and says so; a changed setting or file traces again."""
    words = ("bake", level, "-o", tmp_path / "result", *QUICK)
    assert run(*words)[0] == 0
    first = load_result(tmp_path / "result")
    again = json.loads(run(*words, "--json")[1])
    assert (again["unchanged"], again["rays"], again["mrays_per_s"]) == (True, 0, 0.0)
    assert {stage["status"] for stage in again["stages"]} == {"skipped"}
    assert all("unchanged" in stage["why"] for stage in again["stages"])
    assert "nothing was traced" in run(*words)[1]
    assert same_results(load_result(tmp_path / "result"), first)
    assert json.loads(run(*words, "--seed", "2", "--json")[1])["rays"] > 0
    level.with_name("level.glb.obscura.toml").write_text("[bake]\nalpha = 0.5\n")
    assert json.loads(run(*words, "--seed", "2", "--json")[1])["unchanged"] is False


def test_the_same_seed_gives_the_same_bits(tmp_path: Path, run: Run, level: Path) -> None:
    """Two bakes into two folders store the same arrays, file by file."""
    for name in ("a", "b"):
        assert run("bake", level, "-o", tmp_path / name, *QUICK)[0] == 0
    names = [sorted(path.name for path in (tmp_path / name).glob("*.npy")) for name in ("a", "b")]
    assert names[0] == names[1]


def test_a_damaged_result_is_baked_again(tmp_path: Path, run: Run, level: Path) -> None:
    """Damage does not pass for an unchanged result."""
    words = ("bake", level, "-o", tmp_path / "result", *QUICK, "--json")
    run(*words)
    path = next((tmp_path / "result").glob("field_ao-*.npy"))
    path.write_bytes(path.read_bytes()[:-4])
    assert json.loads(run(*words)[1])["unchanged"] is False
    load_result(tmp_path / "result")


def test_the_summary_for_people(tmp_path: Path, run: Run, level: Path) -> None:
    """Without --json a table of stages and the main figures are printed."""
    _, out, _ = run("bake", level, "-o", tmp_path / "result", *QUICK)
    for word in ("trace", "skipped", "vertices", "samples", "Mrays/s", "AO        300 m"):
        assert word in out


@pytest.mark.skipif(os.name == "nt", reason="needs signals")
def test_ctrl_c(tmp_path: Path, level: Path) -> None:
    """Ctrl+C while tracing ends with code 130 and leaves the old result as it was."""
    folder = tmp_path / "result"
    old = build_result()
    save_result(old, folder)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    words = ["bake", str(level), "-o", str(folder), "--device", "cpu", "--rays", "65535"]
    samples = ["--samples-per-face", "4000:4096", "--sample-spacing", "0.001"]
    with subprocess.Popen(
        [sys.executable, str(ROOT / "main.py"), *words, *samples], stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        lines: list[str] = []
        for line in process.stderr:
            lines.append(line)
            if line.startswith("trace"):
                process.send_signal(signal.SIGINT)
                break
        lines += process.stderr.readlines()
    assert process.returncode == 130, lines
    assert lines[-1] == "obscura: cancelled\n"
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_summary_of_a_result() -> None:
    """Counts come from the arrays, and text and JSON cope with findings and empty results."""
    result = build_result()
    summary = bake_summary(result, Path("r"), 1.5)
    assert summary["vertices"] == {"total": 15, "filled": 1, "unreferenced": 3, "not_baked": 0}
    assert summary["samples"]["invalid"] == int((~result.tally.valid(0.25)).sum())
    assert summary["rays"] == 16 * len(result.samples)
    assert summary["mrays_per_s"] == pytest.approx(summary["rays"] / 0.5 / 1e6)
    assert summary["warnings"][0]["object"] == "Yard/Fässer/barrel#0"
    many = tuple(Finding("a", f"what-{i}", i, "") for i in range(20))
    assert "12 more" in summary_text(dataclasses.replace(result, findings=many), Path("r"), 1.0)
    empty = build_result(objects=0)
    json.dumps(bake_summary(empty, Path("r"), 0.0), allow_nan=False)
    assert summary_text(empty, Path("r"), 0.0)
