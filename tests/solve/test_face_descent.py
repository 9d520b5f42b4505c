"""Least squares inside bounds face by face, and what takes over where that finds no way down."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear
from scipy.sparse import block_diag, csr_array

import bake.solve.face_descent
from bake.solve.conjugate_gradient import BoxSolver
from tests.solve.box_cases import blocks, grids


@given(st.integers(0, 2**32 - 1), st.lists(st.integers(1, 9), min_size=1, max_size=5))
def test_steps_within_the_box_take_over(seed: int, sizes: list[int]) -> None:
    """If no projection is good enough, every component with a value at a bound still comes to the optimum."""
    rng = np.random.default_rng(seed)
    factors, data = blocks(rng, sizes, 0.5)
    j = csr_array(block_diag(factors))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bake.solve.face_descent, "SUFFICIENT", 2.0)
        found = BoxSolver(csr_array(j.T @ j), np.cumsum([0, *sizes])).solve(
            j.T @ data, rng.random(sum(sizes)), tolerance=1e-11, most_iterations=100_000
        )
    assert found.converged.all()
    best = lsq_linear(j.toarray(), data, (0.0, 1.0), method="bvls", tol=1e-14)
    assert 0.5 * np.sum((j @ found.x - data) ** 2) <= best.cost * (1 + 1e-8) + 1e-12


@given(st.integers(0, 2**32 - 1), st.lists(st.integers(1, 20), min_size=1, max_size=4), st.floats(0.01, 10.0))
def test_the_optimum_meets_its_conditions(seed: int, sides: list[int], smoothing: float) -> None:
    """Inside the box slopes vanish, and at a bound they point outwards, as far as the tolerance tells."""
    matrix, rhs, first = grids(np.random.default_rng(seed), sides, 1, smoothing=smoothing)
    found = BoxSolver(matrix.copy(), first).solve(rhs[:, 0], np.full(len(rhs), 0.5), tolerance=1e-11)
    assert found.converged.all()
    slope = (matrix @ found.x - rhs[:, 0]) / np.sqrt(matrix.diagonal())
    outward = ((found.x <= 0) & (slope >= 0)) | ((found.x >= 1) & (slope <= 0))
    missed = np.linalg.norm(np.where(outward, 0.0, slope))
    assert missed <= 1e-10 * np.linalg.norm(rhs[:, 0] / np.sqrt(matrix.diagonal()))


def test_values_come_to_their_bounds_by_the_hundred() -> None:
    """Where a third of 10,000 values end at a bound, a few times the products without bounds are enough."""
    matrix, rhs, first = grids(np.random.default_rng(2), [100], 1)
    found = BoxSolver(matrix.copy(), first).solve(rhs[:, 0], np.full(len(rhs), 0.5), tolerance=1e-11)
    free = BoxSolver(matrix.copy(), first).solve(
        0.01 * rhs[:, 0] + 0.5 * (matrix @ np.ones(len(rhs))), np.full(len(rhs), 0.5), tolerance=1e-11
    )
    assert found.converged.all() and found.held.mean() > 0.2
    assert not free.held.any()
    assert found.iterations <= 2.5 * free.iterations


def test_components_are_given_up_one_by_one() -> None:
    """A component's products do not count against another's: the hard one ends where it would alone."""
    matrix, rhs, first = grids(np.random.default_rng(4), [30, 5], 1, smoothing=1e3)
    alone = BoxSolver(csr_array(matrix[:900][:, :900]), first[:2]).solve(
        rhs[:900, 0], np.full(900, 0.5), most_iterations=20
    )
    both = BoxSolver(matrix.copy(), first).solve(rhs[:, 0], np.full(925, 0.5), most_iterations=20)
    assert not alone.converged[0] and not both.converged[0]
    np.testing.assert_array_equal(both.x[:900], alone.x)
    assert both.x.min() >= 0.0 and both.x.max() <= 1.0
