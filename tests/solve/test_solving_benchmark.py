"""The benchmark of the solver, on a field small enough for a test."""

from __future__ import annotations

import pytest

from bake.bench import solving


def test_it_times_the_solve_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both solvers take a time that a clock can tell, whatever assembling took, and the gain is their ratio."""
    monkeypatch.setattr(solving, "_DIRECT_UNKNOWNS", 900)
    measured = solving.measure_solving(unknowns=2500)
    direct, small, large = measured.rows
    assert (direct["unknowns"], small["unknowns"], large["unknowns"]) == (900, 900, 2500)
    assert all(row["solve seconds"] > 1e-6 for row in measured.rows)
    assert large["iterations"] > 0
    assert large["gain per unknown"] == pytest.approx(direct["µs per unknown"] / large["µs per unknown"])


def test_updates_are_held_against_whole_solves() -> None:
    """Every change has its time and its error, which the estimate covers."""
    measured = solving.measure_updates(unknowns=900)
    assert [str(row["change"]).split(",")[0] for row in measured.rows] == [
        "alpha alone", "threshold alone", "threshold alone",
    ]  # fmt: skip
    for row in measured.rows:
        assert row["unknowns"] == 900
        assert row["largest difference"] <= max(row["estimate of it"], 1e-6) <= 5e-4
