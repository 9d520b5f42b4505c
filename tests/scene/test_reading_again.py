"""A scene that is read again after an edit: the same scene and the same world as read and flattened afresh."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.scene import flatten, load_scene
from bake.scene.load import SceneReader
from bake.scene.reflatten import reflatten
from bake.scene.side_file_writer import edit_side_file
from bake.settings import BakeSettings
from bake.types import Scene, World
from tests.scene.glb_files import GltfFile, one_cube

PATHS = ("cube", "a", "b", "Group/c", "Group/d")
NUMBERS = st.floats(-2.0, 2.0)
KEYS = st.fixed_dictionaries(
    {},
    optional={
        "translate": st.tuples(NUMBERS, NUMBERS, NUMBERS),
        "rotate": st.tuples(NUMBERS, NUMBERS, NUMBERS),
        "scale": st.floats(0.5, 2.0),
        "role": st.sampled_from(["static", "blocker", "receiver", "ignore", "small"]),
        "two_sided": st.booleans(),
        "winding": st.sampled_from(["file", "flipped"]),
    },
)


def _level(folder: Path) -> Path:
    file: GltfFile = one_cube()
    for number, name in enumerate(("a", "b")):
        file.node(name, mesh=0, translation=[3.0 * number, 0.0, 5.0], scale=[1.0, -1.0, 2.0])
    children = [file.node(name, root=False, mesh=0, translation=[0.0, 4.0, index]) for index, name in enumerate("cd")]
    file.node("Group", children=children)
    return file.write(folder)


def _same(a: World, b: World) -> None:
    for field in dataclasses.fields(World):
        one, other = getattr(a, field.name), getattr(b, field.name)
        if isinstance(one, np.ndarray):
            assert one.dtype == other.dtype, field.name
            np.testing.assert_array_equal(one, other, err_msg=field.name)
        else:
            assert one == other, field.name


def _same_scene(a: Scene, b: Scene) -> None:
    assert (a.files, a.findings, a.regions, a.bake_options) == (b.files, b.findings, b.regions, b.bake_options)
    for one, other in zip(a.objects, b.objects, strict=True):
        assert (one.path, one.role, one.keys, one.placing) == (other.path, other.role, other.keys, other.placing)
        np.testing.assert_array_equal(one.transform, other.transform)


@settings(max_examples=25)
@given(st.lists(st.tuples(st.sampled_from(PATHS), KEYS), min_size=1, max_size=4), st.booleans())
def test_edits_are_followed_to_the_bit(
    tmp_path_factory: pytest.TempPathFactory, edits: list[tuple[str, dict[str, Any]]], copying: bool
) -> None:
    """After any chain of edits, copies among them, world and scene are those of a fresh start."""
    path = _level(tmp_path_factory.mktemp("level"))
    reader, bake = SceneReader(path), BakeSettings()
    scene = reader.read()
    world = flatten(scene, bake)
    for number, (match, keys) in enumerate(edits):
        copies = [{"of": match, "name": f"copy{number}", **keys}] if copying else []
        edit_side_file(path, {match: keys} if keys else {}, copies=copies)
        before, scene = scene, reader.read()
        assert all(a is b for a, b in zip(before.meshes, scene.meshes, strict=True))
        world = reflatten(world, before, scene, bake)
        _same(world, flatten(scene, bake))
    _same_scene(scene, load_scene(path))


def test_taken_away_objects_are_gone(tmp_path: Path) -> None:
    """A copy that is removed leaves the world as it was before it."""
    path = _level(tmp_path)
    reader, bake = SceneReader(path), BakeSettings()
    scenes = [reader.read()]
    world = flatten(scenes[0], bake)
    edit_side_file(path, {}, copies=[{"of": "a", "name": "x"}, {"of": "Group/c", "name": "y", "scale": 3.0}])
    scenes.append(reader.read())
    more = reflatten(world, scenes[0], scenes[1], bake)
    assert more.object_count == world.object_count + 2
    edit_side_file(path, {}, without=["x"])
    scenes.append(reader.read())
    less = reflatten(more, scenes[1], scenes[2], bake)
    _same(less, flatten(scenes[2], bake))
    assert less.object_paths[-1] == "Group/y"


def test_a_changed_scene_file_is_read_anew(tmp_path: Path) -> None:
    """Meshes are kept only as long as the file is the one that was parsed."""
    path = _level(tmp_path)
    reader, bake = SceneReader(path), BakeSettings()
    before = reader.read()
    world = flatten(before, bake)
    one_cube(translation=[0.0, 0.0, 9.0]).write(tmp_path)
    after = reader.read()
    assert [item.path for item in after.objects] == ["cube"]
    _same(reflatten(world, before, after, bake), flatten(after, bake))


def test_a_far_object_moves_the_origin(tmp_path: Path) -> None:
    """Where the old origin would cost precision, all is expanded about a new one."""
    path = _level(tmp_path)
    reader, bake = SceneReader(path), BakeSettings()
    before = reader.read()
    world = flatten(before, bake)
    edit_side_file(path, {"a": {"translate": [1e5, 0.0, 0.0]}})
    after = reader.read()
    moved = reflatten(world, before, after, bake)
    assert not np.array_equal(moved.origin, world.origin)
    _same(moved, flatten(after, bake))
