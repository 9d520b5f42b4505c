"""What the regions bench keeps of a scene."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from synthetic import build_regions

from bake.bench.kept_regions import Traced, keep, kept, kept_file
from bake.settings import BakeSettings
from bake.walk import PathTruth, path_through


def _traced() -> Traced:
    regions = build_regions(3)
    truth = PathTruth(
        np.arange(4.0), np.zeros(4, np.int32), np.ones((4, 9, 2), np.float32), 16, np.ones(4, np.bool_), np.zeros(2)
    )
    path = path_through([[0.0, 0, 0], [3.0, 0, 0]])
    return Traced(regions.graph, regions.points, path, truth, 3, float("nan"), {"regions": 1.5})


def test_it_comes_back_as_it_was(tmp_path: Path) -> None:
    """Regions, points, tour and truth are read as they were written; nothing comes of a file that is not there."""
    file, traced = tmp_path / "new" / "scene.npz", _traced()
    assert kept(file) is None
    keep(file, traced)
    found = kept(file)
    assert found is not None
    assert (found.toured, found.seconds) == (traced.toured, traced.seconds)
    assert np.isnan(found.coverage)
    for part in ("graph", "points", "path", "truth"):
        old, new = getattr(traced, part), getattr(found, part)
        for item in dataclasses.fields(old):
            wanted, value = getattr(old, item.name), getattr(new, item.name)
            assert type(value) is type(wanted)
            np.testing.assert_array_equal(value, wanted)


@pytest.mark.parametrize(
    ("changes", "same"), [({"region_beta": 3.0}, True), ({"seed": 2}, False), ({"region_directions": 64}, False)]
)
def test_another_scene_or_other_rays_are_traced_anew(tmp_path: Path, changes: dict[str, float], same: bool) -> None:
    """The file's name tells apart what is traced, and not what only changes models."""
    scene = tmp_path / "a.glb"
    scene.write_bytes(b"one")
    settings = BakeSettings()
    file = kept_file(tmp_path, scene, settings)
    assert (kept_file(tmp_path, scene, settings.replaced(**changes)) == file) == same
    scene.write_bytes(b"two")
    assert kept_file(tmp_path, scene, settings) != file
