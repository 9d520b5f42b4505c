from __future__ import annotations

import base64
from pathlib import Path

import numpy as np
import pytest

from bake.scene import load_scene
from bake.types import PrimitiveRange
from tests.scene.glb_files import CUBE, CUBE_FACES, QUAD, QUAD_FACES, TRIANGLE, GltfFile, one_cube, one_quad

UP = np.tile([0.0, 0.0, 1.0], (4, 1))


def load_mesh(file: GltfFile, folder: Path):
    """The first mesh of a file."""
    return load_scene(file.write(folder)).meshes[0]


def test_indexed_triangles(tmp_path: Path) -> None:
    """Positions, normals and faces come out as they were stored."""
    mesh = load_mesh(one_quad(), tmp_path)
    np.testing.assert_array_equal(mesh.positions, QUAD)
    np.testing.assert_array_equal(mesh.normals, UP)
    np.testing.assert_array_equal(mesh.faces, QUAD_FACES)
    assert mesh.primitives == (PrimitiveRange(0, 0, 4, 0, 2),)
    assert mesh.source_vertex is None


def test_triangles_without_indices(tmp_path: Path) -> None:
    """Without indices, every three vertices are a face."""
    file = GltfFile()
    file.node("soup", mesh=file.mesh(file.primitive(QUAD[QUAD_FACES.ravel()], normals=np.tile([0, 0, 1], (6, 1)))))
    np.testing.assert_array_equal(load_mesh(file, tmp_path).faces, [[0, 1, 2], [3, 4, 5]])


@pytest.mark.parametrize("dtype", ["u1", "u2", "u4"])
def test_index_types(tmp_path: Path, dtype: str) -> None:
    """All three index widths are read."""
    file = one_quad()
    file.document["meshes"][0]["primitives"][0]["indices"] = file.accessor(QUAD_FACES.ravel(), dtype)
    np.testing.assert_array_equal(load_mesh(file, tmp_path).faces, QUAD_FACES)


