"""The same bake by every tracer."""

from __future__ import annotations

from pathlib import Path

import pytest

from bake.bench.synthetic import cube, joined, write_ply
from bake.bench.tracers import measure_tracers


@pytest.mark.slow
def test_tracers_come_to_the_same_values(tmp_path: Path) -> None:
    """Every tracer of the CPU has a row, with as many rays and the same error."""
    positions, faces = cube()
    scene = tmp_path / "cubes.ply"
    write_ply(scene, joined([(positions, faces), (positions * 0.5 + [0.0, 0.0, 1.0], faces)]))
    table = measure_tracers([scene], {"rays": 4, "device": "cpu"})
    own = [row for row in table.rows if row["device"] == "cpu"]
    assert [row["tracer"] for row in own] == ["embree", "warp", "brute"]
    assert len({row["Mrays"] for row in own}) == 1
    assert all(row["vertices apart"] == 0 for row in own)
    assert table.passed
    assert table.seeds["bakes"] == 1
    assert table.name == "tracers: cubes.ply"
