"""Summary and report tell what a result has of trees, shrubs and small decorators."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

from synthetic_results import build_decorators, build_result

from app.commands.report_page import report_page
from app.commands.summary import bake_summary, summary_text


def test_the_summary_counts_them() -> None:
    """JSON has every count, the terminal a line; without decorators the counts are 0 and the line is away."""
    plain = build_result()
    decorated = dataclasses.replace(plain, decorators=build_decorators(plain, trees=(0, 1)))
    counts = json.loads(json.dumps(bake_summary(decorated, Path("r"), 1.0)))["decorators"]
    assert (counts["trees"], counts["tree_models"], counts["small"], counts["shrubs"]) == (2, 1, 1, 1)
    assert (counts["volume_voxels"], counts["volume_filled_voxels"], counts["fog_boxes"]) == (8, 1, 1)
    assert counts["volume_memory_mb"] > 0
    assert "2 trees" in summary_text(decorated, Path("r"), 1.0)
    assert not any(bake_summary(plain, Path("r"), 1.0)["decorators"].values())
    assert "decorators" not in summary_text(plain, Path("r"), 1.0)


def test_the_report_has_a_section() -> None:
    """Trees with their errors, the volume's memory and the scalars; nothing of it without decorators."""
    plain = build_result()
    decorated = dataclasses.replace(plain, decorators=build_decorators(plain, trees=(0, 1)))
    heading = "Trees, shrubs and small decorators"
    page = report_page(decorated, Path("r"), [])
    assert heading in page
    assert "Yard/Fässer/barrel#1" in page
    assert "memory of the tree volume" in page
    assert "no surface around" in page
    assert heading not in report_page(plain, Path("r"), [])
