"""`walk RESULT` as users meet it."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import QUICK, ROOT, Run

sys.path.insert(0, str(ROOT / "tests" / "walk"))  # the two rooms live there

from two_rooms import write_two_rooms

from app import cli

COLUMNS = ["time_s", "x", "y", "z", "region", "raw", "regularised", "blended", "spatial", "truth"]


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A baked result of two rooms with a region each."""
    folder = tmp_path_factory.mktemp("rooms")
    scene, regions = write_two_rooms(folder)
    words = ("--regions", str(regions), "--region-directions", "64", "--distances", "2,300")
    assert cli.main(["bake", str(scene), "-o", str(folder / "result"), *QUICK, *words]) == 0
    return folder / "result"


def test_a_tour_as_table_csv_and_plot(walked: Path, tmp_path: Path, run: Run) -> None:
    """Without a path it tours both rooms, says how each variant did, and writes a row a frame."""
    files = ("--csv", tmp_path / "walk.csv", "--plot", tmp_path / "walk.png")
    code, out, _ = run("walk", walked, "--distance", "2", "--normal", "-1,0,0", "--fps", "30", *files)
    assert code == 0
    assert "tour of 2 of 2 regions" in out
    for variant in ("raw", "regularised", "blended", "spatial", "spatial+blended", "truth"):
        assert f"\n{variant} " in out
    rows = list(csv.DictReader((tmp_path / "walk.csv").read_text().splitlines()))
    assert list(rows[0]) == COLUMNS
    assert [row["region"] for row in rows][:: len(rows) - 1] == ["west", "east"]
    assert np.diff([float(row["time_s"]) for row in rows]) == pytest.approx(1 / 30, abs=2e-6)
    assert all(0.0 <= float(row[name]) <= 1.0 for row in rows for name in COLUMNS[5:9])
    assert all(0.0 < float(row["y"]) < 3.0 for row in rows)
    assert (tmp_path / "walk.png").read_bytes()[:4] == b"\x89PNG"


def test_json_holds_pops_and_figures(walked: Path, tmp_path: Path, run: Run) -> None:
    """The pops are objects of the fields that other tools read; without truth nothing is compared."""
    (tmp_path / "path.json").write_text("[[1, 1, 3], [7, 1, 3]]")
    code, out, _ = run("walk", walked, "--path", tmp_path / "path.json", "--no-truth", "--json")
    assert code == 0
    found = json.loads(out)
    assert found["length_m"] == pytest.approx(6.0)
    assert found["frames"] == 241
    assert found["truth"] is None
    assert found["visited"] is None
    assert {row["variant"] for row in found["variants"]} == {
        "raw", "regularised", "blended", "spatial", "spatial+blended",
    }  # fmt: skip
    for pop in found["pops"]:
        assert {"time_s", "a", "b", "step", "codes", "variant"} <= pop.keys()
        assert {pop["a"], pop["b"]} <= {"west", "east"}


def test_a_result_without_regions_is_refused(stored: Path, run: Run) -> None:
    """One line says how to get regions."""
    code, out, err = run("walk", stored)
    assert code == 2
    assert not out
    assert "--regions auto" in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    "words",
    [
        ("--distance", "5"),
        ("--normal", "1,2"),
        ("--normal", "0,0,0"),
        ("--speed", "0"),
        ("--fps", "nan"),
        ("--half-life", "-1"),
        ("--path", "nowhere.csv"),
    ],
)
def test_wrong_options_are_refused(walked: Path, run: Run, words: tuple[str, ...]) -> None:
    """Each ends in one line and exit code 2."""
    code, out, err = run("walk", walked, *words)
    assert code == 2
    assert not out
    assert err.count("\n") == 1
