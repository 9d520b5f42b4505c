"""The truth along a path, traced by something whose answer is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bake.sphere_rays import SphereTracer
from bake.trace.base import SphereTally
from bake.types import Progress
from bake.walk import PathTruth, WalkPath, path_in_pieces, path_through, trace_truth
from bake.walk.frames import frames_along
from bake.walk.truth import truth_along

UP = np.array([[0.282094791773878] + [0.0] * 8])


class Formula:
    """Stands for a tracer: openness is a wave along x, and beyond x = 8 all is inside something."""

    def __init__(self) -> None:
        self.points = 0

    def gather_sphere(self, points: np.ndarray, seeds: np.ndarray, directions: int) -> SphereTally:
        """Openness without direction."""
        assert len(np.unique(seeds)) == 1, "all places share their directions"
        self.points += len(points)
        sh = np.zeros((len(points), 9, 2))
        sh[:, 0] = math.sqrt(4.0 * math.pi) * (0.5 + 0.3 * np.sin(points[:, :1]))
        hits = np.full(len(points), directions, np.uint16)
        return SphereTally(sh.astype(np.float32), directions, hits, hits * (points[:, 0] > 8.0))

    def points_at_once(self, directions: int) -> int:
        """A small batch."""
        return 50


def traced(path: WalkPath, tracer: SphereTracer, spacing: float) -> PathTruth:
    """Runs the tracing to its end."""
    work = trace_truth(path, tracer, seed=7, back_face_threshold=0.25, directions=16, spacing=spacing)
    while True:
        try:
            assert isinstance(next(work), Progress)
        except StopIteration as stop:
            return stop.value


def test_interpolation_states_its_error() -> None:
    """The stated error is that of a line through a curve, and four times less at half the spacing."""
    path = path_through([[0, 0, 0], [7, 0, 0]])
    coarse, fine = (traced(path, Formula(), spacing) for spacing in (0.4, 0.2))
    frames = frames_along(path, speed=1.0, frame_rate=100.0)
    for truth in (coarse, fine):
        ao = truth_along(truth, frames, UP, 0)[:, 0]
        off = ao - (0.5 + 0.3 * np.sin(frames.position[:, 0]))
        assert np.abs(off).max() < 2.0 * truth.error[0]
    assert fine.error[0] == pytest.approx(coarse.error[0] / 4.0, rel=0.1)


def test_the_truth_serves_every_frame_rate() -> None:
    """It is traced once, by place: other speeds and frame rates only read it."""
    tracer, path = Formula(), path_through([[0, 0, 0], [7, 0, 0]])
    truth = traced(path, tracer, 0.1)
    count = tracer.points
    for speed, rate in ((0.5, 30.0), (6.0, 144.0)):
        frames = frames_along(path, speed=speed, frame_rate=rate)
        ao = truth_along(truth, frames, UP, 1)[:, 0]
        assert np.allclose(ao, 0.5 + 0.3 * np.sin(frames.position[:, 0]), atol=1e-3)
    assert tracer.points == count


def test_places_inside_geometry_do_not_count() -> None:
    """Next to a place that sees too many back faces nothing is known."""
    path = path_through([[6, 0, 0], [10, 0, 0]])
    truth = traced(path, Formula(), 0.1)
    frames = frames_along(path, speed=1.0, frame_rate=50.0)
    known = np.isfinite(truth_along(truth, frames, UP, 0)[:, 0])
    assert known[frames.position[:, 0] < 7.8].all()
    assert not known[frames.position[:, 0] > 8.0].any()


def test_pieces_do_not_mix() -> None:
    """On either side of a teleport the truth is that of its own piece."""
    path = path_in_pieces([[[0, 0, 0], [1, 0, 0]], [[4, 0, 0], [5, 0, 0]]])
    truth = traced(path, Formula(), 0.05)
    frames = frames_along(path, speed=1.0, frame_rate=50.0)
    ao = truth_along(truth, frames, UP, 0)[:, 0]
    assert np.allclose(ao, 0.5 + 0.3 * np.sin(frames.position[:, 0]), atol=1e-3)
