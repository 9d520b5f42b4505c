from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bake.errors import SceneError
from bake.scene import flatten
from bake.scene.key_findings import key_findings
from bake.scene.object_keys import check_keys
from bake.scene.orientation import needless_twins
from bake.settings import BakeSettings
from bake.solve.surface import build_surface
from bake.types import Material, Mesh, ObjectKeys, Scene, SceneObject
from tests.worlds import icosphere, quad

SETTINGS = BakeSettings()


def sphere(*, mirrored: bool = False) -> Mesh:
    """A unit sphere with outward normals; mirrored, its triangles show inwards."""
    positions, faces = icosphere(1, inward=mirrored)
    return mesh_of(positions, faces, positions)


def mesh_of(positions: np.ndarray, faces: np.ndarray, normals: np.ndarray) -> Mesh:
    """A mesh of one material."""
    none = np.zeros(len(faces), np.int32)
    return Mesh("m", np.asarray(positions, float), np.asarray(normals, np.float32), np.asarray(faces, np.int32), none)


def banner() -> Mesh:
    """A square facing up whose two triangles are doubled with opposed winding on the same vertices."""
    positions, faces = quad(2.0)
    both = np.concatenate([faces[:, ::-1], faces])
    return mesh_of(positions, both, np.broadcast_to([0.0, 1.0, 0.0], positions.shape))


def scene_of(mesh: Mesh, **keys) -> Scene:
    """One object with keys."""
    item = SceneObject("thing", 0, np.eye(4), keys=ObjectKeys(**keys))
    return Scene(Path("level.glb"), (mesh,), (Material("m"),), (item,))


def outward(world) -> np.ndarray:
    """Cosine between each face and the direction from the world's origin to it."""
    corners = world.positions[world.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.einsum("ij,ij->i", normal, corners.mean(1))


@pytest.mark.parametrize(("winding", "sign"), [(None, -1), ("file", -1), ("normals", 1), ("flipped", 1)])
def test_winding_of_a_mirrored_mesh(winding: str | None, sign: int) -> None:
    """Faces follow the file, the normals, or are turned round; the normals agree with them afterwards."""
    world = flatten(scene_of(sphere(mirrored=True), winding=winding), SETTINGS)
    assert (np.sign(outward(world)) == sign).all()
    assert (np.einsum("ij,ij->i", world.normals, world.positions) * sign > 0.9).all()


def test_winding_by_normals_leaves_a_sound_mesh_alone() -> None:
    """Nothing is turned where normals and faces agree."""
    scene = scene_of(sphere(), winding="normals")
    assert (outward(flatten(scene, SETTINGS)) > 0).all()
    assert key_findings(scene) == []


def test_normals_from_faces() -> None:
    """The file's normals are ignored, and that is reported."""
    scene = scene_of(sphere(), normals="faces")
    assert not flatten(scene, SETTINGS).normals.any()
    assert [(finding.what, finding.count) for finding in key_findings(scene)] == [("ignored-normals", 42)]


def test_twins_become_one_surface() -> None:
    """With `two_sided`, the twin that its normals agree with stays, and the smoothing crosses the edge between."""
    scene = scene_of(banner(), two_sided=True)
    world = flatten(scene, SETTINGS)
    np.testing.assert_array_equal(world.face_samples, [False, False, True, True])
    np.testing.assert_array_equal(world.face_casts, world.face_samples)
    assert world.face_two_sided.all()
    assert (world.normals[:, 1] > 0.9).all()
    surface = build_surface(world, crease_angle=40.0, weld_instances=False)
    assert len(surface.butterflies.hinge) == 1
    assert [(finding.what, finding.count) for finding in key_findings(scene)] == [("merged-twins", 2)]
    apart = flatten(scene_of(banner()), SETTINGS)
    assert apart.face_samples.all()


def test_twins_with_their_own_vertices_stay_two() -> None:
    """A card doubled with vertices of its own has a value on each side."""
    mesh = banner()
    positions = np.concatenate([mesh.positions, mesh.positions])
    faces = mesh.faces + np.array([[0], [0], [4], [4]], np.int32)
    normals = np.concatenate([-mesh.normals, mesh.normals])
    assert flatten(scene_of(mesh_of(positions, faces, normals), two_sided=True), SETTINGS).face_samples.all()


def test_copies_that_look_the_same_way_are_no_twins() -> None:
    """Of three faces on one triple, only the opposed one goes; two equal ones stay."""
    positions, faces = quad(2.0)
    normals = np.broadcast_to(np.float32([0, 1, 0]), positions.shape)
    a, b = faces[:1], faces[:1, ::-1]
    assert not needless_twins(positions, normals, np.concatenate([a, a[:, [1, 2, 0]]])).any()
    np.testing.assert_array_equal(needless_twins(positions, normals, np.concatenate([b, a, b])), [True, False, True])


def test_keys_enter_the_hash_only_when_said() -> None:
    """An object keeps its hash while nothing is said of it, and loses it when something is."""
    scene = scene_of(sphere())
    plain = flatten(scene, SETTINGS).object_hash
    turned = replace(scene, objects=(replace(scene.objects[0], keys=ObjectKeys(winding="flipped")),))
    assert flatten(turned, SETTINGS).object_hash != plain


@pytest.mark.parametrize(("key", "value"), [("normals", "face"), ("winding", True), ("winding", "outwards")])
def test_other_words_are_refused(key: str, value: object) -> None:
    """Only the known words are taken, and the message lists them."""
    with pytest.raises(SceneError, match=f'{key} is .*use "file" or'):
        check_keys({key: value}, "here")
