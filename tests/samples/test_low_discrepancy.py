"""The sequence is the net that its error rates rest on."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bake.geometry import above_face, cosine_direction, falloff, frame
from bake.low_discrepancy import owen_sobol, reverse_bits


def is_net(u: np.ndarray, v: np.ndarray, bits: int) -> bool:
    """Whether 2^bits points put exactly one in every elementary interval."""
    for a in range(bits + 1):
        cells = np.floor(u * 2**a).astype(int) * 2 ** (bits - a) + np.floor(v * 2 ** (bits - a)).astype(int)
        if len(np.unique(cells)) != 2**bits:
            return False
    return True


@given(st.integers(0, 2**32 - 1), st.integers(0, 200))
def test_every_aligned_block_is_a_net(seed: int, block: int) -> None:
    """Each aligned block of 2^k points, what one sample uses, is a (0, k, 2)-net for every seed."""
    for bits in (2, 4, 6):
        index = np.arange(2**bits) + block * 2**bits
        assert is_net(*owen_sobol(index, np.full(len(index), seed)), bits)


@pytest.mark.parametrize("bits", [8, 10])
def test_long_prefixes_are_nets(bits: int) -> None:
    """All the rays of a face together are a net as well."""
    index = np.arange(2**bits)
    assert all(is_net(*owen_sobol(index, np.full(len(index), seed)), bits) for seed in range(8))


@given(st.integers(0, 2**32 - 1))
def test_reversing_bits_twice_changes_nothing(value: int) -> None:
    """Bit reversal is its own inverse."""
    x = np.array([value], np.uint32)
    assert reverse_bits(reverse_bits(x))[0] == value
    assert int(reverse_bits(x)[0]) == int(f"{value:032b}"[::-1], 2)


def test_scrambles_are_unbiased_and_independent() -> None:
    """Over many seeds each point is uniform, and two seeds have nothing in common."""
    seeds = np.arange(20_000)
    u, v = owen_sobol(np.full(len(seeds), 5), seeds)
    for x in (u, v):
        assert abs(x.mean() - 0.5) < 4 * (1 / 12) ** 0.5 / len(seeds) ** 0.5
        assert abs(x.var() - 1 / 12) < 0.002
    assert abs(np.corrcoef(u, v)[0, 1]) < 0.03
    assert abs(np.corrcoef(u[:-1], u[1:])[0, 1]) < 0.03


def error_of(rays: int, function, *, owen: bool, seeds: int = 100) -> float:
    """Root mean square error of a gather with some rays over many scrambles."""
    truth = function(*owen_sobol(np.arange(2**16), np.zeros(2**16, int))).mean()
    errors = []
    for seed in range(seeds):
        if owen:
            u, v = owen_sobol(np.arange(rays), np.full(rays, seed + 1))
        else:  # stratified jitter
            side = int(rays**0.5)
            jitter = np.random.default_rng(seed).random((2, side, side))
            u = ((np.arange(side)[:, None] + jitter[0]) / side).ravel()
            v = ((np.arange(side)[None, :] + jitter[1]) / side).ravel()
        errors.append(function(u, v).mean() - truth)
    return float(np.sqrt(np.mean(np.square(errors))))


def smooth(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A smooth integrand over the hemisphere."""
    d = cosine_direction(u, v, np.tile([0.0, 0.0, 1.0], (len(u), 1)))
    return 1.0 / (1.5 + d[:, 2] ** 2 + 0.3 * d[:, 0])


def silhouette(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """An integrand with an edge: a slanted horizon."""
    d = cosine_direction(u, v, np.tile([0.0, 0.0, 1.0], (len(u), 1)))
    return (d @ np.array([0.3, 0.5, -0.4]) < 0.05).astype(float)


def test_owen_beats_jitter_where_ao_is_smooth() -> None:
    """At 256 rays the error is at most 0.6 times that of stratified jitter."""
    assert error_of(256, smooth, owen=True) <= 0.6 * error_of(256, smooth, owen=False)


@pytest.mark.parametrize(("function", "slope"), [(smooth, -1.1), (silhouette, -0.7)])
def test_error_falls_as_fast_as_promised(function, slope: float) -> None:
    """Smooth integrands converge faster than 1/N, silhouettes at about N^-3/4."""
    counts = np.array([16, 64, 256, 1024])
    errors = [error_of(n, function, owen=True) for n in counts]
    assert np.polyfit(np.log(counts), np.log(errors), 1)[0] <= slope


@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3).filter(lambda n: np.linalg.norm(n) > 1e-3))
def test_frames_are_orthonormal(n: list[float]) -> None:
    """Every normal, the poles included, gets a right-handed frame."""
    normal = np.array([n]) / np.linalg.norm(n)
    t, b = frame(normal)
    basis = np.stack([t[0], b[0], normal[0]])
    np.testing.assert_allclose(basis @ basis.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(basis) == pytest.approx(1.0)


def test_directions_follow_the_cosine() -> None:
    """The mean of cos θ is ⅔ and the mean direction lies along the normal, as the density cos θ / π demands."""
    normal = np.tile([[0.6, 0.0, 0.8]], (4096, 1))
    d = cosine_direction(*owen_sobol(np.arange(4096), np.full(4096, 9)), normal)
    np.testing.assert_allclose(np.linalg.norm(d, axis=1), 1.0, atol=1e-12)
    assert (d @ normal[0]).mean() == pytest.approx(2 / 3, abs=1e-4)
    np.testing.assert_allclose(d.mean(0), normal[0] * 2 / 3, atol=1e-3)


@given(st.integers(0, 10_000))
def test_mirrored_directions_stay_above_and_unit(seed: int) -> None:
    """Below the face plane directions are mirrored; above it nothing changes."""
    rng = np.random.default_rng(seed)
    d, n = (x / np.linalg.norm(x, axis=1, keepdims=True) for x in rng.normal(size=(2, 50, 3)))
    m = above_face(d, n)
    heights = np.einsum("ij,ij->i", d, n)
    assert (np.einsum("ij,ij->i", m, n) >= -1e-12).all()
    np.testing.assert_allclose(np.linalg.norm(m, axis=1), 1.0, atol=1e-12)
    np.testing.assert_array_equal(m[heights >= 0], d[heights >= 0])


def test_falloff_is_half_at_its_distance_and_exact_near_zero() -> None:
    """ρ(0) = 0, ρ(D) = ½, ρ(∞) = 1, and small distances keep their relative precision."""
    np.testing.assert_allclose(falloff(np.array([0.0, 2.0, 1e9]), 2.0), [0.0, 0.5, 1.0])
    assert falloff(np.array([1e-3]), 300.0)[0] == pytest.approx(np.log(2) * 1e-3 / 300.0, rel=1e-5)
