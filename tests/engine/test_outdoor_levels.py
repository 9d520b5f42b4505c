"""Whole outdoor levels with every kind of decorator, from the file to the stored result."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from assets.black_forest.roles import LODS, ROLES, prepare
from bake.pipeline import BakeRequest, run_bake
from bake.results import load_result
from bake.types import BakeResult, Role, StageReport

ROOT = Path(__file__).resolve().parents[2]
FOREST = (ROOT / "../shared/scenes/stk_black_forest/stk_black_forest.glb").resolve()
LEVEL = ROOT / "assets/sample_level/level.glb"
QUICK = {"rays": 4, "samples-per-face": "1:1", "volume-directions": 32, "device": "cpu"}

pytestmark = pytest.mark.slow


def bake(scene: Path, folder: Path, **options: object) -> BakeResult:
    """Bakes and reads back."""
    for _ in run_bake(BakeRequest(scene, folder, {**QUICK, **options})):
        pass
    return load_result(folder)


def check_decorators(result: BakeResult) -> None:
    """Every part is there, for as many objects as have its role, and finite."""
    decorators, roles = result.decorators, result.world.object_roles
    assert decorators is not None
    fog, volume, fits = decorators.fog, decorators.volume, decorators.fits
    shrubs, small = decorators.shrub_scalars, decorators.small_scalars
    assert fog is not None and volume is not None and fits is not None and shrubs is not None and small is not None
    assert len(fog) == len(shrubs.object) == roles.count(Role.SHRUB)
    assert len(fits.object) == roles.count(Role.TREE)
    assert len(small.object) == roles.count(Role.SMALL)
    assert len(decorators.models) == len({model.mesh for model in decorators.models}) > 1
    for values in (
        fog.density, fog.minimum, fog.maximum, volume.sh, fits.coefficients, fits.centre, fits.rmse_global,
        fits.rmse_product, fits.rmse_volume, shrubs.ao, small.ao, *(model.local_ao for model in decorators.models),
    ):  # fmt: skip
        assert np.isfinite(values).all()
    assert ((fog.density > 0.0) & (fog.density <= fog.given_density)).all()
    for values in (shrubs.ao, small.ao, *(model.local_ao for model in decorators.models)):
        assert ((values >= 0.0) & (values <= 1.0)).all()
    assert (fits.rmse_product.mean(axis=0) < fits.rmse_global.mean(axis=0)).all()
    assert (volume.valid == 1).any()


def row(result: BakeResult, name: str) -> StageReport:
    """One row of the stage report."""
    return next(item for item in result.stages if item.name == name)


@pytest.mark.shared
@pytest.mark.skipif(not FOREST.exists(), reason="the real scenes are not here")
def test_the_black_forest(tmp_path: Path) -> None:
    """A thousand trees, shrubs, small things and a level of detail, on a track four kilometres wide."""
    before = sorted(path.name for path in FOREST.parent.iterdir())
    scene = prepare(FOREST, tmp_path / "forest")
    assert sorted(path.name for path in FOREST.parent.iterdir()) == before
    result = bake(scene, tmp_path / "result", **{"volume-spacing": 16, "sample-spacing": 4})
    assert not [finding for finding in result.findings if finding.what == "pattern-without-match"]
    assert set(result.world.object_roles) == {*(Role(role) for role in ROLES), Role.STATIC, Role.LOD}
    check_decorators(result)
    assert result.world.object_roles.count(Role.TREE) > 1000
    for path in LODS:
        number = result.world.object_paths.index(path)
        first, last = result.world.first_vertex[number : number + 2]
        assert np.isfinite(result.field.ao[first:last]).all()
    for name in ("fog", "tree volume", "trees", "fit trees", "decorators", "lods"):
        assert row(result, name).status == "ran"


def test_the_sample_level(tmp_path: Path) -> None:
    """All roles of the sample level, at few rays."""
    result = bake(LEVEL, tmp_path / "result", **{"volume-spacing": 2})
    check_decorators(result)
    assert row(result, "lods").why.startswith("2 lower LODs")
