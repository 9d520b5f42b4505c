"""Global AO: what is met exactly, and what must not break it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.decorators.alternating import Instance, refine
from bake.decorators.fit import THIN, fit_global, model_error, root_mean_square


def scattered(count: int = 400, *, seed: int = 1, size: tuple[float, float, float] = (3.0, 5.0, 3.0)):
    """Positions about a centre, areas, and local AO between 0.2 and 1 for two distances."""
    rng = np.random.default_rng(seed)
    offsets = rng.uniform(-1.0, 1.0, (count, 3)) * size
    return offsets, rng.uniform(0.1, 2.0, count), rng.uniform(0.2, 1.0, (count, 2))


def linear(offsets: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Values of a linear function."""
    return y[0] + offsets @ y[1:]


TRUTH = np.array([[0.6, 0.4], [0.02, -0.01], [-0.03, 0.02], [0.01, 0.0]])


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_linear_gold_signal_is_fitted_exactly(scale: float) -> None:
    """If gold is a linear function times local AO, its coefficients come out, at any size and off-centre."""
    offsets, area, local = scattered()
    offsets = (offsets + np.array([2.0, 0.0, -1.0])) * scale
    truth = TRUTH / np.array([[1.0], [scale], [scale], [scale]])
    gold = linear(offsets, truth) * local
    fit = fit_global(gold, local, offsets, area * scale**2)
    scaled = fit.coefficients * [[1.0], [scale], [scale], [scale]]
    np.testing.assert_allclose(scaled, TRUTH, atol=1e-9)
    assert (fit.terms == 4).all()
    np.testing.assert_allclose(model_error(gold, fit.at(offsets) * local, area), 0.0, atol=1e-9)


def test_it_is_the_minimum() -> None:
    """No small step away from the solution lowers the sum of squares."""
    offsets, area, local = scattered()
    gold = np.random.default_rng(5).random((400, 2))
    fit = fit_global(gold, local, offsets, area)

    def cost(y: np.ndarray) -> np.ndarray:
        return (area[:, None] * (gold - linear(offsets, y) * local) ** 2).sum(axis=0)

    least = cost(fit.coefficients)
    for row in range(4):
        for step in (-1e-3, 1e-3):
            moved = fit.coefficients.copy()
            moved[row] += step
            assert (cost(moved) > least).all()


@pytest.mark.parametrize(
    ("flattened", "terms"),
    [((0, 0, 0), 1), ((1, 0, 0), 2), ((1, 0, 1), 3), ((1, 1, 1e-5), 3), ((1, 1, 0.05), 4)],
    ids=["point", "line", "card", "nearly a card", "thin"],
)
def test_directions_without_spread_have_no_slope(flattened: tuple[float, float, float], terms: int) -> None:
    """A point, a line or a flat card determines fewer terms; what it does determine is met exactly."""
    offsets, area, local = scattered()
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    offsets = (offsets * flattened) @ turn.T
    gold = linear(offsets, TRUTH) * local
    fit = fit_global(gold, local, offsets, area)
    assert (fit.terms == terms).all()
    np.testing.assert_allclose(fit.at(offsets) * local, gold, atol=1e-5)
    assert np.abs(fit.coefficients).max() < 1.0


def test_missing_gold_is_left_out() -> None:
    """Samples without gold count for nothing; without any, global AO is that of the open."""
    offsets, area, local = scattered()
    gold = linear(offsets, TRUTH) * local
    gold[::3] = np.nan
    fit = fit_global(gold, local, offsets, area)
    np.testing.assert_allclose(fit.coefficients, TRUTH, atol=1e-9)
    for nothing in (np.full_like(gold, np.nan), gold):
        dark = local * 0.0 if nothing is gold else local
        empty = fit_global(nothing, dark, offsets, area)
        assert empty.terms.tolist() == [0, 0]
        np.testing.assert_array_equal(empty.coefficients[:, 0], [1.0, 0.0, 0.0, 0.0])


@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 40),
    st.tuples(*[st.sampled_from([0.0, 1e-6, 1e-3, 1.0, 100.0])] * 3),
    st.sampled_from([0.0, 1e-5, 0.5]),
)
@settings(max_examples=150, deadline=None)
def test_whatever_the_shape_the_fit_is_sane(
    seed: int, count: int, size: tuple[float, float, float], darkest: float
) -> None:
    """Any spread, any number of samples, any local AO: finite, no warning, and no worse than the best constant."""
    rng = np.random.default_rng(seed)
    offsets = rng.normal(size=(count, 3)) * size
    local, gold = rng.uniform(darkest, 1.0, (count, 1)) * min(1.0, darkest * 1e5), rng.random((count, 1))
    area = rng.random(count) * 10.0 ** rng.uniform(-9, 9)
    fit = fit_global(gold, local, offsets, area)
    assert np.isfinite(fit.coefficients).all()
    assert (fit.terms <= 4).all()
    if fit.terms[0]:
        constant = (area @ (local * gold)) / (area @ local**2)
        error = root_mean_square(fit.at(offsets) * local - gold, area)
        assert error <= root_mean_square(constant * local - gold, area) + 1e-9


