from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from bake.scene.coincident import find_coincident
from bake.scene.normals import crease_normals, opposing_normals, unit_vectors
from bake.scene.weld import weld_positions
from tests.scene.glb_files import CUBE, CUBE_FACES, QUAD, QUAD_FACES
from tests.worlds import icosphere


def test_sphere_normals_point_outwards() -> None:
    """On a sphere, made normals are close to the positions."""
    positions, faces = icosphere(3)
    split = crease_normals(np.asarray(positions, np.float64), np.asarray(faces), 40.0)
    assert len(split.source) == len(positions)
    np.testing.assert_allclose(split.normals, positions / np.linalg.norm(positions, axis=1, keepdims=True), atol=0.02)


def test_faces_stored_apart_come_out_smooth() -> None:
    """A sphere whose triangles share no vertex gets the same normals as a welded one."""
    positions, faces = icosphere(2)
    positions, faces = np.asarray(positions, np.float64), np.asarray(faces)
    welded = crease_normals(positions, faces, 40.0)
    apart = crease_normals(positions[faces.ravel()], np.arange(faces.size).reshape(-1, 3), 40.0)
    np.testing.assert_allclose(apart.normals[apart.faces], welded.normals[welded.faces], atol=1e-6)


@pytest.mark.parametrize(("angle", "vertices"), [(30.0, 6), (60.0, 4)])
def test_two_faces_at_an_angle(angle: float, vertices: int) -> None:
    """Two faces folded by 45 degrees share their edge's normals only below the crease angle."""
    folded = QUAD.astype(np.float64)
    folded[3] = [0.5 - np.sqrt(0.125), 0.5 + np.sqrt(0.125), 0.5]
    split = crease_normals(folded, QUAD_FACES, angle)
    assert len(split.source) == vertices


def test_cards_doubled_in_place_keep_their_sides() -> None:
    """Opposed twins never share a normal, though all their edges coincide."""
    faces = np.concatenate((QUAD_FACES, QUAD_FACES[:, ::-1]))
    split = crease_normals(QUAD.astype(np.float64), faces, 40.0)
    np.testing.assert_allclose(split.normals[split.faces[:2]], np.broadcast_to([0, 0, 1], (2, 3, 3)))
    np.testing.assert_allclose(split.normals[split.faces[2:]], np.broadcast_to([0, 0, -1], (2, 3, 3)))


@given(
    hnp.arrays(np.float64, (12, 3), elements=st.integers(-2, 2).map(float)),
    hnp.arrays(np.int64, (10, 3), elements=st.integers(0, 11)),
    st.floats(0, 180),
)
def test_any_soup_splits_consistently(positions: np.ndarray, faces: np.ndarray, angle: float) -> None:
    """Whatever the soup, split faces lead back to their corners, every vertex survives, normals are unit or zero."""
    split = crease_normals(positions, faces, angle)
    np.testing.assert_array_equal(split.source[split.faces], faces)
    assert set(split.source.tolist()) == set(range(12))
    assert (np.diff(split.source) >= 0).all()
    lengths = np.linalg.norm(split.normals, axis=1)
    assert (np.isclose(lengths, 1.0, atol=1e-5) | (lengths == 0.0)).all()


def test_zero_crease_angle_is_flat() -> None:
    """At angle 0 every face of a cube has its own normal, and flat neighbours still share theirs."""
    split = crease_normals(CUBE.astype(np.float64), CUBE_FACES, 0.0)
    assert len(split.source) == 24


@given(hnp.arrays(np.float64, (5, 3), elements=st.floats(allow_nan=True, allow_infinity=True)))
def test_unit_vectors_are_unit_or_zero(vectors: np.ndarray) -> None:
    """Anything becomes a unit vector, or zero where there is no direction."""
    with np.errstate(all="ignore"):
        lengths = np.linalg.norm(unit_vectors(vectors).astype(np.float64), axis=1)
    assert (np.isclose(lengths, 1.0, atol=1e-5) | (lengths == 0.0)).all()


def test_only_unanimous_opposition_turns_a_normal() -> None:
    """A normal against all its faces is turned; one with which some face agrees is not."""
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 1]], float)
    faces = np.array([[0, 1, 2], [0, 3, 1]], np.int32)
    normals = np.array([[0, -1, -0.1], [0, 1, 1], [0, 0, -1], [0, 0, 0]], np.float32)
    np.testing.assert_array_equal(opposing_normals(positions, normals, faces), [True, False, True, False])


@given(hnp.arrays(np.float64, (20, 3), elements=st.sampled_from([0.0, -0.0, 1.0, 2.5, 1e-300])))
def test_weld_equals_exact_comparison(positions: np.ndarray) -> None:
    """Two vertices get one number exactly if they lie at one place."""
    welded = weld_positions(positions)
    same = (positions[:, None] == positions[None]).all(axis=2)
    np.testing.assert_array_equal(welded[:, None] == welded[None], same)
    assert set(welded.tolist()) == set(range(len(set(welded.tolist()))))


@given(hnp.arrays(np.int32, (8, 3), elements=st.integers(0, 3)))
def test_coincident_faces_equal_comparing_all_pairs(faces: np.ndarray) -> None:
    """Duplicates and opposed twins are those that comparing every pair finds."""
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    found = find_coincident(positions, faces)
    turns = [tuple(min(np.roll(face, k).tolist() for k in range(3))) for face in faces]
    back = [tuple(min(np.roll(face[::-1], k).tolist() for k in range(3))) for face in faces]
    proper = [len(set(face.tolist())) == 3 for face in faces]
    for i in range(len(faces)):
        earlier = [j for j in range(i) if proper[i] and proper[j]]
        assert found.duplicate[i] == any(turns[i] == turns[j] for j in earlier)
        assert found.repeated[i] == any(turns[i] in (turns[j], back[j]) for j in earlier)
        assert found.opposed[i] == any(proper[i] and proper[j] and turns[i] == back[j] for j in range(len(faces)))
