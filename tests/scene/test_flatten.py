from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bake.errors import SceneError
from bake.ground import Ground
from bake.scene import flatten
from bake.scene.flatten import flatten_about
from bake.settings import BakeSettings
from bake.types import Material, Mesh, ObjectKeys, Role, Scene, SceneObject
from tests.scene.glb_files import CUBE, CUBE_FACES, QUAD, QUAD_FACES
from tests.worlds import icosphere

SETTINGS = BakeSettings()


def sphere_mesh() -> Mesh:
    """A unit sphere with outward normals."""
    positions, faces = icosphere(1)
    positions = np.asarray(positions, np.float64)
    count = len(faces)
    return Mesh(
        "sphere", positions, positions.astype(np.float32), np.asarray(faces, np.int32), np.zeros(count, np.int32)
    )


def plain_mesh(positions: np.ndarray, faces: np.ndarray) -> Mesh:
    """A mesh without normals."""
    faces = np.asarray(faces, np.int32)
    blank = np.zeros((len(positions), 3), np.float32)
    return Mesh("mesh", np.asarray(positions, np.float64), blank, faces, np.zeros(len(faces), np.int32))


def make_scene(*objects: SceneObject, meshes: tuple[Mesh, ...] = (), material: Material | None = None) -> Scene:
    """A scene without a file."""
    return Scene(Path("level.glb"), meshes or (sphere_mesh(),), (material or Material("m"),), objects)


def placed(path: str = "a", matrix: np.ndarray | None = None, **more) -> SceneObject:
    """An object of mesh 0."""
    return SceneObject(path, 0, np.eye(4) if matrix is None else matrix, **more)


def translation(*offset: float) -> np.ndarray:
    """A translation."""
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


entries = st.floats(-3, 3)
linear = st.lists(entries, min_size=9, max_size=9).map(lambda values: np.array(values).reshape(3, 3))


@given(linear, st.tuples(entries, entries, entries))
def test_any_transform_keeps_outside_outside(matrix: np.ndarray, offset: tuple) -> None:
    """Volume stays positive under every transform, mirroring ones included, and normals stay outward and unit."""
    if abs(np.linalg.det(matrix)) < 0.05:
        matrix = matrix + 4 * np.eye(3)
    if abs(np.linalg.det(matrix)) < 0.05:
        matrix = np.diag([1.0, -1.0, 2.0])
    transform = translation(*offset)
    transform[:3, :3] = matrix
    world = flatten(make_scene(placed(matrix=transform)), SETTINGS)
    a, b, c = world.positions[world.faces].transpose(1, 0, 2)
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    flat = sphere_mesh()
    a, b, c = flat.positions[flat.faces].transpose(1, 0, 2)
    assert volume == pytest.approx(abs(np.linalg.det(matrix)) * np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)
    np.testing.assert_allclose(np.linalg.norm(world.normals, axis=1), 1.0, atol=1e-5)
    expected = flat.positions @ np.linalg.inv(matrix)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(world.normals, expected, atol=1e-5)


coordinates = st.floats(-1e7, 1e7)


@given(st.tuples(coordinates, coordinates, coordinates))
def test_recentring_loses_nothing(offset: tuple) -> None:
    """Adding the origin back gives the world positions, and the origin is near wherever the level lies."""
    objects = [placed("a"), placed("b", translation(3.25, -7.5, 2))]
    here = flatten(make_scene(*objects), SETTINGS)
    moved = [replace(item, transform=translation(*offset) @ item.transform) for item in objects]
    there = flatten(make_scene(*moved), SETTINGS)
    expected = np.concatenate([sphere_mesh().positions + item.transform[:3, 3] for item in moved])
    np.testing.assert_allclose(there.positions + there.origin, expected, rtol=1e-15, atol=4e-9)
    assert np.abs(there.positions).max() <= np.abs(here.positions).max() + 0.3 * np.linalg.norm([5.25, 9.5, 4])


