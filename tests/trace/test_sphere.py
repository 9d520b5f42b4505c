"""The gather over the whole sphere: closed forms, and every tracer against brute force."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bake import spherical_harmonics
from bake.errors import SettingsError
from bake.geometry import sphere_direction
from bake.low_discrepancy import owen_sobol
from bake.settings import BakeSettings, Kernel
from bake.trace import SphereTally
from bake.types import World
from tests.trace.clutter import clutter
from tests.trace.conftest import open_tracer
from tests.worlds import icosphere, make_world, quad

OBSCURANCE = BakeSettings()
OCCLUSION = BakeSettings(kernel=Kernel.OCCLUSION, max_distance=1e5)


def gather(body: str, world: World, settings: BakeSettings, points: np.ndarray, directions: int) -> SphereTally:
    """What a tracer finds around points, with seeds by their number."""
    with open_tracer(body, world, settings) as tracer:
        seeds = np.arange(len(points), dtype=np.uint32)
        return tracer.gather_sphere(points.astype(np.float32), seeds, directions)


def test_basis_is_orthonormal() -> None:
    """The nine functions integrate to the identity over the sphere."""
    u, v = owen_sobol(np.arange(1 << 16), np.full(1 << 16, 3))
    basis = spherical_harmonics.evaluate(sphere_direction(u, v))
    np.testing.assert_allclose(4.0 * math.pi * basis.T @ basis / len(basis), np.eye(9), atol=2e-4)


def test_open_space_is_constant(body: str) -> None:
    """Where nothing is near only the constant is left, and nothing counts as hit."""
    found = gather(body, make_world(quad(0.01, -5e4)), OBSCURANCE, np.zeros((3, 3)), 1024)
    np.testing.assert_allclose(found.sh[:, 0], math.sqrt(4.0 * math.pi), rtol=1e-5)
    assert np.abs(found.sh[:, 1:]).max() < 0.02
    assert found.hits.sum() == 0
    assert found.valid(0.0).all()


def test_half_space_over_the_ground(body: str) -> None:
    """Over endless ground the upper half is open: c00 halves, band 1 points up, band 2 vanishes."""
    found = gather(body, make_world(quad(4e4)), OCCLUSION, np.array([[0.3, 0.5, -0.2]]), 4096)
    expected = np.zeros(9)
    expected[0] = math.sqrt(math.pi)
    expected[1] = math.sqrt(3.0 * math.pi) / 2.0  # the coefficient of y
    np.testing.assert_allclose(found.sh[0, :, 0], expected, atol=0.01)
    assert found.hits[0] == pytest.approx(2048, abs=8)
    assert found.back_faces[0] == 0


def test_below_the_ground_is_invalid(body: str) -> None:
    """Seen from behind, the ground is all back faces."""
    found = gather(body, make_world(quad(4e4, centre=(7e3, -7e3))), OCCLUSION, np.array([[0.3, -0.5, -0.2]]), 1024)
    # The rest arrives within a degree of grazing.
    assert found.back_faces[0] > 0.9 * found.hits[0]
    assert not found.valid(0.25)[0]


@pytest.mark.parametrize("radius", [0.5, 20.0])
def test_sphere_centre_is_the_falloff(body: str, radius: float) -> None:
    """At the centre of a sphere the open share is ρ(r) everywhere."""
    sphere = icosphere(3 if body == "brute" else 4, radius, inward=True)
    found = gather(body, make_world(sphere), OBSCURANCE, np.zeros((1, 3)), 1024)
    rho = np.array([1.0 - 2.0 ** (-radius / 2.0), 1.0 - 2.0 ** (-radius / 300.0)])
    np.testing.assert_allclose(found.sh[0, 0], rho * math.sqrt(4.0 * math.pi), rtol=0.005)
    assert np.abs(found.sh[0, 1:]).max() < 0.02
    assert found.hits[0] == 1024


@pytest.mark.parametrize("kernel", list(Kernel))
def test_fast_tracers_equal_brute_force(fast_body: str, kernel: Kernel) -> None:
    """Point for point the fused gather agrees with NumPy; a ray at an edge may fall on either side."""
    settings = OBSCURANCE.replaced(kernel=kernel, max_distance=5.0 if kernel is Kernel.OCCLUSION else None)
    world, points = clutter(6), np.random.default_rng(8).uniform(-4, 4, (96, 3))
    expected = gather("brute", world, settings, points, 64)
    found = gather(fast_body, world, settings, points, 64)
    difference = np.abs(found.sh - expected.sh).max(axis=(1, 2))
    assert np.quantile(difference, 0.9) < 2e-4
    assert difference.max() < 2.0 * 4.0 * math.pi / 64
    assert (found.hits != expected.hits).mean() < 0.05
    assert (found.back_faces != expected.back_faces).mean() < 0.05
    assert 0.05 < found.back_faces.sum() / found.hits.sum() < 0.95


def test_parts_do_not_matter(fast_body: str) -> None:
    """The same bits come out however the points are divided among calls."""
    world, points = clutter(4), np.random.default_rng(2).uniform(-4, 4, (20, 3)).astype(np.float32)
    seeds = np.arange(20, dtype=np.uint32)
    with open_tracer(fast_body, world, OBSCURANCE) as tracer:
        whole = tracer.gather_sphere(points, seeds, 64)
        parts = [tracer.gather_sphere(points[i : i + 7], seeds[i : i + 7], 64).sh for i in range(0, 20, 7)]
        assert tracer.points_at_once(64) >= 1
    np.testing.assert_array_equal(np.concatenate(parts), whole.sh)


@pytest.mark.parametrize("directions", [0, 65536])
def test_directions_have_bounds(body: str, directions: int) -> None:
    """A count of directions that the tally cannot hold is refused."""
    with pytest.raises(SettingsError, match="directions"):
        gather(body, make_world(quad()), OBSCURANCE, np.zeros((1, 3)), directions)


def test_no_points_is_fine(body: str) -> None:
    """No points give an empty tally."""
    assert len(gather(body, make_world(quad()), OBSCURANCE, np.zeros((0, 3)), 16)) == 0
