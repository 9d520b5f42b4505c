"""The tables of the comparison of bakers, and the page that they are put into."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.commands.written_tables import write_table
from bake.bench.front import GATED, Front, FrontRow
from bake.bench.front_tables import tables
from bake.bench.peers import CYCLES
from bake.bench.synthetic import height_field, under_the_field


def front(*rows: tuple[str, str, float, float]) -> Front:
    """A front of bakers, efforts, seconds and errors; those of all rays are 0.01 above."""
    made = [
        FrontRow(GATED, baker, effort, seconds, rmse, rmse, 3 * rmse, 5.0, rmse + 0.01)
        for baker, effort, seconds, rmse in rows
    ]
    return Front(GATED, made, 0.01, 0.012, 2.0, 900, 1000, 0.001, 10.0, 1, 95)


def test_leads_are_taken_at_every_effort() -> None:
    """Against the first of ours that is at least as good; the gate is where they get no further."""
    found = tables(
        front(
            ("Obscura", "cheaper", 0.5, 0.075),
            ("Obscura", "cheap", 1.0, 0.065),
            ("Obscura", "preset final", 30.0, 0.0135),
            (f"{CYCLES} 4.5", "16 rays", 7.0, 0.08),
            (f"{CYCLES} 4.5", "64 rays", 20.0, 0.071),
            (f"{CYCLES} 4.5", "256 rays", 70.0, 0.0705),
        )
    )
    few, more, most, at, *of_all, by_area, _ = found[1].rows
    assert [row["RMSE"] for row in (few, more, most)] == [0.08, 0.071, 0.0705]
    assert [row["lead"] for row in (few, more, most)] == pytest.approx([14.0, 20.0, 70.0])
    assert "passed" not in few
    assert "passed" not in more
    assert most["passed"]
    assert at["RMSE"] == 0.072
    assert at["lead"] == pytest.approx(20.0)
    assert not at["passed"]
    assert [row["RMSE"] for row in of_all] == pytest.approx([0.09, 0.081, 0.0805])
    assert all(", of all rays" in row["what"] for row in of_all)
    assert by_area["passed"]
    assert "100 more, 95 of them on props under the ground" in " ".join(found[0].notes)
    assert found[0].seeds == {"bakes": 1, "reference": 2}


def test_both_counts_have_their_own_leads() -> None:
    """A bake that comes far by one count may not by the other, and each has its gates."""
    ours = FrontRow(GATED, "Obscura", "a", 1.0, 0.05, 0.05, 0.1, 5.0, 0.073)
    better = FrontRow(GATED, "Obscura", "b", 2.0, 0.05, 0.05, 0.1, 5.0, 0.051)
    theirs = FrontRow(GATED, f"{CYCLES} 4.5", "64 rays", 120.0, 0.062, 0.06, 0.1, 5.0, 0.07)
    found = tables(Front(GATED, [ours, better, theirs], 0.01, 0.01, 2.0, 9, 10, 0.001, 10.0, 1))[1].rows
    assert [row["our bake"] for row in found] == ["a", "a", "b", "b"]
    assert [row["lead"] for row in found] == pytest.approx([120.0, 120.0, 60.0, 60.0])
    assert [row["passed"] for row in found] == [True] * 4


def test_without_anything_as_good_there_is_no_lead() -> None:
    """And no infinity, which JSON does not know."""
    best = tables(front(("Obscura", "a", 1.0, 0.2), (f"{CYCLES} 4.5", "64 rays", 50.0, 0.1)))[1].rows[0]
    assert best["lead"] is None
    assert best["passed"] is False


def test_tables_replace_those_between_the_marks(tmp_path: Path) -> None:
    """And a page without the marks stays as it is."""
    page = tmp_path / "page.md"
    page.write_text("a\n<!-- t -->\nold\n<!-- /t -->\nb\n")
    assert write_table(page, "t", "| new |\n")
    assert page.read_text() == "a\n<!-- t -->\n| new |\n<!-- /t -->\nb\n"
    assert not write_table(page, "other", "x")
    assert page.read_text() == "a\n<!-- t -->\n| new |\n<!-- /t -->\nb\n"


def test_points_under_the_field_are_told() -> None:
    """By the height that the field itself is made of."""
    ground = height_field(40)[0]
    assert under_the_field(ground - [0.0, 0.0, 1e-6]).all()
    assert not under_the_field(ground - [0.0, 0.0, -1e-6]).any()
