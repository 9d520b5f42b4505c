"""The stability matrix: gates that can break, tables, the picture."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from app.commands.stability_plot import plot_stability
from bake.bench.stability import Matrix, bench_settings, measure_stability, tables
from bake.bench.stability_cases import all_cases
from bake.bench.stability_figures import Figure, tally_figures, warned, worst
from bake.bench.stability_level import as_scene, make_level
from bake.scene import flatten
from bake.types import Tally

QUICK = {"rays": 8, "samples-per-face": "1:1", "region-directions": 16, "volume-directions": 16}


@pytest.fixture(scope="module")
def matrix() -> Matrix:
    """Three cases, few rays."""
    pytest.importorskip("embreex", reason="Embree is not installed")
    named = {case.name: case for case in all_cases()}
    return measure_stability(QUICK, [named[name] for name in ("plain", "moved by 1e3 m", "no valid sample")])


def test_gates_hold_on_the_plain_level(matrix: Matrix) -> None:
    """Every stage is there, and nothing is wrong with the level that the others are compared with."""
    assert {"bake", "embree", "warp", "brute", "least-squares", "average", "fog", "volume", "trees", "decorators",
            "regions"} <= set(matrix.stages)  # fmt: skip
    assert [item for item in matrix.figures["plain"] if not item.passed] == []
    kinds = {item.what for item in matrix.figures["moved by 1e3 m"] if item.stage == "least-squares"}
    assert {"AO of vertices changed, greatest", "constant missed by", "unknowns not converged"} <= kinds


def test_stages_that_a_case_lacks_have_no_cell(matrix: Matrix) -> None:
    """A level without trees has no figure of trees."""
    assert matrix.cell("no valid sample", "trees") is None
    assert matrix.cell("plain", "trees") is not None


def test_tables_and_json(matrix: Matrix) -> None:
    """A row a case and a row a kind of figure; JSON has the seed, the settings and every figure."""
    ratios, kinds = tables(matrix)
    assert [row["case"] for row in ratios.rows] == list(matrix.figures)
    assert ratios.passed and kinds.passed
    stored = json.loads(json.dumps(ratios.to_json()))
    assert stored["settings"]["seed"] == 1
    assert len(stored["figures"]) == sum(len(figures) for figures in matrix.figures.values())
    assert {"machine", "versions"} <= stored.keys()


def test_a_broken_gate_shows() -> None:
    """What must be 0 and is not, and what is not a number, comes out as the worst and fails its table."""
    fine, close = Figure("embree", "a", 0.0, 0.0), Figure("embree", "b", 0.5, 1.0)
    assert worst([fine, close]) is close
    assert worst([close, Figure("embree", "c", 1.0, 0.0)]).ratio == math.inf
    lost = Figure("embree", "d", math.nan, 1.0)
    assert not lost.passed and worst([close, lost]) is lost
    broken = Matrix({"case": [fine, lost]}, bench_settings({}), {})
    assert not any(table.passed for table in tables(broken))


def test_bad_samples_break_their_gates() -> None:
    """A value that is not a number, one above 1, one brighter at the longer distance, and a sample short of rays."""
    settings = bench_settings({"rays": 8, "distances": "2,300"})
    tally = Tally.empty(4, 2)
    tally.rays[:] = 8
    assert all(item.passed for item in tally_figures("embree", tally, settings))
    tally.ao[0], tally.ao[1], tally.ao[2], tally.rays[3] = np.nan, 1.001, (0.2, 0.3), 7
    failed = {item.what: item.value for item in tally_figures("embree", tally, settings) if not item.passed}
    assert failed["values not finite"] == 2.0 and failed["rays missing"] == 1.0
    assert failed["beyond 0 to 1"] == pytest.approx(0.001, rel=1e-3)
    assert "brighter at a longer distance" in failed


def test_warnings_of_all_kinds_are_counted() -> None:
    """NumPy's floating-point errors among them."""
    with warned() as caught:
        _ = np.zeros(1) / np.zeros(1)
    assert len(caught) == 1


def test_cases_have_names_of_their_own() -> None:
    """And every level of theirs flattens."""
    cases = all_cases()
    assert len({case.name for case in cases}) == len(cases)
    for case in cases:
        assert flatten(as_scene(case.make()), bench_settings({})).face_count > 0
    plain = make_level()
    assert len({item.name for item in plain.parts}) == len(plain.parts)


def test_the_picture_is_drawn(matrix: Matrix, tmp_path: Path) -> None:
    """One file, not large."""
    path = tmp_path / "stability.png"
    plot_stability(path, matrix)
    assert 5_000 < path.stat().st_size < 200_000
