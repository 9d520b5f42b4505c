"""The whole bake on small scenes: from the file to the stored result."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bake.bench.synthetic import write_ply
from bake.errors import SceneError, SettingsError
from bake.pipeline import BakeOutcome, BakeRequest, run_bake
from bake.results import load_result
from bake.types import Progress, VertexState
from tests.worlds import box, icosphere, quad

QUICK = {"rays": 16, "samples-per-face": "1:2", "device": "cpu", "distances": "2,300"}


def soup(*objects: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Several shapes as one mesh."""
    starts = np.cumsum([0, *(len(p) for p, _ in objects)])
    positions = np.concatenate([p for p, _ in objects])
    return positions, np.concatenate([f + s for (_, f), s in zip(objects, starts, strict=False)]).astype(np.int32)


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A box half sunk into a floor, with a ball beside it."""
    path = tmp_path / "scene.ply"
    write_ply(path, soup(quad(8.0), box((1.0, 2.0, 1.0)), icosphere(2, 0.5, centre=(2.0, 0.5, 0.0))))
    return path


def bake(scene: Path, result: Path, **options: Any) -> tuple[BakeOutcome, list[Progress]]:
    """Runs a bake to its end."""
    work = run_bake(BakeRequest(scene, result, {**QUICK, **{k.replace("_", "-"): v for k, v in options.items()}}))
    progress: list[Progress] = []
    while True:
        try:
            progress.append(next(work))
        except StopIteration as done:
            return done.value, progress


def test_a_bake_is_stored_as_it_was_made(scene: Path, tmp_path: Path) -> None:
    """The stored result equals the returned one, its values lie within 0 and 1, and the rays are exact."""
    outcome, progress = bake(scene, tmp_path / "result")
    stored, result = load_result(tmp_path / "result"), outcome.result
    np.testing.assert_array_equal(stored.field.ao, result.field.ao)
    np.testing.assert_array_equal(stored.tally.back_faces, result.tally.back_faces)
    baked = result.field.state == VertexState.BAKED
    assert baked.any()
    assert 0.0 <= result.field.ao[baked].min() <= result.field.ao[baked].max() <= 1.0
    trace = next(row for row in result.stages if row.name == "trace")
    assert trace.rays == len(result.samples) * 16 == int(result.tally.rays.sum())
    assert {"load", "flatten", "samples", "build BVH", "trace", "solve", "store"} <= {p.stage for p in progress}
    assert any(p.stage == "trace" and p.done == p.total for p in progress)


def test_an_unchanged_scene_is_not_traced_again(scene: Path, tmp_path: Path) -> None:
    """The same scene with the same settings is recognised; any change of either is too."""
    first, _ = bake(scene, tmp_path / "result")
    again, progress = bake(scene, tmp_path / "result")
    assert not first.unchanged
    assert again.unchanged
    assert {p.stage for p in progress} == {"load"}
    np.testing.assert_array_equal(again.result.field.ao, first.result.field.ao)
    assert not bake(scene, tmp_path / "result", seed=2)[0].unchanged
    write_ply(scene, soup(quad(8.0), box((1.0, 2.5, 1.0))))
    assert not bake(scene, tmp_path / "result", seed=2)[0].unchanged


def test_same_inputs_give_the_same_bits(scene: Path, tmp_path: Path) -> None:
    """Two bakes into different folders agree bit for bit; another seed does not."""
    a, b = (bake(scene, tmp_path / name)[0].result for name in "ab")
    np.testing.assert_array_equal(a.field.ao, b.field.ao)
    assert not np.array_equal(a.tally.ao, bake(scene, tmp_path / "c", seed=9)[0].result.tally.ao)


def test_tracers_give_the_same_bake(scene: Path, tmp_path: Path) -> None:
    """Embree and Warp lead to the same vertex values."""
    a = bake(scene, tmp_path / "a", tracer="embree")[0].result
    b = bake(scene, tmp_path / "b", tracer="warp")[0].result
    assert (a.tracer, b.tracer) == ("embree", "warp")
    np.testing.assert_allclose(a.field.ao, b.field.ao, atol=0.02)
    assert np.abs(a.field.ao - b.field.ao).mean() < 1e-3


def test_what_a_scene_does_not_need_is_skipped_and_said(scene: Path, tmp_path: Path) -> None:
    """Stages without work are in the report, with the reason and no rays."""
    result = bake(scene, tmp_path / "result")[0].result
    skipped = {row.name: row for row in result.stages if row.status == "skipped"}
    assert {"fog", "trees", "decorators", "lods", "regions"} == set(skipped)
    assert all(row.why and row.rays == 0 for row in skipped.values())
    assert "no shrubs" in skipped["fog"].why


def test_invalid_samples_are_reported_by_object(scene: Path, tmp_path: Path) -> None:
    """Samples inside the sunken box see its back faces, are thrown away, and the object is named."""
    result = bake(scene, tmp_path / "result", samples_per_face="8:8")[0].result
    found = {finding.what: finding for finding in result.findings}
    assert found["invalid-samples"].count == int((~result.tally.valid(0.25)).sum()) > 0
    assert found["invalid-samples"].object == result.world.object_paths[0]


def test_closing_the_bake_leaves_the_old_result(scene: Path, tmp_path: Path) -> None:
    """A bake stopped at any of its steps changes nothing on disk."""
    bake(scene, tmp_path / "result")
    before = {p.name: p.read_bytes() for p in (tmp_path / "result").iterdir()}
    steps = len(bake(scene, tmp_path / "other", seed=5)[1])
    for stop in range(1, steps, max(1, steps // 8)):
        work = run_bake(BakeRequest(scene, tmp_path / "result", {**QUICK, "seed": 5}))
        for _ in range(stop):
            try:
                stage = next(work).stage
            except StopIteration:
                break
            if stage == "store":  # from here on the new result may stand
                break
        work.close()
        if stage == "store":
            break
        assert {p.name: p.read_bytes() for p in (tmp_path / "result").iterdir()} == before


def test_bad_input_is_refused_before_anything_happens(scene: Path, tmp_path: Path) -> None:
    """Wrong options, a missing scene and a taken folder are refused, and nothing is written."""
    with pytest.raises(SettingsError):
        bake(scene, tmp_path / "result", rays=0)
    with pytest.raises(SceneError):
        bake(tmp_path / "missing.glb", tmp_path / "result")
    assert not (tmp_path / "result").exists()
    assert sorted(os.listdir(tmp_path)) == ["scene.ply"]


def test_side_file_settings_hold_unless_overruled(scene: Path, tmp_path: Path) -> None:
    """The side file's [bake] table counts, explicit options win, and a wrong key names the file."""
    side = tmp_path / "scene.ply.obscura.toml"
    side.write_text("[bake]\nseed = 77\ndistances = [5.0]\n")
    options = {"rays": 16, "device": "cpu", "seed": 3}
    work = run_bake(BakeRequest(scene, tmp_path / "result", options))
    with pytest.raises(StopIteration) as done:
        while True:
            next(work)
    settings = done.value.value.result.settings
    assert (settings.seed, settings.distances) == (3, (5.0,))
    side.write_text("[bake]\nsede = 77\n")
    with pytest.raises(SettingsError, match=r"obscura\.toml.*did you mean 'seed'"):
        bake(scene, tmp_path / "other")


def test_a_million_metres_away_nothing_changes(tmp_path: Path) -> None:
    """A level far from the origin bakes to the same AO: coordinates are recentred in float64 first."""
    results = []
    for shift in (0.0, 1e6):
        positions, faces = soup(quad(8.0), box((1.0, 2.0, 1.0)))
        rows = [f"v {x + shift:.6f} {y:.6f} {z - shift:.6f}" for x, y, z in positions]
        rows += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
        folder = tmp_path / f"{shift:g}"
        folder.mkdir()
        (folder / "level.obj").write_text("\n".join(rows))
        results.append(bake(folder / "level.obj", folder / "result")[0].result)
    near, far = results
    np.testing.assert_allclose(far.world.origin - near.world.origin, [1e6, 0.0, -1e6])
    np.testing.assert_allclose(near.world.positions, far.world.positions, atol=1e-9)
    assert np.abs(near.field.ao - far.field.ao).max() < 1e-3
