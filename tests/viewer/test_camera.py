"""The camera's geometry."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewer.camera import Camera, guessed_up_axis, robust_bounds

angles = st.floats(-3.0, 3.0)
cameras = st.builds(
    Camera,
    focal=st.tuples(*[st.floats(-50, 50)] * 3),
    azimuth=angles,
    elevation=st.floats(-1.5, 1.5),
    distance=st.floats(0.1, 100),
    up_axis=st.sampled_from([1, 2]),
)


@given(cameras)
def test_axes_are_orthonormal_and_level(camera: Camera) -> None:
    """Right, up and backward form a right-handed frame whose right axis lies in the horizon."""
    frame = np.stack((camera.right, camera.picture_up, camera.backward))
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    assert camera.right @ camera.up == pytest.approx(0.0, abs=1e-9)


@given(cameras, angles, angles)
def test_orbit_keeps_the_distance(camera: Camera, azimuth: float, elevation: float) -> None:
    """Orbiting moves the eye on a sphere about the focal point and never turns over."""
    turned = camera.orbited(azimuth, elevation)
    assert turned.focal == camera.focal
    assert np.linalg.norm(turned.eye - np.asarray(turned.focal)) == pytest.approx(camera.distance)
    assert abs(turned.elevation) < math.pi / 2


@given(cameras, angles, st.floats(-0.5, 0.5))
def test_look_keeps_the_eye(camera: Camera, azimuth: float, elevation: float) -> None:
    """Looking around turns about the eye."""
    np.testing.assert_allclose(camera.looked(azimuth, elevation).eye, camera.eye, atol=1e-6)


@given(cameras, st.floats(1.01, 3.0), st.floats(-0.8, 0.8), st.floats(-0.8, 0.8))
def test_zoom_keeps_the_point_under_the_cursor(camera: Camera, factor: float, x: float, y: float) -> None:
    """Zooming about a point leaves it on the same ray."""
    origin, direction = camera.ray(x, y, 1.5)
    point = origin + 7.0 * direction
    nearer = camera.zoomed(factor, point)
    origin, direction = nearer.ray(x, y, 1.5)
    along = point - origin
    np.testing.assert_allclose(along / np.linalg.norm(along), direction, atol=1e-6)
    assert np.linalg.norm(along) == pytest.approx(7.0 / factor, rel=1e-6)


@given(cameras, st.floats(0.4, 3.0))
def test_frame_shows_the_whole_box(camera: Camera, aspect: float) -> None:
    """Every corner of a framed box projects into the picture, in front of the eye."""
    low, high = np.array([-3.0, 1.0, 2.0]), np.array([4.0, 2.0, 9.0])
    framed = camera.framed(low, high, aspect)
    tangent = math.tan(framed.view_angle / 2)
    for bit in range(8):
        corner = np.array([(low, high)[bit >> axis & 1][axis] for axis in range(3)])
        offset = corner - framed.eye
        depth = -offset @ framed.backward
        assert depth > 0
        assert abs(offset @ framed.picture_up) <= depth * tangent * 1.001
        assert abs(offset @ framed.right) <= depth * tangent * aspect * 1.001


def test_flight_starts_and_ends_where_it_should() -> None:
    """At share 0 nothing has moved, at 1 the goal is reached, and the turn goes the short way."""
    start, end = Camera(azimuth=3.0, distance=1.0), Camera(azimuth=-3.0, distance=9.0, focal=(1, 2, 3))
    np.testing.assert_allclose(start.toward(end, 0.0).eye, start.eye, atol=1e-9)
    np.testing.assert_allclose(start.toward(end, 1.0).eye, end.eye, atol=1e-9)
    assert abs(start.toward(end, 0.5).azimuth) > 3.0


def test_robust_bounds_ignore_a_backdrop() -> None:
    """A few mountains far away do not count; without them the box is the full one."""
    level = np.random.default_rng(3).uniform(-10, 10, (5000, 3))
    backdrop = np.array([[4000.0, 0.0, 0.0], [-4000.0, 0.0, 500.0]])
    low, high = robust_bounds(np.concatenate((level, backdrop)))
    assert (high - low).max() < 25
    np.testing.assert_array_equal(robust_bounds(level)[0], level.min(axis=0))


def test_up_axis_is_where_floors_face() -> None:
    """Large horizontal faces decide between Y and Z; in doubt it is Y."""
    assert guessed_up_axis(np.array([[0, 0, 9.0], [2, 0, 0], [0, 1, 0]])) == 2
    assert guessed_up_axis(np.array([[0, 9.0, 0], [2, 0, 0], [0, 0, -1]])) == 1
    assert guessed_up_axis(np.zeros((0, 3))) == 1
