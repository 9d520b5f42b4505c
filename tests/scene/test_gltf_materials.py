from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bake.scene import flatten, load_scene
from bake.scene.alpha import OpennessPyramid, openness_of
from bake.settings import BakeSettings
from tests.scene.glb_files import QUAD, QUAD_FACES, QUAD_UVS, GltfFile, rgba_png

HALF_OPEN = np.zeros((8, 8), np.uint8)
HALF_OPEN[:, :4] = 255  # opaque on the left, open on the right


def card(alpha: np.ndarray | None = HALF_OPEN, uvs: np.ndarray | None = QUAD_UVS, **material) -> GltfFile:
    """A quad with one material, whose base colour texture has the given alpha."""
    file = GltfFile()
    colour = material.pop("pbrMetallicRoughness", {})
    if alpha is not None:
        colour = {"baseColorTexture": {"index": file.texture(alpha)} | colour.pop("reference", {})} | colour
    index = file.material(name="leaf", pbrMetallicRoughness=colour, **material)
    normals = np.tile([0.0, 0.0, 1.0], (4, 1))
    primitive = file.primitive(QUAD, QUAD_FACES, normals=normals, uvs=uvs, material=index)
    file.node("card", mesh=file.mesh(primitive))
    return file


def test_double_sided_material(tmp_path: Path) -> None:
    """glTF's doubleSided makes every face of the material two-sided."""
    scene = load_scene(card(None, doubleSided=True).write(tmp_path))
    assert scene.materials[0].two_sided
    assert flatten(scene, BakeSettings()).face_two_sided.all()


def test_opaque_materials_ignore_their_alpha(tmp_path: Path) -> None:
    """Without an alpha mode, alpha means nothing."""
    material = load_scene(card().write(tmp_path)).materials[0]
    assert material.openness == 0.0
    assert material.openness_map is None


@pytest.mark.parametrize(
    ("mode", "alpha", "factor", "cutoff", "expected"),
    [
        ("MASK", 127, 1.0, 0.5, 1.0),
        ("MASK", 128, 1.0, 0.5, 0.0),
        ("MASK", 255, 0.4, 0.5, 1.0),
        ("MASK", 51, 1.0, 0.1, 0.0),
        ("BLEND", 51, 1.0, None, 0.8),
        ("BLEND", 255, 0.25, None, 0.75),
        ("BLEND", 51, 0.5, None, 0.9),
    ],
)
def test_uniform_alpha(tmp_path: Path, mode: str, alpha: int, factor: float, cutoff: float | None, expected) -> None:
    """A mask is open below its cut-off, blending lets 1 - alpha through; the factor multiplies both."""
    more = {} if cutoff is None else {"alphaCutoff": cutoff}
    file = card(
        np.full((4, 4), alpha, np.uint8),
        alphaMode=mode,
        pbrMetallicRoughness={"baseColorFactor": [1, 1, 1, factor]},
        **more,
    )
    material = load_scene(file.write(tmp_path)).materials[0]
    assert material.openness == pytest.approx(expected, abs=1e-6)
    assert material.openness_map is None


def test_mask_counts_the_texels_of_the_texture(tmp_path: Path) -> None:
    """A material's openness is its texture's mean, and the map keeps each texel."""
    material = load_scene(card(alphaMode="MASK").write(tmp_path)).materials[0]
    assert material.openness == pytest.approx(0.5)
    np.testing.assert_array_equal(material.openness_map, HALF_OPEN == 0)


def test_faces_count_their_own_part_of_the_texture(tmp_path: Path) -> None:
    """A card that uses only the open half of its texture is open, whatever the texture's mean."""
    for offset, expected in ((0.0, 0.0), (0.5, 1.0)):
        file = card(uvs=QUAD_UVS * (0.5, 1.0) + (offset, 0.0), alphaMode="MASK")
        world = flatten(load_scene(file.write(tmp_path)), BakeSettings())
        np.testing.assert_allclose(world.face_openness, expected, atol=1e-6)


def test_texture_transform_moves_the_part(tmp_path: Path) -> None:
    """KHR_texture_transform is applied before the texture is read."""
    transform = {"KHR_texture_transform": {"offset": [0.5, 0], "scale": [0.5, 1]}}
    file = card(alphaMode="MASK", pbrMetallicRoughness={"reference": {"extensions": transform}})
    world = flatten(load_scene(file.write(tmp_path)), BakeSettings())
    np.testing.assert_allclose(world.face_openness, 1.0, atol=1e-6)


