"""The benchmark of fog, on small fields and a made-up garden."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bake.bench import fog
from tests.decorators.test_trees import leaves
from tests.worlds import quad


def garden(folder: Path) -> Path:
    """A floor with a leafy shrub on it, as a scene file with roles."""
    crown = leaves(60)
    lines, first = [], 1
    for name, (positions, faces) in {"floor": quad(8.0), "shrub": (crown.positions - [0, 1, 0], crown.faces)}.items():
        lines += [f"o {name}", *(f"v {x} {y} {z}" for x, y, z in positions)]
        lines += [f"f {a} {b} {c}" for a, b, c in faces + first]
        first += len(positions)
    scene = folder / "garden.obj"
    scene.write_text("\n".join(lines))
    scene.with_name("garden.obscura.toml").write_text('[[object]]\nmatch = "shrub"\nrole = "shrub"\n')
    return scene


def test_it_measures_cost_and_worth(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A row a field with the ratio and its gate; four rows a scene, in which the fitted fog beats no shrubs."""
    for name, value in (("_CELLS", 12), ("_BOXES", 40), ("_SAMPLES", 256), ("_ROUNDS", 2), ("_WORTH_ROUNDS", 1)):
        monkeypatch.setattr(fog, name, value)
    cost, worth = fog.measure_fog([garden(tmp_path)], {"rays": 64, "samples-per-face": "64:64", "device": "cpu"})
    assert [row["scene"] for row in cost.rows] == ["bare field", "field with props"]
    assert all(np.isfinite(row["fog / opaque"]) and "passed" in row for row in cost.rows)
    kinds = [row["occluders"].split(",")[0] for row in worth.rows]
    assert kinds == ["real foliage", "fog", "fitted fog", "left out"]
    real, given, fitted, none = worth.rows
    for distance in ("2 m", "300 m"):
        assert real[f"RMSE {distance}"] < fitted[f"RMSE {distance}"] < none[f"RMSE {distance}"]
        assert given[f"mean {distance}"] < none[f"mean {distance}"]
    assert fitted["passed"] is True
    assert none["trace / left out"] == 1.0


def test_without_shrubs_only_the_cost_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """No scene, no second table."""
    for name, value in (("_CELLS", 12), ("_BOXES", 40), ("_SAMPLES", 256), ("_ROUNDS", 1)):
        monkeypatch.setattr(fog, name, value)
    assert [table.name for table in fog.measure_fog([], {"rays": 4, "device": "cpu"})] == ["cost of fog"]
