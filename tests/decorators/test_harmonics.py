"""AO from spherical harmonics, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from bake import spherical_harmonics
from bake.decorators.harmonics import ambient_obscurance, constant


def sphere(count: int = 200_000) -> np.ndarray:
    """A Fibonacci spiral of unit directions."""
    i = np.arange(count) + 0.5
    z, angle = 1.0 - 2.0 * i / count, np.pi * (1.0 + 5.0**0.5) * i
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)


DIRECTIONS = sphere()


def project(values: np.ndarray) -> np.ndarray:
    """Coefficients of a function given in DIRECTIONS, shape (1, 9, 1)."""
    basis = spherical_harmonics.evaluate(DIRECTIONS)
    return (4.0 * np.pi * (basis * values[:, None]).mean(0))[None, :, None]


def test_open_sphere_is_one_about_any_normal() -> None:
    """The constant 1 has AO 1, whatever the normal."""
    ao = ambient_obscurance(constant(1.0, 100, 2), DIRECTIONS[::2000])
    np.testing.assert_allclose(ao, 1.0, atol=1e-6)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, 1.0, 0.0), (0.0, -0.6, -0.8)])
def test_half_space_is_exact(normal: tuple[float, float, float]) -> None:
    """Above an endless plane AO is (1 + cos) / 2, which quadratic harmonics hold exactly."""
    sh = project((DIRECTIONS[:, 2] > 0.0).astype(float))
    assert ambient_obscurance(sh, np.array([normal]))[0, 0] == pytest.approx((1.0 + normal[2]) / 2.0, abs=2e-4)


def test_smooth_visibility_matches_the_integral() -> None:
    """For visibility within the quadratic band the convolution equals the integral over the hemisphere."""
    x, y, z = DIRECTIONS.T
    values = 0.5 + 0.2 * x * y - 0.15 * z + 0.1 * (x * x - z * z)
    normals = DIRECTIONS[::25_000]
    wanted = [4.0 * (values * np.maximum(DIRECTIONS @ n, 0.0)).mean() for n in normals]
    got = ambient_obscurance(np.repeat(project(values), len(normals), axis=0), normals)[:, 0]
    np.testing.assert_allclose(got, wanted, atol=1e-4)


def test_ringing_is_cut_off() -> None:
    """A narrow opening rings below 0 behind it; the output stays within 0 and 1."""
    sh = project(np.where(DIRECTIONS[:, 2] > 0.95, 40.0, 0.0))
    ao = ambient_obscurance(np.repeat(sh, 200, axis=0), DIRECTIONS[::1000])
    assert ao.min() == 0.0
    assert ao.max() == 1.0