def test_a_million_metres_away_positions_agree_to_a_nanometre() -> None:
    """At 10⁶ m, recentred positions agree within 1e-9 m."""
    here = flatten(make_scene(placed()), SETTINGS)
    there = flatten(make_scene(placed(matrix=translation(1e6, -1e6, 1e6))), SETTINGS)
    np.testing.assert_allclose(there.positions, here.positions, atol=1e-9)
    np.testing.assert_allclose(here.positions + here.origin, sphere_mesh().positions, atol=1e-9)


def test_origin_is_near_the_centre_of_what_counts() -> None:
    """The origin is near the middle of the scene's box; ignored objects and unused vertices do not move it."""
    mesh = plain_mesh(np.concatenate((QUAD, [[1e5, 0, 0]])), QUAD_FACES)
    scene = make_scene(
        placed("a"), placed("far", translation(1e6, 0, 0), role=Role.IGNORE), SceneObject("b", 1, translation(9, 0, 0))
    )
    world = flatten(replace(scene, meshes=(sphere_mesh(), mesh)), SETTINGS)
    used = sphere_mesh().positions
    low, high = used.min(axis=0), np.maximum(used.max(axis=0), [10, 1, 0])
    assert np.linalg.norm(world.origin - (low + high) / 2) <= np.linalg.norm(high - low) / 4
    np.testing.assert_array_equal(world.origin, [4, 0, 0])  # the grid's spacing is 2 m


moves = st.tuples(*[st.floats(-0.5, 0.5)] * 3)


@given(st.tuples(entries, entries, entries), moves, st.integers(0, 3))
def test_an_edit_leaves_the_rest_where_it_is(offset: tuple, move: tuple, number: int) -> None:
    """What is not moved, and does not leave, keeps its positions to the bit as long as the origin stays."""
    objects = [placed(f"o{i}", translation(*np.array(offset) * i)) for i in range(4)]
    before = flatten(make_scene(*objects), SETTINGS)
    edited = list(objects)
    edited[number] = replace(edited[number], transform=translation(*move) @ edited[number].transform)
    after = flatten(make_scene(*edited), SETTINGS)
    if not np.array_equal(after.origin, before.origin):
        return  # so small a scene that the move is far
    others = np.repeat(np.arange(4) != number, np.diff(before.first_vertex))
    np.testing.assert_array_equal(after.positions[others], before.positions[others])
    apart = flatten(make_scene(*[item for i, item in enumerate(edited) if i != number]), SETTINGS)
    if np.array_equal(apart.origin, before.origin):
        np.testing.assert_array_equal(apart.positions, before.positions[others])


def test_the_origin_stays_when_little_moves() -> None:
    """An object that moves within the scene, or sticks out of it a little, leaves the origin where it was."""
    objects = [placed("a", translation(-20, 0, -20)), placed("b", translation(20, 0, 20)), placed("c")]
    before = flatten(make_scene(*objects), SETTINGS)
    for x in (-20.05, -7.0, 3.1, 20.05):
        after = flatten(make_scene(*objects[:2], placed("c", translation(x, 0.2, x))), SETTINGS)
        np.testing.assert_array_equal(after.origin, before.origin)
        np.testing.assert_array_equal(
            after.positions[: -len(sphere_mesh().positions)], before.positions[: 2 * len(sphere_mesh().positions)]
        )


def test_an_origin_can_be_given() -> None:
    """Some objects of a larger world are flattened about its origin, wherever it is."""
    scene = make_scene(placed("a"), placed("b", translation(10, 0, 0)))
    given, own = np.array([50.0, 0.0, 0.5]), flatten(scene, SETTINGS)
    world = flatten_about(scene, SETTINGS, given)
    np.testing.assert_array_equal(world.origin, given)
    np.testing.assert_allclose(world.positions + given, own.positions + own.origin, atol=1e-12)


