"""Fog and trees in a whole bake: the stage report, and what they do to the ground."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bake.pipeline import BakeRequest, run_bake
from bake.results import load_result
from bake.types import BakeResult, StageReport
from tests.worlds import box, quad

QUICK = {"rays": "32", "samples-per-face": "2:4", "device": "cpu", "distances": "2,300"}


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A floor with a box over each half, as three objects of an OBJ file."""
    path = tmp_path / "scene.obj"
    write_obj(
        path,
        {
            "floor": quad(8.0),
            "left": box((2.0, 1.0, 6.0), centre=(-2.0, 0.6, 0.0)),
            "right": box((2.0, 1.0, 6.0), centre=(2.0, 0.6, 0.0)),
        },
    )
    return path


def write_obj(path: Path, objects: dict[str, tuple[np.ndarray, np.ndarray]]) -> None:
    """Objects as an OBJ file."""
    lines: list[str] = []
    first = 1
    for name, (positions, faces) in objects.items():
        lines.append(f"o {name}")
        lines += [f"v {x} {y} {z}" for x, y, z in positions]
        lines += [f"f {a} {b} {c}" for a, b, c in faces + first]
        first += len(positions)
    path.write_text("\n".join(lines))


def bake(scene: Path, roles: dict[str, str], **options: Any) -> BakeResult:
    """Bakes with roles by object."""
    side = "".join(f'[[object]]\nmatch = "{name}"\nrole = "{role}"\n' for name, role in roles.items())
    scene.with_name("scene.obscura.toml").write_text(side)
    work = run_bake(BakeRequest(scene, scene.parent / "result", {**QUICK, **options}))
    while True:
        try:
            next(work)
        except StopIteration as done:
            return done.value.result


def row(result: BakeResult, name: str) -> StageReport:
    """One row of the stage report."""
    return next(item for item in result.stages if item.name == name)


def floor_mean(result: BakeResult) -> float:
    """Mean AO of the floor's samples, shortest distance."""
    return float(result.tally.ao[result.world.face_object[result.samples.face] == 0, 0].mean())


def test_without_shrubs_and_trees_nothing_is_built_or_cast(scene: Path) -> None:
    """The report: every stage of decorators skipped, no time, memory or ray of its own, and nothing but triangles."""
    result = bake(scene, {})
    assert row(result, "fog") == StageReport("fog", "skipped", "no shrubs in the scene")
    assert row(result, "trees") == StageReport("trees", "skipped", "no trees in the scene")
    assert row(result, "decorators") == StageReport("decorators", "skipped", "no small decorators in the scene")
    assert row(result, "lods") == StageReport("lods", "skipped", "no lower LODs in the scene")
    assert row(result, "build BVH").why == "26 triangles"
    assert sum(item.rays for item in result.stages) == row(result, "trace").rays == 32 * len(result.samples)
    assert result.decorators is None


def test_coincident_shrubs_darken_as_one(scene: Path) -> None:
    """Five copies of a shrub in one place leave the floor exactly as bright as a single one."""
    (one, faces), (floor, under) = box((2.0, 1.0, 6.0), centre=(-2.0, 0.6, 0.0)), quad(8.0)
    results: list[BakeResult] = []
    for count in (1, 5):
        write_obj(scene, {"floor": (floor, under)} | {f"shrub_{i}": (one, faces) for i in range(count)})
        results.append(bake(scene, {"shrub_*": "shrub"}))
    single, several = (result.tally.ao for result in results)
    assert row(results[1], "build BVH").why == "2 triangles, 5 boxes of fog"
    np.testing.assert_allclose(several, single, atol=1e-6)
    assert single.min() < 0.9


def test_shrubs_darken_the_floor_and_are_stored(scene: Path) -> None:
    """Fog lies between no occluder and a solid one; its boxes come back from the stored result."""
    bare = floor_mean(bake(scene, {"left": "ignore", "right": "ignore"}))
    solid = floor_mean(bake(scene, {}))
    result = bake(scene, {"left": "shrub", "right": "shrub"})
    assert solid + 0.05 < floor_mean(result) < bare - 0.05
    assert row(result, "fog").status == "ran"
    assert row(result, "build BVH").why == "2 triangles, 2 boxes of fog"
    stored = load_result(scene.parent / "result").decorators
    assert stored is not None
    assert stored.fog is not None
    np.testing.assert_allclose(stored.fog.density, 0.35)
    thin = bake(scene, {"left": "shrub", "right": "shrub"}, **{"fog-density": "0.1"})
    assert floor_mean(result) + 0.05 < floor_mean(thin) < bare


def test_skipped_fog_is_not_there(scene: Path) -> None:
    """With --skip fog the floor is as bare as without shrubs."""
    bare = bake(scene, {"left": "ignore", "right": "ignore"})
    result = bake(scene, {"left": "shrub", "right": "shrub"}, skip="fog")
    assert row(result, "fog").why == "asked for by --skip"
    assert row(result, "build BVH").why == "2 triangles"
    assert floor_mean(result) == pytest.approx(floor_mean(bare), abs=1e-6)


def test_trees_dim_and_the_report_counts_them(scene: Path) -> None:
    """A tree in the shape of a box dims every ray through its two walls to a quarter, unless skipped."""
    bare = floor_mean(bake(scene, {"left": "ignore", "right": "ignore"}))
    result = bake(scene, {"left": "tree", "right": "ignore"})
    assert row(result, "build BVH").why == "2 triangles, 12 triangles of trees"
    assert floor_mean(result) < bare - 0.05
    skipped = bake(scene, {"left": "tree", "right": "ignore"}, skip="trees")
    assert row(skipped, "build BVH").why == "2 triangles"
    assert floor_mean(skipped) == pytest.approx(bare, abs=1e-6)
