"""The published workloads made anew, at a fraction of their size."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bake.bench import workload
from bake.bench.workload_published import LEVEL, LEVEL_TOTAL_S, SLED, SLED_TOTAL_S, PublishedStage
from bake.bench.workload_scenes import SLED_TRIANGLES, write_level, write_sled
from bake.bench.workload_stages import Stage, chosen, filled_from, run_stages
from bake.errors import SettingsError
from bake.pipeline import settings_for
from bake.samples import place_samples
from bake.scene import flatten, load_scene
from bake.types import Role

SMALL = {"rays": 2, "volume-directions": 16, "region-directions": 16, "device": "cpu"}


def test_the_level_runs_stage_by_stage(tmp_path: Path) -> None:
    """Every published stage has a counterpart that ran; traced shares are marked, and rays count for the whole."""
    scene, regions = write_level(tmp_path, shrink=100)
    options = {**workload.LEVEL_OPTIONS, "regions": str(regions), **SMALL}
    measured = run_stages(scene, options, 0.1)
    stages = {stage.name: stage for stage in measured["stages"]}
    assert {name for line in LEVEL for name in line.ours} <= set(stages)
    assert stages["trace"].share == pytest.approx(0.1, rel=0.05)
    assert stages["tree volume"].share == 1.0
    settings = settings_for(scene, options)
    samples = place_samples(flatten(load_scene(scene), settings), settings)
    assert stages["trace"].rays == pytest.approx(2 * len(samples), abs=2)
    table = workload.side_by_side("level", measured, LEVEL, LEVEL_TOTAL_S, "a paper")
    rows = {row["stage"]: row for row in table.rows}
    assert rows["trace samples × 256"]["extrapolated"] == "yes"
    assert rows["BVH build"]["extrapolated"] == ""
    assert rows["all of these"]["extrapolated"] == "yes"
    assert any("extrapolated" in note for note in table.notes)


def test_all_points_give_what_a_bake_gives(tmp_path: Path) -> None:
    """With a share of 1 nothing is extrapolated."""
    scene, regions = write_level(tmp_path, shrink=200)
    measured = run_stages(scene, {**workload.LEVEL_OPTIONS, "regions": str(regions), **SMALL}, 1.0)
    assert all(stage.share == 1.0 for stage in measured["stages"])
    table = workload.side_by_side("level", measured, LEVEL, LEVEL_TOTAL_S, "a paper")
    assert all(row["extrapolated"] == "" for row in table.rows)


def test_the_sled_has_the_published_size(tmp_path: Path) -> None:
    """109 meshes, 418,036 triangles, three samples on each."""
    scene = load_scene(write_sled(tmp_path / "sled.glb"))
    assert len(scene.objects) == 109
    assert sum(len(mesh.faces) for mesh in scene.meshes) == SLED_TRIANGLES
    assert 3 * SLED_TRIANGLES == 1_254_108


@pytest.mark.slow
def test_the_level_has_the_published_size(tmp_path: Path) -> None:
    """Vertices, faces, samples, trees, boxes and points of Table 1, to one in a hundred."""
    scene, _ = write_level(tmp_path)
    settings = settings_for(scene, {"samples-per-face": "4:4"})
    world = flatten(load_scene(scene), settings)
    roles = np.array([role is Role.STATIC for role in world.object_roles])
    lods = np.array([role is Role.LOD for role in world.object_roles])
    vertices, faces = np.diff(world.first_vertex), np.diff(world.first_face)
    assert vertices[roles].sum() == pytest.approx(1.5e6, rel=0.02)
    assert faces[roles].sum() == pytest.approx(1.8e6, rel=0.01)
    assert (vertices[lods].sum(), faces[lods].sum()) == (pytest.approx(0.65e6, rel=0.01), pytest.approx(8e5, rel=0.01))
    assert len(place_samples(world, settings)) == pytest.approx(6.7e6, rel=0.01)
    assert (world.object_roles.count(Role.TREE), world.object_roles.count(Role.SHRUB)) == (46, 7856)


@pytest.mark.parametrize("share", [0.01, 0.25, 1.0])
def test_chosen_points_are_spread_and_fill_the_rest(share: float) -> None:
    """The wanted part of them, from the first on; each point takes on the value of the last chosen one before it."""
    rows = chosen(100_000, share)
    assert len(rows) == pytest.approx(share * 100_000, rel=0.05)
    fill = filled_from(rows, 100_000)
    np.testing.assert_array_equal(fill[rows], np.arange(len(rows)))
    assert (rows[fill] <= np.arange(100_000)).all()


def test_sums_and_ratios() -> None:
    """Stages are added up, bounds have no ratio, and what only ours does stands below the sum."""
    measured = {
        "stages": [Stage("a", 1.0), Stage("b", 2.0, 4_000_000), Stage("c", 5.0)],
        "tracer": "embree on cpu",
        "peak memory MB": 1.0,
    }
    published = (PublishedStage("A", 6.0, ("a", "b"), 3.0), PublishedStage("B", 1.0, (), below=True))
    rows = workload.side_by_side("x", measured, published, 9.0, "y").rows
    assert [row["stage"] for row in rows] == ["A", "B", "all of these", "c (ours alone)"]
    assert (rows[0]["seconds"], rows[0]["published / ours"], rows[0]["Mrays/s"]) == (3.0, 2.0, pytest.approx(4 / 3))
    assert "published / ours" not in rows[1]
    assert rows[2]["published / ours"] == pytest.approx(3.0)
    assert sum(line.seconds for line in SLED) <= SLED_TOTAL_S


@pytest.mark.parametrize("share", [0.0, 1.5, -1.0])
def test_a_share_must_be_one(share: float) -> None:
    """Above 0, up to 1."""
    with pytest.raises(SettingsError, match="--share"):
        workload.measure_workloads({}, share=share)