def test_layout() -> None:
    """Vertices, faces and offsets follow scene order."""
    scene = make_scene(placed("a"), SceneObject("b", 1, np.eye(4)), placed("c"))
    world = flatten(replace(scene, meshes=(sphere_mesh(), plain_mesh(QUAD, QUAD_FACES))), SETTINGS)
    sphere = sphere_mesh()
    assert world.object_paths == ("a", "b", "c")
    np.testing.assert_array_equal(np.diff(world.first_vertex), [len(sphere.positions), 4, len(sphere.positions)])
    np.testing.assert_array_equal(np.diff(world.first_face), [len(sphere.faces), 2, len(sphere.faces)])
    np.testing.assert_array_equal(np.bincount(world.face_object), np.diff(world.first_face))
    for number in range(3):
        own = world.faces[world.first_face[number] : world.first_face[number + 1]]
        assert own.min() >= world.first_vertex[number]
        assert own.max() < world.first_vertex[number + 1]


@pytest.mark.parametrize(
    ("role", "casts", "samples"),
    [
        (Role.STATIC, True, True),
        (Role.BLOCKER, True, False),
        (Role.RECEIVER, False, True),
        (Role.TREE, False, False),
        (Role.SHRUB, False, False),
        (Role.SMALL, False, False),
        (Role.LOD, False, False),
        (Role.IGNORE, False, False),
    ],
)
def test_roles_decide_who_casts_and_receives(role: Role, casts: bool, samples: bool) -> None:
    """Every role stays in the world; flags say what it does."""
    world = flatten(make_scene(placed(role=role)), SETTINGS)
    assert world.face_casts.all() if casts else not world.face_casts.any()
    assert world.face_samples.all() if samples else not world.face_samples.any()


def test_two_sided_by_material_key_and_twin() -> None:
    """A material makes faces two-sided, a key overrules it, and opposed twins count as two-sided."""
    card = plain_mesh(QUAD, np.concatenate((QUAD_FACES, QUAD_FACES[:1, ::-1])))

    def sides(two_sided: bool, key: bool | None) -> list[bool]:
        item = placed(keys=ObjectKeys(two_sided=key))
        scene = make_scene(item, meshes=(card,), material=Material("m", two_sided))
        return flatten(scene, SETTINGS).face_two_sided.tolist()

    assert sides(False, None) == [True, False, True]
    assert sides(True, None) == [True, True, True]
    assert sides(True, False) == [False, False, False]
    assert sides(False, True) == [True, True, True]


def test_slivers_and_points_take_no_samples_but_block() -> None:
    """Faces without a reliable normal are left out of sampling, never of blocking."""
    positions = np.concatenate((QUAD, [[0.5, 1e-7, 0], [0.5, 0, 0], [1e-4, 0, 0], [0, 1e-4, 0]]))
    faces = [[0, 1, 2], [0, 4, 1], [0, 5, 1], [0, 0, 1], [0, 6, 7]]
    world = flatten(make_scene(placed(), meshes=(plain_mesh(positions, faces),)), SETTINGS)
    np.testing.assert_array_equal(world.face_samples, [True, False, False, False, True])
    assert world.face_casts.all()


def test_small_objects_in_wide_levels_keep_their_faces() -> None:
    """A prop of a centimetre is sampled although the level is 10 km wide."""
    tiny = np.diag([0.01, 0.01, 0.01, 1])
    world = flatten(make_scene(placed("tiny", tiny), placed("far", translation(1e4, 0, 0))), SETTINGS)
    assert world.face_samples.all()


def test_flattened_objects_take_no_samples() -> None:
    """An object scaled to nothing is kept, samples nothing, and yields finite numbers."""
    world = flatten(make_scene(placed("a"), placed("flat", np.diag([0.0, 0.0, 0.0, 1.0]))), SETTINGS)
    assert world.face_samples.sum() == world.first_face[1]
    assert np.isfinite(world.positions).all()
    assert np.isfinite(world.normals).all()


