"""How the prior follows count and noise."""

from __future__ import annotations

import numpy as np

from bake.solve.mass import face_moments
from bake.solve.prior import SHARE, STRONGEST, UNDETERMINED, Trust, estimate_trust
from bake.solve.surface import build_surface
from tests.solve.solve_cases import ao_of, grid, random_samples
from tests.worlds import make_world


def trust(per_face: int, noise: float, *, slope: float = 0.5) -> Trust:
    """Of a flat grid with a linear AO of some slope and normal noise."""
    world = make_world(grid(30, 30))
    surface = build_surface(world, crease_angle=40.0, weld_instances=False)
    samples = random_samples(world, per_face)
    ao = ao_of(world, samples, lambda p: 0.25 + slope * p[:, 0])
    ao += np.random.default_rng(2).normal(0.0, noise, ao.shape).astype(np.float32)
    return estimate_trust(surface, face_moments(surface, samples, ao, np.ones(len(ao), bool)))


def test_no_noise_no_prior() -> None:
    """Exact linear data leave least squares alone."""
    assert trust(6, 0.0).shrinkage.max() < 1e-6


def test_strength_is_noise_over_signal_per_sample() -> None:
    """Against the formula's own expectation: σ² over n times the variance of the slope inside a triangle."""
    # a linear function of slope s over a right triangle of legs h varies by (s h)² / 18; two degrees share it
    signal = (0.5 / 30) ** 2 / 18 / 2
    for per_face in (8, 32):
        for noise in (0.003, 0.01):
            expected = SHARE * noise**2 / (per_face * signal)
            assert 0.7 < np.median(trust(per_face, noise).shrinkage) / expected < 1.4


def test_pure_noise_asks_for_the_average() -> None:
    """Where planes explain no more than chance, the prior is far stronger than where they do."""
    assert np.median(trust(8, 0.05, slope=0.0).shrinkage) > 0.3 * STRONGEST


def test_alpha_zero_leaves_only_what_is_undetermined() -> None:
    """With four samples a face the prior is off at alpha 0; with one it stays."""
    zero = np.zeros(31 * 31)
    assert (trust(4, 0.05).strength(zero) == 0).all()
    assert (trust(1, 0.05).strength(zero) == UNDETERMINED).all()
    assert (trust(4, 0.05).strength(zero + 0.03) > 0).all()
