"""The benchmark of tree models, on a made-up level."""

from __future__ import annotations

import numpy as np
import pytest

from bake.bench import trees
from bake.devices import resolve
from bake.types import Role
from tests.decorators.test_trees import QUICK, leaves, mesh_of, placed, scene_of
from tests.worlds import quad


def test_it_measures_every_tree_and_the_volume(monkeypatch: pytest.MonkeyPatch) -> None:
    """A row a tree and distance with the error of each model, means, and what the volume costs."""
    monkeypatch.setattr(trees, "_TRUTH_RAYS", 64)
    oak, ground = leaves(20), mesh_of(*quad(40.0), "ground")
    scene = scene_of((ground, placed(), Role.STATIC), (oak, placed(), Role.TREE), (oak, placed(9.0), Role.TREE))
    rows = trees._rows(scene, QUICK, resolve("cpu"))
    assert [row["tree"] for row in rows[::2]] == ["object_1", "object_2", "mean of all", "volume of all"]
    errors = [value for row in rows for name, value in row.items() if name.startswith("RMSE")]
    assert len(errors) == 5 * 6
    assert np.isfinite(errors).all()
    assert all(0.0 < error < 1.0 for error in errors)
    assert rows[-1]["voxels"] > 0
    assert rows[-1]["bytes a tree"] == 32