@pytest.mark.parametrize("axis", range(6))
def test_ground_lies_opposite_the_side_that_faces_up(axis: int) -> None:
    """The quad lies below the scene as seen from the axis, faces up, and has the size that was asked for."""
    box = plain_mesh(CUBE * (2, 4, 8), CUBE_FACES)
    settings = BakeSettings(ground=Ground(axis, scale=10.0, offset=0.25))
    world = flatten(make_scene(placed(), meshes=(box,)), settings)
    assert world.object_paths[-1] == "ground"
    assert world.object_roles[-1] is Role.BLOCKER
    corners = world.positions[-4:] + world.origin
    extents = np.array([2.0, 4.0, 8.0])
    along, sign = axis // 2, 1 - 2 * (axis % 2)
    bottom = 0.0 if sign > 0 else extents[along]
    np.testing.assert_allclose(corners[:, along], bottom - sign * 0.25 * extents[along])
    others = [i for i in range(3) if i != along]
    np.testing.assert_allclose(np.ptp(corners, axis=0)[others], 10 * extents[others])
    np.testing.assert_allclose(corners.mean(axis=0)[others], extents[others] / 2)
    points = world.positions[world.faces[-2:]]
    up = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    assert (up[:, along] * sign > 0).all()
    np.testing.assert_array_equal(world.normals[-4:, along], sign)
    assert world.face_casts[-2:].all()
    assert world.face_two_sided[-2:].all()
    assert not world.face_samples[-2:].any()
    assert len(world.object_hash) == world.object_count == len(world.first_face) - 1


def test_ground_under_a_flat_scene_keeps_its_distance() -> None:
    """Under a flat floor the ground neither coincides with it nor vanishes."""
    floor = plain_mesh(QUAD[:, [0, 2, 1]], QUAD_FACES)
    world = flatten(make_scene(placed(), meshes=(floor,)), BakeSettings(ground=Ground(2, 2.0, 0.1)))
    assert world.positions[-4:, 1] + world.origin[1] == pytest.approx(-0.1)
    wall = flatten(make_scene(placed(), meshes=(floor,)), BakeSettings(ground=Ground(0, 2.0, 0.1)))
    assert np.ptp(wall.positions[-4:, 1]) == pytest.approx(2.0)


def test_ground_beside_an_object_of_that_name() -> None:
    """Paths stay unique even if the level has an object called ground."""
    world = flatten(make_scene(placed("ground")), BakeSettings(ground=Ground()))
    assert len(set(world.object_paths)) == 2


def test_hashes_follow_content() -> None:
    """A hash changes with geometry, transform, role, keys and materials, and with nothing else."""
    base = make_scene(placed("a"), placed("b", translation(5, 0, 0)))
    before = flatten(base, SETTINGS).object_hash
    assert before[0] != before[1]
    assert flatten(make_scene(placed("renamed"), base.objects[1]), SETTINGS).object_hash == before
    changed = {
        "transform": make_scene(placed(matrix=translation(0, 1e-9, 0)), base.objects[1]),
        "role": make_scene(placed(role=Role.BLOCKER), base.objects[1]),
        "keys": make_scene(placed(keys=ObjectKeys(offset=0.1)), base.objects[1]),
        "material": make_scene(*base.objects, material=Material("m", openness=0.5)),
        "name of the material": make_scene(*base.objects, material=Material("other")),
    }
    for what, scene in changed.items():
        after = flatten(scene, SETTINGS).object_hash
        assert (after[0] == before[0]) == (what == "name of the material"), what
    moved = replace(sphere_mesh(), positions=sphere_mesh().positions * 1.5)
    assert flatten(make_scene(*base.objects, meshes=(moved,)), SETTINGS).object_hash[0] != before[0]


def test_flattening_is_deterministic() -> None:
    """Twice the same scene, twice the same bits."""
    scene = make_scene(placed("a"), placed("b", translation(0.1, 0.2, 0.3)))
    first, second = flatten(scene, SETTINGS), flatten(scene, SETTINGS)
    for name in ("positions", "normals", "faces", "face_openness"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()


def test_a_scene_without_triangles_is_refused() -> None:
    """There must be something to bake."""
    with pytest.raises(SceneError, match="no triangles"):
        flatten(make_scene(), SETTINGS)


def test_a_scene_too_large_for_its_indices_is_refused() -> None:
    """Instances beyond 32-bit indices are refused before memory is touched."""
    heavy = plain_mesh(QUAD, np.zeros((1_000_000, 3)))
    with pytest.raises(SceneError, match="instances expanded"):
        flatten(make_scene(*[placed()] * 800, meshes=(heavy,)), SETTINGS)