def test_strip_keeps_its_winding(tmp_path: Path) -> None:
    """All faces of a strip look the same way, and stitching triangles vanish."""
    file = GltfFile()
    zigzag = np.array([[x // 2, x % 2, 0] for x in range(6)], np.float32)
    strip = [0, 1, 2, 3, 3, 4, 5]
    normals = np.tile([0, 0, -1], (6, 1))
    file.node("strip", mesh=file.mesh(file.primitive(zigzag, strip, normals=normals, mode=5)))
    mesh = load_mesh(file, tmp_path)
    corners = mesh.positions[mesh.faces]
    heights = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    assert len(mesh.faces) == 3
    assert (heights < 0).all() or (heights[:2] < 0).all()


def test_fan(tmp_path: Path) -> None:
    """A fan turns about its first vertex."""
    file = GltfFile()
    file.node("fan", mesh=file.mesh(file.primitive(QUAD, [0, 1, 2, 3], normals=UP, mode=6)))
    mesh = load_mesh(file, tmp_path)
    assert {tuple(sorted(face)) for face in mesh.faces.tolist()} == {(0, 1, 2), (0, 2, 3)}
    corners = mesh.positions[mesh.faces]
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0).all()


def test_points_and_lines_are_set_aside(tmp_path: Path) -> None:
    """Primitives that are no triangles are reported, and the rest is baked."""
    file = GltfFile()
    lines = file.primitive(QUAD, mode=1)
    file.node("mixed", mesh=file.mesh(lines, file.primitive(QUAD, QUAD_FACES, normals=UP)))
    scene = load_scene(file.write(tmp_path))
    assert len(scene.meshes[0].faces) == 2
    assert [(f.object, f.severity) for f in scene.findings if f.what == "not-triangles"] == [("mixed", "set-aside")]
    assert scene.meshes[0].primitives == (PrimitiveRange(1, 0, 4, 0, 2),)


def test_incomplete_triangle_is_reported(tmp_path: Path) -> None:
    """Indices that make no whole triangle are left out and counted."""
    file = one_quad()
    file.document["meshes"][0]["primitives"][0]["indices"] = file.accessor([0, 1, 2, 0, 2], "u2")
    scene = load_scene(file.write(tmp_path))
    assert len(scene.meshes[0].faces) == 1
    assert [f.count for f in scene.findings if f.what == "incomplete-triangle"] == [2]


def test_sparse_accessor_replaces_elements(tmp_path: Path) -> None:
    """A sparse accessor overrides elements of its base."""
    file = one_quad()
    where, what = file.view(np.array([2], "<u2").tobytes()), file.view(np.array([[5, 6, 7]], "<f4").tobytes())
    file.document["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": where, "componentType": 5123},
        "values": {"bufferView": what},
    }
    np.testing.assert_array_equal(load_mesh(file, tmp_path).positions[2], [5, 6, 7])


def test_sparse_accessor_without_base_starts_from_zero(tmp_path: Path) -> None:
    """A sparse accessor without a buffer view replaces zeros."""
    file = one_quad()
    rows, values = np.arange(4, dtype="<u2"), QUAD.astype("<f4")
    accessor = file.document["accessors"][0]
    del accessor["bufferView"]
    accessor["sparse"] = {
        "count": 4,
        "indices": {"bufferView": file.view(rows.tobytes()), "componentType": 5123},
        "values": {"bufferView": file.view(values.tobytes())},
    }
    np.testing.assert_array_equal(load_mesh(file, tmp_path).positions, QUAD)


def test_interleaved_attributes(tmp_path: Path) -> None:
    """Positions and normals may share one strided buffer view."""
    file = one_quad()
    view = file.view(np.hstack((QUAD, UP)).astype("<f4").tobytes(), byteStride=24)
    for accessor, offset in ((0, 0), (1, 12)):
        file.document["accessors"][accessor] |= {"bufferView": view, "byteOffset": offset}
    mesh = load_mesh(file, tmp_path)
    np.testing.assert_array_equal(mesh.positions, QUAD)
    np.testing.assert_array_equal(mesh.normals, UP)


def test_quantised_positions_and_normals(tmp_path: Path) -> None:
    """Integers of KHR_mesh_quantization count as they are, or as fractions where normalised."""
    file = one_quad()
    file.document["extensionsRequired"] = ["KHR_mesh_quantization"]
    attributes = file.document["meshes"][0]["primitives"][0]["attributes"]
    attributes["POSITION"] = file.accessor(QUAD * 100, "i2")
    attributes["NORMAL"] = file.accessor(UP * 127, "i1", normalized=True)
    mesh = load_mesh(file, tmp_path)
    np.testing.assert_array_equal(mesh.positions, QUAD * 100)
    np.testing.assert_array_equal(mesh.normals, UP)


def test_external_buffer_with_escaped_name(tmp_path: Path) -> None:
    """A buffer beside the scene is found by its percent-encoded name, and its hash is kept."""
    file = one_quad()
    (tmp_path / "my data").mkdir()
    (tmp_path / "my data" / "büffer.bin").write_bytes(bytes(file.binary))
    scene = load_scene(file.write_json(tmp_path, "my%20data/b%C3%BCffer.bin"))
    np.testing.assert_array_equal(scene.meshes[0].positions, QUAD)
    assert len(scene.files["my data/büffer.bin"]) == 64


def test_data_uri(tmp_path: Path) -> None:
    """A buffer may be embedded as base64."""
    file = one_quad()
    uri = "data:application/octet-stream;base64," + base64.b64encode(bytes(file.binary)).decode()
    np.testing.assert_array_equal(load_scene(file.write_json(tmp_path, uri)).meshes[0].positions, QUAD)


def test_primitives_merge_into_one_object(tmp_path: Path) -> None:
    """Primitives follow one another, and each range leads back to its own."""
    file = GltfFile()
    first, second = file.material(name="a"), file.material(name="b")
    file.node(
        "both",
        mesh=file.mesh(
            file.primitive(QUAD, QUAD_FACES, normals=UP, material=first),
            file.primitive(TRIANGLE + 2, normals=UP[:3], material=second),
        ),
    )
    mesh = load_mesh(file, tmp_path)
    assert mesh.primitives == (PrimitiveRange(0, 0, 4, 0, 2), PrimitiveRange(1, 4, 3, 2, 1))
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(mesh.face_material, [0, 0, 1])


def test_primitives_that_share_vertices_share_them_here(tmp_path: Path) -> None:
    """Two index lists over one vertex array do not double the vertices."""
    file = GltfFile()
    whole = file.primitive(QUAD, [0, 1, 2], normals=UP)
    rest = whole | {"indices": file.accessor([0, 2, 3], "u2")}
    file.node("shared", mesh=file.mesh(whole, rest))
    mesh = load_mesh(file, tmp_path)
    assert mesh.primitives == (PrimitiveRange(0, 0, 4, 0, 1), PrimitiveRange(1, 0, 4, 1, 1))
    np.testing.assert_array_equal(mesh.faces, QUAD_FACES)


def test_cube_without_normals_splits_at_its_edges(tmp_path: Path) -> None:
    """Every corner of a cube becomes three vertices, each with the normal of its side, that lead back to the corner."""
    scene = load_scene(one_cube().write(tmp_path))
    mesh = scene.meshes[0]
    assert len(mesh.positions) == 24
    assert mesh.source_vertex is not None
    np.testing.assert_array_equal(mesh.positions, CUBE[mesh.source_vertex])
    np.testing.assert_array_equal(mesh.source_vertex[mesh.faces], CUBE_FACES)
    corners = mesh.positions[mesh.faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(mesh.normals[mesh.faces], np.repeat(flat[:, None], 3, axis=1))
    assert [f.count for f in scene.findings if f.what == "normals-made"] == [24]


def test_crease_angle_decides_what_is_smooth(tmp_path: Path) -> None:
    """Above 90 degrees, a cube is smooth all over and keeps its eight vertices."""
    mesh = load_scene(one_cube().write(tmp_path), crease_angle=100.0).meshes[0]
    assert len(mesh.positions) == 8
    np.testing.assert_allclose(mesh.normals, (CUBE - 0.5) * 2 / np.sqrt(3), atol=1e-6)


def test_bare_and_shaded_primitives_together(tmp_path: Path) -> None:
    """Only the primitive without normals is split; the other keeps its vertices."""
    file = GltfFile()
    file.node("both", mesh=file.mesh(file.primitive(QUAD, QUAD_FACES, normals=UP), file.primitive(CUBE, CUBE_FACES)))
    mesh = load_mesh(file, tmp_path)
    assert mesh.source_vertex is not None
    assert [part.vertex_count for part in mesh.primitives] == [4, 24]
    np.testing.assert_array_equal(mesh.source_vertex[:4], range(4))
    np.testing.assert_array_equal(mesh.positions[4:], CUBE[mesh.source_vertex[4:]])


def test_unusable_normals_are_reported(tmp_path: Path) -> None:
    """Normals without length or not finite become zero, and are counted."""
    file = one_quad()
    bad = np.array([[0, 0, 0], [np.nan, 0, 0], [0, 0, 2], [0, 0, 1]])
    file.document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = file.accessor(bad)
    scene = load_scene(file.write(tmp_path))
    np.testing.assert_array_equal(scene.meshes[0].normals, [[0, 0, 0], [0, 0, 0], [0, 0, 1], [0, 0, 1]])
    assert [f.count for f in scene.findings if f.what == "bad-normals"] == [2]


def test_morph_targets_and_skins_bake_in_rest_pose(tmp_path: Path) -> None:
    """What moves at run time is baked as it stands, and said to be."""
    file = one_quad(skin=0)
    file.document["meshes"][0]["weights"] = [0.0]
    found = {f.what for f in load_scene(file.write(tmp_path)).findings}
    assert {"morph-targets", "skinned"} <= found
