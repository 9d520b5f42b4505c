"""Exports of levels in which the side file moved objects and made copies."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
from synthetic_results import build_result

from bake.results.export import export
from bake.scene import flatten, load_scene
from bake.scene.side_file_writer import edit_side_file
from bake.settings import BakeSettings
from bake.types import BakeResult, Scene, World
from tests.scene.glb_files import one_quad


def _result(path: Path) -> tuple[BakeResult, Scene]:
    """A result of a scene whose AO is a number of its own for each object."""
    scene, settings = load_scene(path), BakeSettings()
    world = flatten(scene, settings)
    owner = np.searchsorted(world.first_vertex, np.arange(world.vertex_count), side="right") - 1
    ao = np.repeat((0.1 + owner / 10)[:, None], settings.distance_count, axis=1).astype(np.float32)
    made = build_result(scene_path=path, files=dict(scene.files))
    field = dataclasses.replace(made.field, ao=ao, state=np.zeros(len(ao), np.uint8))
    return dataclasses.replace(made, world=world, field=field, settings=settings), scene


def _places(world: World) -> dict[str, np.ndarray]:
    return {
        path.rpartition("/")[2]: world.positions[world.first_vertex[index] : world.first_vertex[index + 1]]
        + world.origin
        for index, path in enumerate(world.object_paths)
    }


def test_everything_stands_where_it_was_baked(tmp_path: Path) -> None:
    """Moved objects without their children, copies and copies of copies; each with its own AO."""
    file = one_quad()
    hinge = file.node("hinge", root=False, mesh=0, translation=[0.0, 1.0, 0.0])
    door = file.node("door", root=False, mesh=0, translation=[2.0, 0.0, 0.0], scale=[2.0, 1.0, 1.0], children=[hinge])
    file.node("House", translation=[10.0, 0.0, 0.0], children=[door])
    path = file.write(tmp_path)
    edit_side_file(
        path,
        {"House/door": {"translate": [0.0, 0.0, 7.0], "rotate": [0.0, 90.0, 0.0]}},
        copies=[
            {"of": "House/door/hinge", "name": "second", "translate": [0.0, 3.0, 0.0]},
            {"of": "House/door/second", "name": "third", "scale": 2.0},
        ],
    )
    result, scene = _result(path)
    assert export(result, tmp_path / "out.glb", scene=scene) == ()
    (tmp_path / "alone").mkdir()
    (tmp_path / "out.glb").rename(tmp_path / "alone" / "out.glb")
    again = load_scene(tmp_path / "alone" / "out.glb")
    exported, baked = _places(flatten(again, BakeSettings())), _places(result.world)
    assert exported.keys() == baked.keys()
    for name, positions in baked.items():
        np.testing.assert_allclose(exported[name], positions, atol=1e-5, err_msg=name)
