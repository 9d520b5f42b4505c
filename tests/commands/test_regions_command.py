"""`regions` through the command line, and regions in the summary and the report."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from conftest import QUICK, Run
from synthetic_results import build_result

from app.commands.report_page import report_page
from app.commands.summary import bake_summary, summary_text
from bake.results import save_result
from bake.types import BakeResult
from tests.regions.synthetic import build_regions


def baked() -> BakeResult:
    """A result with four regions, the last of which uses its neighbour's model."""
    result = build_result()
    regions = build_regions(4, settings=result.settings)
    names = regions.graph.names
    regions = dataclasses.replace(
        regions,
        owner=np.array([0, 1, 2, 2], np.int32),
        absorbed=((names[3], names[2]),),
        absorbed_error=np.full((1, 2), 0.01, np.float32),
    )
    return dataclasses.replace(result, regions=regions)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The same, stored."""
    save_result(baked(), tmp_path / "regions")
    return tmp_path / "regions"


def test_json_is_the_contract(run: Run, folder: Path) -> None:
    """Every field that other tools read is there, in world metres and plain numbers."""
    code, out, err = run("regions", folder, "--json")
    assert (code, err) == (0, "")
    content = json.loads(out)
    result = baked()
    assert result.regions is not None
    assert len(content["regions"]) == 4
    for i, item in enumerate(content["regions"]):
        assert {"name", "min", "max", "valid_points", "fit_rmse", "centre", "bytes"} <= set(item)
        np.testing.assert_allclose(item["min"], result.regions.graph.minimum[i] + result.world.origin)
        assert isinstance(item["fit_rmse"], float)
        assert item["fit_rmse"] == max(item["fit_rmse_by_distance"])
        assert 300 < item["valid_points"] < 512
    assert [item["bytes"] for item in content["regions"]] == [130, 130, 130, 2]
    assert content["regions"][3]["absorbed_by"] == "room 2"
    assert len(content["links"]) == 3
    for item in content["links"]:
        assert {"a", "b", "area", "mismatch_before", "mismatch_after"} <= set(item)
        assert item["mismatch_after"] < item["mismatch_before"]


def test_table(run: Run, folder: Path) -> None:
    """For people there is a row a region and a row a boundary."""
    code, out, err = run("regions", folder)
    assert (code, err) == (0, "")
    assert "room 3" in out
    assert "uses the model of room 2" in out
    assert "room 0 – room 1" in out
    assert "4 regions, 3 links" in out


@pytest.mark.parametrize("suffix", ["json", "glsl", "hlsl"])
def test_export(run: Run, folder: Path, tmp_path: Path, suffix: str) -> None:
    """The packed models and the code that evaluates them are written whole."""
    path = tmp_path / f"packed.{suffix}"
    code, out, err = run("regions", folder, "--export", path, "--weights", "0.03,0.97")
    assert (code, out) == (0, "")
    assert str(path) in err
    text = path.read_text()
    assert "obscura" in text
    if suffix == "json":
        assert len(json.loads(text)["models"]) == 3


def test_region_file_round_trip(run: Run, folder: Path, tmp_path: Path) -> None:
    """What is written as a region file is what a bake reads, validity included."""
    from bake.regions.region_file import read_region_file

    path = tmp_path / "regions.json"
    assert run("regions", folder, "--write", path, "--validity")[0] == 0
    again = read_region_file(path)
    regions, origin = baked().regions, baked().world.origin
    assert regions is not None
    assert [region.name for region in again.regions] == list(regions.graph.names)
    np.testing.assert_allclose(again.regions[2].maximum, regions.graph.maximum[2] + origin)
    assert again.regions[0].valid is not None
    np.testing.assert_array_equal(again.regions[0].valid, regions.points.state[:512] == 0)
    assert again.links is not None
    assert again.links[1].area == pytest.approx(regions.graph.link_area[1])


def test_check(run: Run, folder: Path, tmp_path: Path) -> None:
    """Sound regions pass; one without points, and one without a link, fail the check by name."""
    assert run("regions", folder, "--check")[0] == 0
    result = baked()
    assert result.regions is not None
    regions = result.regions
    state = regions.points.state.copy()
    state[:512] = 1
    graph = dataclasses.replace(
        regions.graph, link=regions.graph.link[:2], link_area=regions.graph.link_area[:2],
        link_centre=regions.graph.link_centre[:2],
    )  # fmt: skip
    broken = dataclasses.replace(
        regions,
        graph=graph,
        points=dataclasses.replace(regions.points, state=state),
        mismatch_before=regions.mismatch_before[:2],
        mismatch_after=regions.mismatch_after[:2],
    )
    save_result(dataclasses.replace(result, regions=broken), tmp_path / "broken")
    code, out, _ = run("regions", tmp_path / "broken", "--check")
    assert code == 1
    assert "room 0: none of its 512 points is valid" in out
    assert "room 3: it is linked to no other region" in out
    problems = json.loads(run("regions", tmp_path / "broken", "--check", "--json")[1])["problems"]
    assert {item["what"] for item in problems} >= {"no-valid-points", "no-link", "separate-parts"}


def test_refusals(run: Run, folder: Path, stored: Path, tmp_path: Path) -> None:
    """A result without regions, odd weights and unknown formats are one line each, and write nothing."""
    cases = [
        (stored,),
        (folder, "--export", tmp_path / "out.fbx"),
        (folder, "--export", tmp_path / "out.json", "--weights", "1"),
        (folder, "--export", tmp_path / "out.json", "--weights", "x,y"),
        (folder, "--export", tmp_path / "no" / "out.json"),
    ]
    for words in cases:
        code, out, err = run("regions", *words)
        assert (code, out, err.count("\n")) == (2, "", 1), err
    assert not list(tmp_path.glob("out.*"))


def test_summary_and_report_tell_of_regions() -> None:
    """The summary has their figures, the report a section; without regions neither says a word of them."""
    result, plain = baked(), build_result()
    figures = json.loads(json.dumps(bake_summary(result, Path("r"), 1.0), allow_nan=False))["dynamic"]
    assert (figures["regions"], figures["models"], figures["links"]) == (4, 3, 3)
    assert "4 with 3 models" in summary_text(result, Path("r"), 1.0)
    assert "Dynamic regions" in report_page(result, Path("r"), [])
    assert bake_summary(plain, Path("r"), 1.0)["dynamic"] == {"regions": 0}
    assert "Dynamic regions" not in report_page(plain, Path("r"), [])


def test_a_refit_counts_no_rays(run: Run, level: Path, tmp_path: Path) -> None:
    """Baking again with another β reports no ray and only the models' stages."""
    regions = {"regions": [{"name": "all", "min": [-1, 0, -1], "max": [4, 2, 4]}]}
    (level.parent / "regions.json").write_text(json.dumps(regions))
    words = ("bake", level, "-o", tmp_path / "out", *QUICK, "--regions", "regions.json", "--region-directions", "16")
    assert json.loads(run(*words, "--json")[1])["rays"] > 0
    again = json.loads(run(*words, "--region-beta", "3", "--json")[1])
    assert again["rays"] == 0
    assert again["rays_skipped"] > 0
    ran = {stage["name"] for stage in again["stages"] if stage["status"] == "ran"}
    assert ran == {"fit regions", "regularise regions"}
