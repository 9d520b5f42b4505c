from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bake.errors import SceneError
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from tests.scene.glb_files import rgba_png

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def load(folder: Path, text: str | bytes, name: str = "level.obj"):
    """Loads an OBJ file with the given text."""
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return load_scene(path)


def test_objects_and_groups_stay_apart(tmp_path: Path) -> None:
    """An object is an (o, g) pair; pieces of one name belong together; `o` ends the group."""
    text = SQUARE + "f 1 2 3\no house\nf 1 2 3\ng roof\nf 1 2 3\ng wall\nf 1 3 4\ng roof\nf 1 3 4\no shed\nf 1 2 4\n"
    scene = load(tmp_path, text)
    assert [item.path for item in scene.objects] == ["level", "house", "house/roof", "house/wall", "shed"]
    assert [len(scene.meshes[item.mesh].faces) for item in scene.objects] == [1, 1, 2, 1, 1]
    assert scene.up_axis == -1


@pytest.mark.parametrize(
    "face",
    [
        "f 1 2 3",
        "f 1/1 2/1 3/1",
        "f 1//1 2//1 3//1",
        "f 1/1/1 2/1/1 3/1/1",
        "f -4 -3 -2",
        "f 1/ 2// 3/1/",
        "f\t1 2 3 # c",
    ],
)
def test_face_forms(tmp_path: Path, face: str) -> None:
    """All forms of corners name the same triangle."""
    scene = load(tmp_path, f"{SQUARE}vt 0 0\nvn 0 0 1\n{face}\n")
    mesh = scene.meshes[0]
    np.testing.assert_array_equal(mesh.positions[mesh.faces[0]], [[0, 0, 0], [1, 0, 0], [1, 1, 0]])
    np.testing.assert_allclose(mesh.normals, [[0, 0, 1]] * 3)


def test_forms_mix_within_a_face(tmp_path: Path) -> None:
    """Corners of different forms in one face are kept apart correctly."""
    mesh = load(tmp_path, f"{SQUARE}vt 0 0\nvn 0 0 1\nf 1/1/1 2 4/1\n").meshes[0]
    np.testing.assert_array_equal(mesh.positions[mesh.faces[0]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]])


def test_negative_indices_count_from_where_they_stand(tmp_path: Path) -> None:
    """Relative indices refer to the vertices read so far."""
    mesh = load(tmp_path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\n").meshes[0]
    np.testing.assert_array_equal(mesh.positions[mesh.faces[0]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]])


def test_stored_normals_are_kept(tmp_path: Path) -> None:
    """A corner's normal is the file's; corners that agree share a vertex, which leads back to the file's."""
    text = SQUARE + "vn 0 0 3\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//1 3//1 4//2\n"
    mesh = load(tmp_path, text).meshes[0]
    assert len(mesh.positions) == 4
    np.testing.assert_array_equal(mesh.source_vertex[mesh.faces], [[0, 1, 2], [0, 2, 3]])
    np.testing.assert_allclose(mesh.normals[mesh.faces[1]], [[0, 0, 1], [0, 0, 1], [0, 1, 0]])


def test_made_normals_cross_group_borders(tmp_path: Path) -> None:
    """Groups that touch at a flat angle share their normals along the border."""
    text = "v 0 0 0\nv 1 0 0.1\nv 2 0 0\nv 0 1 0\nv 1 1 0.1\nv 2 1 0\ng a\nf 1 2 5 4\ng b\nf 2 3 6 5\n"
    scene = load(tmp_path, text)
    for mesh in scene.meshes:
        ridge = mesh.positions[:, 0] == 1.0
        np.testing.assert_allclose(mesh.normals[ridge], [[0, 0, 1]] * 2, atol=1e-6)
    assert [f.count for f in scene.findings if f.what == "normals-made"] == [4, 4]


def test_polygons_become_triangles(tmp_path: Path) -> None:
    """A pentagon gives three triangles of its own winding and area."""
    text = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 1 0\nv 0 2 0\nf 1 2 3 4 5\n"
    mesh = load(tmp_path, text).meshes[0]
    corners = mesh.positions[mesh.faces]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(3.0)


def test_text_forms(tmp_path: Path) -> None:
    """UTF-16, line continuations, carriage returns, colours after positions and odd numbers are all read."""
    text = "v 0 0 0 1 .5 .5\r\nv +1e0 0. \\\r\n 0\r\n  v\t0 1 -0\r\nf 1 2 3"
    for content in (text.encode(), text.encode("utf-16"), b"\xef\xbb\xbf" + text.encode()):
        mesh = load(tmp_path, content).meshes[0]
        np.testing.assert_array_equal(mesh.positions[mesh.faces[0]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]])


