"""A whole bake with small decorators and a lower level of detail, from the file to the export."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bake.pipeline import BakeRequest, run_bake
from bake.results import load_result
from bake.results.export import export
from bake.scene import load_scene
from bake.types import BakeResult, Role, VertexState
from tests.worlds import box

SIDE_FILE = """
[[object]]
match = "grass*"
role = "small"
[[object]]
match = "lower"
role = "lod"
of = "crate"
"""


def floor(width: float, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """A level floor fine enough to show a shade."""
    line = np.linspace(-width / 2, width / 2, cells + 1)
    z, x = np.meshgrid(line, line)
    corner = np.arange(cells * (cells + 1)).reshape(cells, cells + 1)[:, :-1].ravel()
    faces = [[corner, corner + 1, corner + cells + 1], [corner + 1, corner + cells + 2, corner + cells + 1]]
    positions = np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, 3)
    return positions, np.concatenate([np.stack(part, axis=1) for part in faces])


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A floor with a crate in two levels of detail, grass beside it and one clump far away."""
    parts = {
        "floor": floor(6.0, 16),
        "crate": box((1.0, 1.0, 1.0), centre=(0.0, 0.5, 0.0)),
        "lower": box((0.98, 0.98, 0.98), centre=(0.0, 0.5, 0.0)),
        "grass_1": box((0.2, 0.2, 0.2), centre=(0.7, 0.1, 0.0)),
        "grass_2": box((0.2, 0.2, 0.2), centre=(2.5, 0.1, 2.5)),
        "grass_far": box((0.2, 0.2, 0.2), centre=(0.0, 9.0, 0.0)),
    }
    lines: list[str] = []
    first = 1
    for name, (positions, faces) in parts.items():
        lines += [f"o {name}", *(f"v {x} {y} {z}" for x, y, z in positions)]
        lines += [f"f {a + first} {b + first} {c + first}" for a, b, c in faces]
        first += len(positions)
    path = tmp_path / "yard.obj"
    path.write_text("\n".join(lines))
    path.with_suffix(".obscura.toml").write_text(SIDE_FILE)
    return path


def baked(scene: Path, **options: Any) -> BakeResult:
    """Runs a bake to its end."""
    settings = {"rays": 32, "device": "cpu", "distances": "2", **options}
    work = run_bake(BakeRequest(scene, scene.with_name("result"), settings))
    while True:
        try:
            next(work)
        except StopIteration as done:
            return done.value.result


def test_from_the_file_to_the_export(scene: Path, tmp_path: Path) -> None:
    """Grass by the crate is darker than in the open, the far clump is open and named, the lower level has values."""
    baked(scene)
    result = load_result(tmp_path / "result")
    assert result.decorators is not None
    small = result.decorators.small_scalars
    assert small is not None
    values = {result.world.object_paths[i]: float(ao[0]) for i, ao in zip(small.object, small.ao, strict=True)}
    assert values["grass_1"] < values["grass_2"] - 0.05
    assert values["grass_far"] == 1.0
    assert any(f.what == "no-surface-around" and f.object == "grass_far" for f in result.findings)
    lower = result.world.object_roles.index(Role.LOD)
    part = slice(int(result.world.first_vertex[lower]), int(result.world.first_vertex[lower + 1]))
    assert (result.field.state[part] == VertexState.BAKED).all()
    rows = {row.name: row for row in result.stages}
    assert rows["decorators"].status == rows["lods"].status == "ran"
    assert rows["decorators"].rays > 0
    assert rows["lods"].rays > 0
    export(result, tmp_path / "out.glb", scene=load_scene(scene))
    side = json.loads((tmp_path / "out.decorators.json").read_text())
    assert side["small"]["grass_1"]["ao"] == pytest.approx([values["grass_1"]])


def test_skipped_stages_do_nothing(scene: Path) -> None:
    """With both stages skipped there are no scalars, the lower level stays unbaked, and the report says why."""
    result = baked(scene, skip="decorators,lods")
    assert result.decorators is None
    lower = result.world.object_roles.index(Role.LOD)
    assert np.isnan(result.field.ao[int(result.world.first_vertex[lower])]).all()
    rows = {row.name: row for row in result.stages}
    for name in ("decorators", "lods"):
        assert (rows[name].status, rows[name].rays, rows[name].why) == ("skipped", 0, "asked for by --skip")
