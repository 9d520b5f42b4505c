"""Regions are stored with the result, and results without them stay readable."""

from __future__ import annotations

import dataclasses
import json
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_results import build_result, same_results

from bake.errors import ResultError
from bake.results import is_current, load_result, save_result
from bake.results.manifest import _checksum
from bake.types import BakeResult
from tests.regions.synthetic import build_regions


def with_regions(result: BakeResult, count: int = 3, *, absorbed: bool = False) -> BakeResult:
    """The same result with regions in a row; the last absorbed by its neighbour, if asked for."""
    regions = build_regions(count, settings=result.settings)
    if absorbed:
        owner = regions.owner.copy()
        owner[-1] = count - 2
        cost = np.full((1, result.settings.distance_count), 0.01, np.float32)
        names = regions.graph.names
        regions = dataclasses.replace(regions, owner=owner, absorbed=((names[-1], names[-2]),), absorbed_error=cost)
    return dataclasses.replace(result, regions=regions)


@settings(max_examples=10, deadline=None)
@given(st.integers(1, 4), st.integers(1, 3), st.booleans())
def test_regions_round_trip(count: int, distances: int, absorbed: bool) -> None:
    """What is stored comes back bit by bit, for any number of regions and distances."""
    result = build_result(distances=tuple(float(i + 1) for i in range(distances)))
    saved = with_regions(result, count, absorbed=absorbed and count > 1)
    with tempfile.TemporaryDirectory() as folder:
        save_result(saved, Path(folder))
        assert same_results(load_result(Path(folder)), saved)


def test_regions_go_with_their_result(tmp_path: Path, result: BakeResult) -> None:
    """A result without regions that replaces one with them leaves none of their files behind."""
    save_result(with_regions(result), tmp_path)
    assert len(list(tmp_path.glob("region*.npy"))) == 26
    save_result(result, tmp_path)
    assert not list(tmp_path.glob("region*.npy"))
    assert load_result(tmp_path).regions is None


def test_a_damaged_array_is_named(tmp_path: Path, result: BakeResult) -> None:
    """Damage of a region's array is noticed like that of any other."""
    save_result(with_regions(result), tmp_path)
    path = next(tmp_path.glob("region_points_sh-*.npy"))
    path.write_bytes(path.read_bytes()[:-4])
    with pytest.raises(ResultError, match="region_points_sh"):
        load_result(tmp_path)


def test_regions_that_do_not_fit_are_refused(tmp_path: Path, result: BakeResult) -> None:
    """Numbers of regions that are not there, points out of order and wrong lengths are never indexed with."""
    good = with_regions(result).regions
    assert good is not None
    graph, points = good.graph, good.points
    wrong = [
        dataclasses.replace(good, owner=good.owner + 1),
        dataclasses.replace(good, owner=np.array([1, 2, 2], np.int32)),
        dataclasses.replace(good, graph=dataclasses.replace(graph, link=graph.link + 1)),
        dataclasses.replace(good, graph=dataclasses.replace(graph, link=graph.link[:, ::-1])),
        dataclasses.replace(good, points=dataclasses.replace(points, traced=points.traced[::-1])),
        dataclasses.replace(good, points=dataclasses.replace(points, state=points.state + 3)),
        dataclasses.replace(good, points=dataclasses.replace(points, sh=points.sh[..., :1])),
        dataclasses.replace(good, mismatch_after=good.mismatch_after[:0]),
        dataclasses.replace(good, absorbed_error=np.zeros((1, 2), np.float32)),
    ]
    for number, regions in enumerate(wrong):
        folder = tmp_path / str(number)
        save_result(dataclasses.replace(result, regions=regions), folder)
        with pytest.raises(ResultError, match="regions do not fit"):
            load_result(folder)


def test_results_of_schema_2_still_load(tmp_path: Path, result: BakeResult) -> None:
    """They had no regions; they are read as such, but a bake does not take them for its own."""
    save_result(result, tmp_path)
    path = tmp_path / "manifest.json"
    content = json.loads(path.read_text())
    del content["regions"], content["checksum"]
    content["schema"] = 2
    content["checksum"] = _checksum(content)
    path.write_text(json.dumps(content))
    assert same_results(load_result(tmp_path), result)
    inputs = {"files": result.files, "settings": result.settings, "versions": result.versions}
    assert not is_current(tmp_path, **inputs, device="cpu", tracer="embree")