def test_texture_rotation_turns_the_picture_clockwise(tmp_path: Path) -> None:
    """A quarter turn takes the top of the quad to what lies beside it in the texture."""
    transform = {"KHR_texture_transform": {"rotation": np.pi / 2}}
    top_open = np.zeros((8, 8), np.uint8)
    top_open[4:] = 255
    file = card(top_open, alphaMode="MASK", pbrMetallicRoughness={"reference": {"extensions": transform}})
    mesh = load_scene(file.write(tmp_path)).meshes[0]
    np.testing.assert_allclose(mesh.uvs, np.column_stack((QUAD_UVS[:, 1], -QUAD_UVS[:, 0])), atol=1e-6)


def test_without_coordinates_the_mean_counts(tmp_path: Path) -> None:
    """A mesh without texture coordinates takes the texture's mean, with a finding."""
    scene = load_scene(card(uvs=None, alphaMode="MASK").write(tmp_path))
    np.testing.assert_allclose(flatten(scene, BakeSettings(alpha_lookup=True)).face_openness, 0.5)
    assert "no-texture-coordinates" in {f.what for f in scene.findings}


def test_missing_texture_is_a_finding(tmp_path: Path) -> None:
    """An image that is not there leaves the factor alone, is reported, and is remembered as absent."""
    file = card(alphaMode="BLEND", pbrMetallicRoughness={"baseColorFactor": [1, 1, 1, 0.25]})
    file.document["images"][0] = {"uri": "gone.png"}
    scene = load_scene(file.write(tmp_path))
    assert scene.materials[0].openness == pytest.approx(0.75)
    assert [f.what for f in scene.findings] == ["missing-texture"]
    assert scene.files["gone.png"] == ""


def test_damaged_texture_is_a_finding(tmp_path: Path) -> None:
    """An image that cannot be decoded is reported, and the scene still loads."""
    file = card(alphaMode="MASK")
    file.document["images"][0] = {"uri": "bad.png"}
    (tmp_path / "bad.png").write_bytes(rgba_png(HALF_OPEN)[:40])
    assert [f.what for f in load_scene(file.write(tmp_path)).findings] == ["missing-texture"]


def test_texture_outside_the_folder_is_not_read(tmp_path: Path) -> None:
    """A texture path that leaves the scene's folder is a finding, even where the file exists."""
    (tmp_path / "secret.png").write_bytes(rgba_png(HALF_OPEN))
    (tmp_path / "level").mkdir()
    file = card(alphaMode="MASK")
    file.document["images"][0] = {"uri": "../secret.png"}
    scene = load_scene(file.write(tmp_path / "level"))
    assert [f.what for f in scene.findings] == ["missing-texture"]
    assert "secret" not in "".join(scene.files)


def test_lookup_hands_textures_to_the_world(tmp_path: Path) -> None:
    """With alpha lookup, the world carries coordinates, maps, and which face uses which."""
    file = card(alphaMode="MASK")
    file.node("plain", mesh=file.mesh(file.primitive(QUAD, QUAD_FACES)))
    scene = load_scene(file.write(tmp_path))
    assert flatten(scene, BakeSettings()).vertex_uv is None
    world = flatten(scene, BakeSettings(alpha_lookup=True))
    np.testing.assert_array_equal(world.face_texture, [0, 0, -1, -1])
    np.testing.assert_array_equal(world.vertex_uv[:4], QUAD_UVS)
    np.testing.assert_array_equal(world.textures[0], HALF_OPEN == 0)


@pytest.mark.parametrize("cutoff", [None, 0.5])
def test_face_means_agree_with_counting_texels(cutoff: float | None) -> None:
    """The mean over a large face's part equals the mean of the texels inside it."""
    random = np.random.default_rng(1)
    alpha = random.random((64, 96)).astype(np.float32)
    alpha[:, 40:] *= 0.3
    openness = openness_of(alpha, cutoff=cutoff)
    corners = np.array([[[1, 1], [7, 2], [2, 7]]], np.float32) / 8
    rows, columns = np.mgrid[0:640, 0:960] + 0.5
    points = np.stack((columns / 960, rows / 640), axis=-1)
    a, b, c = corners[0].astype(np.float64)
    sides = [(q - p)[0] * (points - p)[..., 1] - (q - p)[1] * (points - p)[..., 0] for p, q in ((a, b), (b, c), (c, a))]
    inside = (np.array(sides) > 0).all(axis=0)
    texels = openness[(rows / 10).astype(int), (columns / 10).astype(int)]
    pyramid = OpennessPyramid(openness)
    np.testing.assert_allclose(pyramid.face_means(corners), texels[inside].mean(), atol=0.03)
    np.testing.assert_array_equal(pyramid.face_means(corners + np.float32([3, -2])), pyramid.face_means(corners))


def test_large_textures_are_averaged_down() -> None:
    """A texture above the limit shrinks without changing its mean."""
    alpha = np.zeros((4096, 16), np.float32)
    alpha[::2] = 1.0
    openness = openness_of(alpha, cutoff=0.5)
    assert max(openness.shape) <= 2048
    assert openness.mean() == pytest.approx(0.5)
