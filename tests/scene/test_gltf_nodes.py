from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bake.errors import SceneError
from bake.scene import load_scene
from bake.scene.gltf_nodes import compose
from bake.scene.parsed import number_repeats
from bake.types import Role
from tests.scene.glb_files import GltfFile, one_quad

finite = st.floats(-100, 100)


@given(st.tuples(finite, finite, finite), st.tuples(finite, finite, finite, finite), st.tuples(finite, finite, finite))
def test_compose_matches_an_independent_rotation(translation, rotation, scale) -> None:
    """T·R·S equals the matrix built with SciPy's quaternions, whatever the quaternion's length."""
    if np.linalg.norm(rotation) < 1e-3:
        rotation = (0.0, 0.0, 0.0, 1.0)
    expected = np.eye(4)
    expected[:3, :3] = Rotation.from_quat(rotation).as_matrix() * np.array(scale)
    expected[:3, 3] = translation
    actual = compose(np.array([translation]), np.array([rotation]), np.array([scale]))[0]
    np.testing.assert_allclose(actual, expected, atol=1e-9)


@given(st.lists(st.sampled_from(["oak", "pine", "oak#1", "oak#2", "rock"]), max_size=12))
def test_numbered_paths_are_unique(paths: list[str]) -> None:
    """No two objects end up with one path, and what occurs once keeps its name."""
    numbered = number_repeats(paths)
    assert len(set(numbered)) == len(paths)
    for path, result in zip(paths, numbered, strict=True):
        assert result == path if paths.count(path) == 1 else result.startswith(path + "#")


def test_paths_follow_the_tree(tmp_path: Path) -> None:
    """A path joins the names from the root; repeats are numbered in scene order; unnamed nodes get their index."""
    file = one_quad()
    quad = {"mesh": 0}
    trees = [file.node("oak", root=False, **quad), file.node("oak", root=False, **quad), file.node(root=False, **quad)]
    file.node("Level", children=[file.node("Trees", root=False, children=trees)])
    scene = load_scene(file.write(tmp_path))
    assert [item.path for item in scene.objects] == [
        "quad",
        "Level/Trees/oak#1",
        "Level/Trees/oak#2",
        "Level/Trees/node_3",
    ]
    assert [item.node for item in scene.objects] == [0, 1, 2, 3]
    assert len(scene.meshes) == 1


def test_transforms_multiply_down_the_tree(tmp_path: Path) -> None:
    """A child's transform is applied before its parent's, whether matrix or TRS."""
    file = one_quad()
    child = file.node("child", root=False, mesh=0, translation=[1, 0, 0])
    matrix = np.diag([2.0, 3.0, 4.0, 1.0])
    matrix[:3, 3] = 10, 20, 30
    file.node("parent", children=[child], matrix=matrix.T.ravel().tolist())
    placed = load_scene(file.write(tmp_path)).objects[1].transform
    np.testing.assert_allclose(placed @ [1, 1, 1, 1], [14, 23, 34, 1])


def test_gpu_instances_become_objects(tmp_path: Path) -> None:
    """EXT_mesh_gpu_instancing gives an object an instance, with the instance's transform inside the node's."""
    file = one_quad()
    half = np.sqrt(0.5)
    attributes = {
        "TRANSLATION": file.accessor([[1, 0, 0], [2, 0, 0], [3, 0, 0]]),
        "ROTATION": file.accessor([[0, 0, 0, 1], [0, half, 0, half], [0, 0, 0, 1]]),
        "SCALE": file.accessor([[1, 1, 1], [1, 1, 1], [2, 2, 2]]),
        "_ID": file.accessor([0, 1, 2], "u2"),
    }
    file.node(
        "grass", mesh=0, translation=[0, 5, 0], extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    )
    objects = load_scene(file.write(tmp_path)).objects[1:]
    assert [(item.path, item.node_instance) for item in objects] == [("grass#1", 0), ("grass#2", 1), ("grass#3", 2)]
    np.testing.assert_allclose(objects[1].transform @ [1, 0, 0, 1], [2, 5, -1, 1], atol=1e-6)
    np.testing.assert_allclose(objects[2].transform @ [1, 0, 0, 1], [5, 5, 0, 1])


def test_quantised_instance_rotations(tmp_path: Path) -> None:
    """Instance rotations may be normalised integers."""
    file = one_quad()
    rotation = file.accessor([[0, 127, 0, 0]], "i1", normalized=True)
    file.node("turned", mesh=0, extensions={"EXT_mesh_gpu_instancing": {"attributes": {"ROTATION": rotation}}})
    placed = load_scene(file.write(tmp_path)).objects[1].transform
    np.testing.assert_allclose(placed[:3, :3], np.diag([-1, 1, -1]), atol=1e-6)


def test_default_scene_is_read(tmp_path: Path) -> None:
    """Of several scenes, the default one is baked, and the others are mentioned."""
    file = one_quad()
    other = file.node("other", root=False, mesh=0)
    file.document["scenes"].append({"nodes": [other]})
    file.document["scene"] = 1
    scene = load_scene(file.write(tmp_path))
    assert [item.path for item in scene.objects] == ["other"]
    assert [f.count for f in scene.findings if f.what == "other-scenes"] == [1]


def test_without_scenes_the_root_nodes_are_read(tmp_path: Path) -> None:
    """A file without scenes shows all nodes that no other node holds."""
    file = one_quad()
    file.node("parent", children=[0])
    del file.document["scenes"], file.document["scene"]
    assert [item.path for item in load_scene(file.write(tmp_path)).objects] == ["parent/quad"]


def test_extras_hold_for_the_subtree(tmp_path: Path) -> None:
    """Roles in extras pass to the nodes below, until one of them says otherwise."""
    file = one_quad()
    leaves = file.node("leaves", root=False, mesh=0)
    stone = file.node("stone", root=False, mesh=0, extras={"obscura": {"role": "static"}})
    file.node("oak", children=[leaves, stone], extras={"obscura": {"role": "tree", "transmission": 0.25}, "else": 1})
    objects = {item.path: item for item in load_scene(file.write(tmp_path)).objects}
    assert objects["quad"].role is Role.STATIC
    assert objects["oak/leaves"].role is Role.TREE
    assert objects["oak/leaves"].keys.transmission == 0.25
    assert objects["oak/stone"].role is Role.STATIC


def test_a_deep_tree_is_no_problem(tmp_path: Path) -> None:
    """A chain of 5000 nodes is walked without recursion."""
    file = one_quad()
    child = 0
    for _ in range(5000):
        child = file.node("n", root=False, children=[child])
    file.document["scenes"][0]["nodes"] = [child]
    scene = load_scene(file.write(tmp_path))
    assert scene.objects[0].path.endswith("/n/quad")


@pytest.mark.parametrize("children", [[0], [1, 1]])
def test_cycles_and_shared_children_are_refused(tmp_path: Path, children: list[int]) -> None:
    """A node that is reached twice is refused."""
    file = GltfFile()
    file.node("top", children=children)
    file.node("below", root=False)
    with pytest.raises(SceneError, match="reached twice"):
        load_scene(file.write(tmp_path))
