from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bake.scene import flatten, load_scene
from bake.scene.enclosure import enclosing_objects
from bake.scene.validate import world_boxes
from bake.settings import BakeSettings
from bake.types import Finding
from tests.scene.glb_files import CUBE, CUBE_FACES, QUAD, QUAD_FACES, GltfFile, one_cube
from tests.worlds import icosphere


def findings(file: GltfFile, folder: Path) -> dict[str, Finding]:
    """Findings of a file by name."""
    return {item.what: item for item in load_scene(file.write(folder)).findings}


def mesh_file(positions, faces) -> GltfFile:
    """A file with one object, three instances of it, and normals that say nothing."""
    file = GltfFile()
    mesh = file.mesh(file.primitive(positions, faces, normals=np.zeros((len(positions), 3))))
    for x in range(3):
        file.node("thing", mesh=mesh, translation=[float(x), 0, 0])
    return file


@pytest.mark.parametrize(
    ("faces", "what", "count"),
    [
        ([[0, 1, 2], [0, 0, 1]], "zero-area-faces", 1),
        ([[0, 1, 2], [0, 4, 1]], "zero-area-faces", 1),
        ([[0, 1, 2], [0, 5, 1]], "sliver-faces", 1),
        ([[0, 1, 2], [0, 2, 3], [1, 2, 0], [1, 2, 0]], "duplicate-faces", 2),
        ([[0, 1, 2], [2, 1, 0]], "opposed-faces", 2),
        ([[0, 1, 2]], "unreferenced-vertices", 5),
        ([[0, 1, 2], [2, 3, 0]], "inconsistent-winding", 0),
        ([[0, 1, 2], [3, 2, 0]], "inconsistent-winding", 1),
        ([[0, 1, 2], [0, 2, 3], [2, 0, 6]], "non-manifold-edges", 1),
    ],
)
def test_mesh_findings(tmp_path: Path, faces: list, what: str, count: int) -> None:
    """Each kind of fault is counted once per mesh, at the first object that shows it."""
    positions = [*QUAD, [0.5, 0, 0], [0.5, 1e-7, 0], [0, 0, 1], [9, 9, 9]]
    found = findings(mesh_file(positions, faces), tmp_path)
    assert (found[what].count if what in found else 0) == count
    if count:
        assert found[what].object == "thing#1"
        assert "3 objects share this mesh" in found[what].detail


def test_opposing_normals_are_counted_and_turned(tmp_path: Path) -> None:
    """Normals against all their faces are a finding, and the world holds them turned round."""
    file = GltfFile()
    file.node("quad", mesh=file.mesh(file.primitive(QUAD, QUAD_FACES, normals=np.tile([0, 0, -1], (4, 1)))))
    scene = load_scene(file.write(tmp_path))
    assert [(f.what, f.count) for f in scene.findings] == [("opposing-normals", 4)]
    np.testing.assert_array_equal(flatten(scene, BakeSettings()).normals, np.tile([0, 0, 1], (4, 1)))


def test_a_clean_cube_has_nothing_to_report(tmp_path: Path) -> None:
    """A well-made file yields no finding but the normals that it lacks."""
    assert set(findings(one_cube(), tmp_path)) == {"normals-made"}


def test_flattening_transform(tmp_path: Path) -> None:
    """Objects scaled to nothing are set aside and counted together."""
    file = one_cube()
    for _ in range(2):
        file.node("gone", mesh=0, scale=[1, 0, 1])
    found = findings(file, tmp_path)["flattening-transform"]
    assert (found.object, found.count, found.severity) == ("gone#1", 2, "set-aside")


@pytest.mark.parametrize(("scale", "expected"), [(0.01, True), (1.0, False), (1000.0, False), (1e5, True)])
def test_unlikely_size(tmp_path: Path, scale: float, expected: bool) -> None:
    """A level of millimetres or of a hundred kilometres is probably in another unit."""
    assert ("unlikely-size" in findings(one_cube(scale=[scale] * 3), tmp_path)) == expected


def sky_scene(*, inward: bool = True, role: str = "static", open_share: float = 0.0) -> GltfFile:
    """Two cubes under a dome of radius 50 whose top may be missing."""
    positions, faces = icosphere(2)
    positions, faces = np.asarray(positions, np.float32) * 50, np.asarray(faces, np.uint16)
    if open_share:
        faces = faces[positions[faces][:, :, 1].mean(axis=1) < 50 * (1 - open_share)]
    file = one_cube()
    file.node("other", mesh=0, translation=[5, 0, 5])
    sky = file.mesh(file.primitive(positions, faces[:, ::-1] if inward else faces))
    file.node("sky", mesh=sky, extras={"obscura": {"role": role}})
    return file


@pytest.mark.parametrize(
    ("more", "expected"),
    [({}, True), ({"inward": False}, True), ({"role": "ignore"}, False), ({"open_share": 0.5}, False)],
)
def test_an_object_that_encloses_the_scene(tmp_path: Path, more: dict, expected: bool) -> None:
    """A sky dome that blocks is reported, whichever way it looks; an ignored or open one is not."""
    found = findings(sky_scene(**more), tmp_path)
    assert ("encloses-scene" in found) == expected
    if expected:
        assert found["encloses-scene"].object == "sky"


def test_enclosure_without_a_known_up_axis(tmp_path: Path) -> None:
    """Without an up axis, the shell must close on all sides."""
    positions, faces = icosphere(1)
    points = np.concatenate((CUBE - 0.5, np.asarray(positions) * 20))
    triangles = np.concatenate((CUBE_FACES, np.asarray(faces) + 8)) + 1
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in points) + "g box\n"
    for number, (a, b, c) in enumerate(triangles):
        text += f"g sky\nf {a} {b} {c}\n" if number >= 12 else f"f {a} {b} {c}\n"
    (tmp_path / "level.obj").write_text(text)
    scene = load_scene(tmp_path / "level.obj")
    assert enclosing_objects(scene, world_boxes(scene)) == [1]
