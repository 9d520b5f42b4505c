"""Scenes without a surface that receives: what decorators they have is baked, and nothing else is done."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bake.errors import SceneError
from bake.pipeline import BakeRequest, run_bake
from bake.results import load_result
from bake.types import BakeResult, VertexState
from tests.worlds import box, icosphere

QUICK = {"rays": "16", "samples-per-face": "1:2", "volume-directions": "64", "device": "cpu"}


def bake(folder: Path, roles: dict[str, str], **options: Any) -> BakeResult:
    """Bakes two solids a little apart, with roles by object."""
    lines: list[str] = []
    first = 1
    for name, (positions, faces) in {"a": box((2.0, 3.0, 2.0)), "b": icosphere(1, 0.5, centre=(5.0, 0.0, 0.0))}.items():
        lines += [f"o {name}", *(f"v {x} {y} {z}" for x, y, z in positions)]
        lines += [f"f {i} {j} {k}" for i, j, k in faces + first]
        first += len(positions)
    scene = folder / "scene.obj"
    scene.write_text("\n".join(lines))
    side = "".join(f'[[object]]\nmatch = "{name}"\nrole = "{role}"\n' for name, role in roles.items())
    scene.with_name("scene.obscura.toml").write_text(side)
    work = run_bake(BakeRequest(scene, folder / "result", {**QUICK, **options}))
    while True:
        try:
            next(work)
        except StopIteration as done:
            return done.value.result


@pytest.mark.parametrize("tracer", ["embree", "warp", "brute"])
def test_trees_alone_are_baked(tmp_path: Path, tracer: str) -> None:
    """A tree in the open and nothing else: no sample, no solve, and global AO is 1 without slope."""
    bake(tmp_path, {"a": "tree", "b": "ignore"}, tracer=tracer)
    result = load_result(tmp_path / "result")
    status = {row.name: (row.status, row.rays > 0) for row in result.stages}
    assert status["trace"] == status["map to vertices"] == ("skipped", False)
    assert status["tree volume"] == status["trees"] == status["fit trees"] == ("ran", True)
    assert len(result.samples) == 0
    assert np.isnan(result.field.ao).all()
    assert (result.field.state == VertexState.NOT_BAKED).all()
    assert result.decorators is not None
    assert result.decorators.fits is not None
    wanted = np.tile([[1.0], [0.0], [0.0], [0.0]], (1, 2))
    np.testing.assert_allclose(result.decorators.fits.coefficients, [wanted], atol=0.01)


def test_small_decorators_and_shrubs_alone_are_open(tmp_path: Path) -> None:
    """Nothing lies around them, which a finding says for each role."""
    result = bake(tmp_path, {"a": "small", "b": "shrub"})
    assert result.decorators is not None
    for scalars in (result.decorators.small_scalars, result.decorators.shrub_scalars):
        assert scalars is not None
        assert scalars.ao.tolist() == [[1.0, 1.0]]
        assert not scalars.found.any()
    assert [finding.object for finding in result.findings if finding.what == "no-surface-around"] == ["b", "a"]


@pytest.mark.parametrize(
    ("roles", "skip"),
    [({"*": "blocker"}, ""), ({"*": "ignore"}, ""), ({"*": "tree"}, "trees"), ({"*": "small"}, "decorators")],
)
def test_nothing_to_bake_is_refused(tmp_path: Path, roles: dict[str, str], skip: str) -> None:
    """Neither surface nor decorator, or decorators that are to be skipped: one line says so, and no result is left."""
    with pytest.raises(SceneError, match="nothing receives"):
        bake(tmp_path, roles, **({"skip": skip} if skip else {}))
    assert not (tmp_path / "result").exists()
