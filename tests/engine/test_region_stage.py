"""Regions in a whole bake: from the file to the stored models, skipped, and modelled anew without a ray."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bake.bench.synthetic import write_ply
from bake.errors import SceneError
from bake.pipeline import BakeOutcome, BakeRequest, run_bake
from bake.region_types import GRID, PointState, Regions
from bake.regions.evaluate import evaluate
from bake.results import load_result
from tests.results.synthetic_results import same_results
from tests.worlds import box, quad

QUICK = {
    "rays": 8,
    "samples-per-face": "1:2",
    "device": "cpu",
    "distances": "2,300",
    "region-directions": 32,
}


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A floor with a long wall across it."""
    positions, faces = quad(16.0)
    wall, sides = box((0.5, 4.0, 12.0), centre=(0.0, 2.0, 0.0))
    path = tmp_path / "scene.ply"
    write_ply(path, (np.concatenate([positions, wall]), np.concatenate([faces, sides + 4]).astype(np.int32)))
    return path


@pytest.fixture
def region_file(scene: Path) -> Path:
    """Two boxes, one on either side of the wall, and a sliver over it that links them."""
    regions = [
        {"name": "west", "min": [-8, 0, -8], "max": [-0.5, 4, 8]},
        {"name": "east", "min": [0.5, 0, -8], "max": [8, 4, 8]},
        {"name": "over", "min": [-0.5, 4.5, -0.1], "max": [0.5, 4.9, 0.1]},
    ]
    links = [
        {"a": "west", "b": "over", "area": 1.0, "centre": [-0.5, 4.0, 0.0]},
        {"a": "east", "b": "over", "area": 2.0, "centre": [0.5, 4.0, 0.0]},
    ]
    path = scene.with_name("regions.json")
    path.write_text(json.dumps({"regions": regions, "links": links}))
    return path


def bake(scene: Path, **options: Any) -> BakeOutcome:
    """Runs a bake into the folder beside the scene."""
    chosen = {**QUICK, **{name.replace("_", "-"): value for name, value in options.items()}}
    work = run_bake(BakeRequest(scene, scene.parent / "result", chosen))
    while True:
        try:
            next(work)
        except StopIteration as done:
            return done.value


def regions_of(outcome: BakeOutcome) -> Regions:
    """The regions that a bake made."""
    assert outcome.result.regions is not None
    return outcome.result.regions


def test_regions_are_baked_and_stored(scene: Path, region_file: Path) -> None:
    """Boxes and links of the file, traced points, models and mismatches arrive in the stored result."""
    outcome = bake(scene, regions=region_file.name)
    regions = regions_of(outcome)
    assert regions.graph.names == ("west", "east", "over")
    assert len(regions.points.state) == 3 * GRID**3
    assert regions.absorbed == (("over", regions.graph.names[int(regions.owner[2])]),)
    stored = load_result(scene.parent / "result")
    assert same_results(stored, outcome.result)
    rows = {row.name: row for row in outcome.result.stages}
    assert [rows[name].status for name in ("regions", "region probes", "fit regions", "regularise regions")] == [
        "ran"
    ] * 4
    assert rows["region probes"].rays == 32 * len(regions.points.traced)
    corner = regions.graph.minimum[:1] + 0.2
    middle = regions.graph.seed[:1]
    up = [0.0, 1.0, 0.0]
    assert evaluate(regions.regularised, 0, middle, up)[0, 0] > 0.5
    assert evaluate(regions.regularised, 0, corner, [0.0, -1.0, 0.0])[0, 0] < 0.5


def test_skipped_with_a_reason(scene: Path, region_file: Path) -> None:
    """Without regions, and on request, the report says why there are none."""
    for options, reason in (({}, "none asked for"), ({"regions": region_file.name, "skip": "regions"}, "--skip")):
        outcome = bake(scene, **options)
        assert outcome.result.regions is None
        row = next(row for row in outcome.result.stages if row.name == "regions")
        assert row.status == "skipped"
        assert reason in row.why


@pytest.mark.parametrize("option", [{"region_beta": 9.0}, {"region_smallest": 0.0}, {"optimise_centre": True}])
def test_other_models_need_no_ray(scene: Path, region_file: Path, option: dict[str, Any]) -> None:
    """When only settings of the models change nothing is traced, and the result is that of a bake from scratch."""
    first = bake(scene, regions=region_file.name)
    again = bake(scene, regions=region_file.name, **option)
    assert not again.traced
    assert not again.unchanged
    assert first.traced
    assert bake(scene, regions=region_file.name, **option).unchanged
    for path in (scene.parent / "result").iterdir():
        path.unlink()
    anew = bake(scene, regions=region_file.name, **option)
    assert anew.traced
    assert same_results(regions_of(again), regions_of(anew))  # type: ignore[arg-type]
    assert again.result.settings == anew.result.settings
    assert again.result.findings == anew.result.findings
    assert [row.name for row in again.result.stages] == [row.name for row in anew.result.stages]


def test_a_changed_region_file_is_noticed(scene: Path, region_file: Path) -> None:
    """An edit of the file of regions makes the stored result stale; the other regions' points keep their values."""
    first = regions_of(bake(scene, regions=region_file.name))
    content = json.loads(region_file.read_text())
    content["regions"][1]["max"] = [7, 4, 8]
    region_file.write_text(json.dumps(content))
    outcome = bake(scene, regions=region_file.name)
    assert outcome.traced
    second = regions_of(outcome)
    of_west = [np.count_nonzero(item.points.traced < GRID**3) for item in (first, second)]
    np.testing.assert_array_equal(first.points.sh[: of_west[0]], second.points.sh[: of_west[1]])


def test_a_bad_region_file_is_refused_before_tracing(scene: Path, region_file: Path) -> None:
    """What cannot be used is one line about the file, and no result is written."""
    region_file.write_text("[]")
    with pytest.raises(SceneError, match=r"regions\.json"):
        bake(scene, regions=region_file.name)
    with pytest.raises(SceneError, match=r"nowhere\.json"):
        bake(scene, regions="nowhere.json")
    assert not (scene.parent / "result").exists()


def test_region_inside_a_wall(scene: Path, region_file: Path) -> None:
    """A region without a valid point gets a model from its neighbours, and is told of."""
    content = json.loads(region_file.read_text())
    content["regions"][2].update(min=[-0.2, 0.5, -2], max=[0.2, 3.5, 2])
    region_file.write_text(json.dumps(content))
    outcome = bake(scene, regions=region_file.name, region_smallest=0.0)
    regions = regions_of(outcome)
    assert not (regions.points.state[2 * GRID**3 :] == PointState.VALID).any()
    assert regions.regularised.terms[2] == 0
    assert np.isnan(regions.fitted.rmse[2]).all()
    assert np.isfinite(regions.regularised.coefficients).all()
    assert any(item.what == "region-without-model" for item in outcome.result.findings)
    value = evaluate(regions.fitted, 2, regions.graph.seed[2:], [0.0, 1.0, 0.0])
    assert 0.2 < value[0, 0] <= 1.0
