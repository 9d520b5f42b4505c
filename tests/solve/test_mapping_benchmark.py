"""The comparison of the mappings that the documentation quotes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bake.bench.mapping import compare_mappings
from tests.solve.solve_cases import grid
from tests.worlds import icosphere


def test_it_compares_three_mappings_on_a_scene(tmp_path: Path) -> None:
    """A ball over a floor, stored in units of half a metre: three rows, and least squares is the best of them."""
    floor, floor_faces = grid(12, 12, size=8.0)
    floor = floor[:, [1, 2, 0]] - [4.0, 0.0, 4.0]
    ball, ball_faces = icosphere(2, centre=(0.0, 1.5, 0.0))
    lines = [f"v {x} {y} {z}" for x, y, z in np.concatenate([floor, ball])]
    lines += ["f {} {} {}".format(*face) for face in np.concatenate([floor_faces, ball_faces + len(floor)]) + 1]
    path = tmp_path / "ball.obj"
    path.write_text("\n".join(lines))
    rows = compare_mappings(path, {"rays": 16, "distances": "1,10"}, scale=0.5, points=600)
    assert [row["mapping"] for row in rows] == [
        "weighted average",
        "least squares, alpha 0.03",
        "rays from vertices",
    ]
    average, squares, vertices = rows
    for distance in ("1 m", "10 m"):
        assert squares[f"RMSE {distance}"] < min(average[f"RMSE {distance}"], vertices[f"RMSE {distance}"])
        assert np.isclose(squares[f"ratio {distance}"], squares[f"RMSE {distance}"] / average[f"RMSE {distance}"])
    assert 0.0 <= squares["least"] <= squares["greatest"] <= 1.0
    assert squares["iterations"] <= 200
    assert vertices["rays"] > 16