@pytest.mark.parametrize("spread", [1e-9, 1e-6, 1e-4, 1e-2, 1.0])
@pytest.mark.parametrize("flat", [1e-9, 1e-4, 1e-2, 1.0])
def test_what_is_solved_is_well_conditioned(spread: float, flat: float) -> None:
    """Whether light reaches but a spot off the centre, or the tree is thin: the condition number stays below 1e8."""
    offsets, area, local = scattered(size=(1.0, 1.0, flat))
    local[4:] = 0.0
    offsets[:4] = offsets[0] + spread * offsets[:4]
    fit = fit_global(local * 0.5, local, offsets, area)
    assert (fit.condition <= 1e8).all()
    assert (fit.condition >= 1.0).all()
    assert np.isfinite(fit.coefficients).all()
    assert np.abs(fit.coefficients).max() < 10.0
    ordinary = fit_global(*(np.ones((400, 1)),) * 2, scattered()[0], area)
    assert 1.0 < ordinary.condition[0] < THIN**-2


def trees(count: int = 6, seed: int = 3) -> tuple[list[Instance], np.ndarray, np.ndarray, np.ndarray]:
    """Instances of a made-up mesh of 60 vertices whose gold follows another local AO than the one it starts from."""
    rng = np.random.default_rng(seed)
    corners = rng.integers(0, 60, (300, 3)).astype(np.int32)
    weights = rng.dirichlet([1.0, 1.0, 1.0], 300)
    places = rng.uniform(-3.0, 3.0, (60, 3))
    alone = rng.uniform(0.3, 0.9, (60, 2)).astype(np.float32)
    truth = np.clip(alone + rng.normal(0.0, 0.15, alone.shape), 0.0, 1.0)
    offsets = np.einsum("ij,ijk->ik", weights, places[corners])
    at_samples = np.einsum("ij,ijk->ik", weights, truth[corners])
    found = []
    for _ in range(count):
        y = np.vstack([rng.uniform(0.4, 1.0, 2), rng.normal(0.0, 0.03, (3, 2))])
        gold = linear(offsets, y) * at_samples + rng.normal(0.0, 0.02, at_samples.shape)
        found.append(Instance(gold, offsets, rng.uniform(0.5, 1.5, 300)))
    return found, corners, weights, alone


@pytest.mark.parametrize("prior", [0.0, 0.05, 10.0])
def test_alternating_never_grows(prior: float) -> None:
    """The sum that is minimised decreases in every round, and local AO stays within 0 and 1."""
    instances, corners, weights, alone = trees()
    found = refine(instances, corners, weights, alone, prior=prior)
    assert (np.diff(found.objective, axis=0) <= 1e-12).all()
    assert 0.0 <= found.local_ao.min() <= found.local_ao.max() <= 1.0
    assert len(found.objective) > 1


def test_alternating_saves_error() -> None:
    """Where instances agree on another local AO, refining finds most of it."""
    instances, corners, weights, alone = trees()
    found = refine(instances, corners, weights, alone)

    def errors(local: np.ndarray) -> float:
        at_samples = np.einsum("ij,ijk->ik", weights, local[corners].astype(float))
        fits = [fit_global(item.gold, at_samples, item.offsets, item.area) for item in instances]
        return float(
            np.mean(
                [
                    model_error(i.gold, f.at(i.offsets) * at_samples, i.area)
                    for i, f in zip(instances, fits, strict=True)
                ]
            )
        )

    assert errors(found.local_ao) < 0.6 * errors(alone)


def test_vertices_without_samples_keep_their_local_ao() -> None:
    """What no sample touches stays as it was baked, and missing gold is no harm."""
    instances, corners, weights, alone = trees()
    unseen = np.concatenate([alone, [[0.25, 0.75]]]).astype(np.float32)
    instances[0].gold[:] = np.nan
    found = refine(instances, corners, weights, unseen)
    np.testing.assert_allclose(found.local_ao[-1], [0.25, 0.75], atol=1e-6)
    assert np.isfinite(found.local_ao).all()
    assert found.fits[0].terms.tolist() == [0, 0]