def test_names_that_collide_are_numbered(tmp_path: Path) -> None:
    """An object called like another's object/group pair gets a number."""
    scene = load(tmp_path, SQUARE + "o a/b\nf 1 2 3\no a\ng b\nf 1 2 3\n")
    assert [item.path for item in scene.objects] == ["a/b#1", "a/b#2"]


def test_what_is_set_aside_is_counted(tmp_path: Path) -> None:
    """Lines, points, short faces and unused vertices are reported."""
    scene = load(tmp_path, SQUARE + "l 1 2\np 1\nf 1 2\nf 1 2 3\n")
    found = {f.what: f.count for f in scene.findings}
    assert found["not-triangles"] == 2
    assert found["incomplete-triangle"] == 1
    assert found["unreferenced-vertices"] == 1


def test_material_opacity(tmp_path: Path) -> None:
    """`d` and `Tr` of the material file make faces let light through."""
    (tmp_path / "my.mtl").write_text("newmtl glass\nd 0.25\nnewmtl veil\nTr 0.4\nnewmtl wall\nKd 1 1 1\n")
    text = SQUARE + "mtllib my.mtl\n" + "".join(f"usemtl {n}\nf 1 2 3\n" for n in ("glass", "veil", "wall", "none"))
    world = flatten(load(tmp_path, text), BakeSettings())
    np.testing.assert_allclose(world.face_openness, [0.75, 0.4, 0, 0])


def test_material_mask(tmp_path: Path) -> None:
    """`map_d` opens what the texture leaves open; v counts from the bottom of the image."""
    alpha = np.zeros((8, 8), np.uint8)
    alpha[:4] = 255  # the upper half of the picture is opaque
    (tmp_path / "leaf mask.png").write_bytes(rgba_png(alpha))
    (tmp_path / "my.mtl").write_text("newmtl leaf\nmap_d -clamp on -s 1 1 1 leaf mask.png\n")
    text = SQUARE + "mtllib my.mtl\nusemtl leaf\nvt 0 0\nvt 1 0\nvt 1 .5\nvt 0 .5\nf 1/1 2/2 3/3 4/4\n"
    scene = load(tmp_path, text)
    np.testing.assert_allclose(flatten(scene, BakeSettings()).face_openness, 1.0)
    assert set(scene.files) >= {"level.obj", "my.mtl", "leaf mask.png"}


def test_missing_material_file_is_a_finding(tmp_path: Path) -> None:
    """Without its material file a level bakes as opaque, and says so."""
    scene = load(tmp_path, SQUARE + "mtllib gone.mtl\nusemtl glass\nf 1 2 3\n")
    assert "missing-material-file" in {f.what for f in scene.findings}
    assert scene.files["gone.mtl"] == ""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no triangles"),
        (SQUARE, "no triangles"),
        (SQUARE + "o box\nf 1 2 5", "box: a face refers to vertex 5 of 4"),
        (SQUARE + "f 0 1 2", "vertex 0 of 4"),
        (SQUARE + "f -5 1 2", "vertex -5 of 4"),
        (SQUARE + "f 1//1 2//1 3//1", "normal 1 of 0"),
        (SQUARE + "f 1/2 2/1 3/1", "texture point 2 of 0"),
        (SQUARE + "f 1 2 x", "'x'"),
        (SQUARE + "f 1 2 3.5", "'3.5'"),
        (SQUARE + "f 1/2/3/4 2 3", "'1/2/3/4'"),
        (SQUARE + "f 1 2 " + "9" * 30, "corner '9999"),
        ("v 0 0\nf 1 1 1", "v number 1 is '0 0'"),
        ("v 0 0 zero\nf 1 1 1", "v number 1"),
        ("v 0 0 nan\nf 1 1 1", "v number 1"),
        ("v 0 0 1e999\nf 1 1 1", "v number 1"),
        (b"\xff\xfe\x00\xd8", "UTF-16|no triangles"),
    ],
)
def test_malformed_files_are_refused(tmp_path: Path, text: str | bytes, message: str) -> None:
    """Each fault ends as one line that names the file and the place."""
    with pytest.raises(SceneError, match=message) as caught:
        load(tmp_path, text)
    assert "level.obj" in str(caught.value)
    assert "\n" not in str(caught.value)
