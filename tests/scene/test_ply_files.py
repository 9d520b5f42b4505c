from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from bake.errors import SceneError
from bake.scene import load_scene

POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 2, 0)]


def header(form: str, faces: int, extra: str = "", count: int = len(POINTS)) -> bytes:
    """A PLY header for POINTS and some faces."""
    text = f"ply\nformat {form} 1.0\ncomment x\nelement vertex {count}\nproperty float x\nproperty float y\n"
    text += f"property float z\n{extra}element face {faces}\nproperty uchar flags\n"
    return (text + "property list uchar int vertex_indices\nend_header\n").encode()


def ascii_ply(*polygons: tuple[int, ...]) -> bytes:
    """POINTS and polygons as ASCII."""
    rows = [" ".join(map(str, point)) for point in POINTS]
    rows += [" ".join(map(str, (0, len(polygon), *polygon))) for polygon in polygons]
    return header("ascii", len(polygons)) + "\n".join(rows).encode()


def binary_ply(order: str, *polygons: tuple[int, ...]) -> bytes:
    """POINTS and polygons as binary of either byte order."""
    form = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    body = b"".join(struct.pack(order + "3f", *point) for point in POINTS)
    body += b"".join(struct.pack(f"{order}BB{len(p)}i", 0, len(p), *p) for p in polygons)
    return header(form, len(polygons)) + body


def load(folder: Path, content: bytes):
    """Loads a PLY file."""
    path = folder / "rock.ply"
    path.write_bytes(content)
    return load_scene(path)


@pytest.mark.parametrize("polygons", [((0, 1, 2), (0, 2, 3)), ((0, 1, 2, 3), (3, 2, 4))])
@pytest.mark.parametrize("form", ["ascii", "<", ">"])
def test_all_encodings_agree(tmp_path: Path, form: str, polygons: tuple) -> None:
    """ASCII and both byte orders, with faces of one size or of several, give the same surface."""
    scene = load(tmp_path, ascii_ply(*polygons) if form == "ascii" else binary_ply(form, *polygons))
    mesh = scene.meshes[0]
    assert [item.path for item in scene.objects] == ["rock"]
    corners = mesh.positions[mesh.faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2].sum() / 2
    assert area == pytest.approx(sum(1.0 if len(p) == 4 else 0.5 for p in polygons))
    np.testing.assert_allclose(mesh.normals[mesh.faces], np.broadcast_to([0, 0, 1], (len(mesh.faces), 3, 3)))


def test_made_normals_lead_back_to_the_file(tmp_path: Path) -> None:
    """Split vertices know the vertex that they came from, unused ones included."""
    mesh = load(tmp_path, ascii_ply((0, 1, 2, 3))).meshes[0]
    np.testing.assert_array_equal(mesh.source_vertex, range(5))
    np.testing.assert_array_equal(mesh.normals[4], 0)


def test_stored_normals_keep_the_vertices(tmp_path: Path) -> None:
    """With normals in the file, nothing is split."""
    rows = "\n".join(f"{x} {y} {z} 0 0 2" for x, y, z in POINTS)
    extra = "property float nx\nproperty float ny\nproperty float nz\n"
    mesh = load(tmp_path, header("ascii", 1, extra) + (rows + "\n0 3 0 1 2").encode()).meshes[0]
    assert mesh.source_vertex is None
    np.testing.assert_array_equal(mesh.normals, [[0, 0, 1]] * 5)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "no PLY"),
        (b"ply\nformat ascii 1.0\n", "no end"),
        (b"ply\nformat text 1.0\nend_header\n", "says 'format text"),
        (b"ply\nelement vertex 1\nend_header\n", "no known format"),
        (header("ascii", 0) + b"0 0 0\n" * 5, "no faces"),
        (header("ascii", 1) + b"0 0 0\n" * 4, "ends inside"),
        (ascii_ply((0, 1, 7)), "vertex 7 of 5"),
        (ascii_ply((0, 1, -1)), "vertex -1 of 5"),
        (ascii_ply((0, 1)), "no triangles"),
        (ascii_ply((0, 1, 2))[:-3], "ends inside"),
        (ascii_ply((0, 1, 2)) + b" x", "no number"),
        (binary_ply("<", (0, 1, 2))[:-1], "ends inside"),
        (binary_ply("<", (0, 1, 2), (0, 1, 2, 3))[:-1], "ends inside"),
        (header("binary_little_endian", 1, count=10**12) + b"\0" * 99, "ends inside"),
        (header("ascii", 10**12) + b"0 0 0\n" * 5, "ends inside"),
        (header("ascii", 1).replace(b"float x", b"quad x"), "quad x"),
        (ascii_ply((0, 1, 2)).replace(b"0.5", b"inf"), "vertex 4"),
    ],
)
def test_damaged_files_are_refused(tmp_path: Path, content: bytes, message: str) -> None:
    """Each fault ends as one line that names the file."""
    with pytest.raises(SceneError, match=message) as caught:
        load(tmp_path, content)
    assert "rock.ply" in str(caught.value)
    assert "\n" not in str(caught.value)
