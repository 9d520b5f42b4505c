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
    rows, volume, figures = trees.measure_scene(scene, QUICK, resolve("cpu"), draw=True)
    assert [row["tree"] for row in rows[::2]] == ["object_1", "object_2", "mean of 2"]
    errors = [value for row in rows for name, value in row.items() if name.startswith("RMSE")]
    assert len(errors) == 5 * 6
    assert np.isfinite(errors).all()
    assert all(0.0 < error < 1.0 for error in errors)
    assert volume[0]["trees"] == 2
    assert volume[0]["voxels"] > volume[0]["bricks"] > 0
    assert volume[0]["volume bytes"] > 0
    assert volume[0]["bytes a tree"] == 32
    assert [figure.tree for figure in figures] in (["object_1"], ["object_2"])
    vertices = len(oak.positions)
    assert {name: ao.shape for name, ao in figures[0].values.items()} == dict.fromkeys(
        ("global", "local × global", "refined", "volume", "traced"), (vertices, 2)
    )
    for ao in figures[0].values.values():
        assert np.isfinite(ao).all()
    # At the vertices, too, the product is the closer one.
    error = {name: np.sqrt(((ao - figures[0].values["traced"]) ** 2).mean()) for name, ao in figures[0].values.items()}
    assert error["local × global"] < error["global"]


def test_of_many_trees_some_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond a number of trees there are means of some, and of what the bake itself says of all."""
    monkeypatch.setattr(trees, "_TRUTH_RAYS", 16)
    monkeypatch.setattr(trees, "_EACH", 3)
    oak, pine, ground = leaves(8), leaves(6, seed=4), mesh_of(*quad(40.0), "ground")
    objects = [(oak if i % 2 else pine, placed(4.0 * i), Role.TREE) for i in range(6)]
    rows, _, figures = trees.measure_scene(scene_of((ground, placed(), Role.STATIC), *objects), QUICK, resolve("cpu"))
    assert [row["tree"] for row in rows[::2]] == ["mean of 3 of 6", "all 6, as baked"]
    assert figures == []
    assert rows[0]["closer"].endswith(" of 3")
    assert rows[2]["closer"].endswith(" of 6")
