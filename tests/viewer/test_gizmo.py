"""Handles for moving objects: which one a ray meets, and what a drag of it does."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewer.camera import Camera
from viewer.gizmo import HANDLES, Gizmo, Handle, Kind, Motion
from viewer.picture import boxes_in_picture, picture_matrix

CENTRE = np.array((3.0, 1.0, -2.0))
CAMERA = Camera(focal=(3.0, 1.0, -2.0), distance=8.0)
COORDINATE = st.floats(-5.0, 5.0)


def _gizmo() -> Gizmo:
    return Gizmo(CENTRE, 1.0, CAMERA.picture_up)


def _ray(point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    direction = point - CAMERA.eye
    return CAMERA.eye, direction / np.linalg.norm(direction)


@pytest.mark.parametrize("axis", range(3))
def test_arrows_are_found_at_their_tips(axis: int) -> None:
    """The ray through the tip of an arrow takes it, one far away takes nothing."""
    tip = CENTRE + 0.97 * np.eye(3)[axis]
    assert _gizmo().handle_at(*_ray(tip), 0.01) == Handle(Kind.MOVE_ALONG, axis)
    assert _gizmo().handle_at(*_ray(CENTRE + 3.0), 0.01) is None


@given(st.integers(0, 2), st.floats(-2.0, 2.0))
def test_an_arrow_follows_the_cursor(axis: int, length: float) -> None:
    """Dragged from one point of its line to another, it moves by the distance between them, along that axis alone."""
    start, end = CENTRE + 0.5 * np.eye(3)[axis], CENTRE + (0.5 + length) * np.eye(3)[axis]
    motion = _gizmo().dragged(Handle(Kind.MOVE_ALONG, axis), _ray(start), _ray(end))
    np.testing.assert_allclose(motion.shift, length * np.eye(3)[axis], atol=1e-9)
    assert np.count_nonzero(motion.shift) <= 1


@given(st.integers(0, 2), COORDINATE, COORDINATE)
def test_a_plane_follows_the_cursor(axis: int, first: float, second: float) -> None:
    """Dragged within a plane, the object goes where the cursor goes, and stays in it."""
    shift = np.zeros(3)
    shift[(axis + 1) % 3], shift[(axis + 2) % 3] = first, second
    start, now = _ray(CENTRE), _ray(CENTRE + shift)
    if (CAMERA.eye - CENTRE)[axis] < 0.0 or abs(now[1][axis]) < 0.06:
        return
    motion = _gizmo().dragged(Handle(Kind.MOVE_ACROSS, axis), start, now)
    np.testing.assert_allclose(motion.shift, shift, atol=1e-7)


@pytest.mark.parametrize("axis", range(3))
def test_a_ring_turns_by_the_angle(axis: int) -> None:
    """A quarter of a ring is a quarter turn, and whole steps are whole."""
    x, y = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
    angle = math.radians(38.0)
    end = CENTRE + math.cos(angle) * x + math.sin(angle) * y
    motion = _gizmo().dragged(Handle(Kind.TURN, axis), _ray(CENTRE + x), _ray(end))
    np.testing.assert_allclose(motion.turn @ x, math.cos(angle) * x + math.sin(angle) * y, atol=1e-9)
    snapped = _gizmo().dragged(Handle(Kind.TURN, axis), _ray(CENTRE + x), _ray(end), snap=True)
    assert snapped.text.startswith("+45.0°")


def test_up_is_larger() -> None:
    """Dragged upwards the cube scales up, downwards down; the centre stays."""
    up = CENTRE + 0.4 * CAMERA.picture_up
    motion = _gizmo().dragged(Handle(Kind.SCALE), _ray(CENTRE), _ray(up))
    assert motion.factor > 1.2
    assert _gizmo().dragged(Handle(Kind.SCALE), _ray(up), _ray(CENTRE)).factor < 0.9
    np.testing.assert_allclose(motion.moved(CENTRE[None], CENTRE), CENTRE[None])


def test_what_is_dragged_stands_out() -> None:
    """All handles are drawn, the active one in a colour of its own."""
    positions, pairs, colors = _gizmo().shapes(HANDLES[0])
    assert len(positions) == len(colors) == pairs.size
    assert (colors == colors[0]).all(axis=1).sum() == 24


def test_no_motion_is_still() -> None:
    """A click on a handle changes nothing."""
    ray = _ray(CENTRE + np.eye(3)[0])
    assert all(_gizmo().dragged(handle, ray, ray).is_still for handle in HANDLES)
    assert Motion().is_still


def test_boxes_in_the_picture() -> None:
    """A box before the camera is in the picture; one behind it, or far to the side, is not."""
    matrix = np.array(picture_matrix(CAMERA, 1.5)).reshape(4, 4)
    sizes = np.array([[-0.5] * 3, [0.5] * 3])
    behind = CAMERA.eye + 5.0 * CAMERA.backward
    beside = CENTRE + 40.0 * CAMERA.right
    boxes = np.stack([CENTRE + sizes, behind + sizes, beside + sizes])
    assert boxes_in_picture(boxes, matrix).tolist() == [True, False, False]
