"""Least squares inside bounds."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear
from scipy.sparse import block_diag, csr_array

from bake.solve.conjugate_gradient import BoxSolver


def problem(rng: np.random.Generator, sizes: list[int], stiffness: float) -> tuple[list[np.ndarray], np.ndarray]:
    """Factors J of the blocks Jᵀ J, one a component, and data that pull many values out of the box."""
    factors = [rng.normal(size=(n + 2, n)) * 10.0 ** rng.uniform(-stiffness, stiffness, n) for n in sizes]
    return factors, np.concatenate([f @ rng.uniform(-1.0, 2.0, f.shape[1]) for f in factors])


@given(st.integers(0, 2**32 - 1), st.lists(st.integers(1, 9), min_size=1, max_size=5))
def test_it_finds_the_constrained_optimum(seed: int, sizes: list[int]) -> None:
    """Against SciPy's bounded least squares on dense blocks."""
    rng = np.random.default_rng(seed)
    factors, data = problem(rng, sizes, 0.5)
    j = csr_array(block_diag(factors))
    first = np.cumsum([0, *sizes])
    solver = BoxSolver(csr_array(j.T @ j), first)
    found = solver.solve(j.T @ data, rng.random(sum(sizes)), tolerance=1e-11, most_iterations=100_000)
    assert found.converged.all()
    assert found.x.min() >= 0.0 and found.x.max() <= 1.0
    best = lsq_linear(j.toarray(), data, (0.0, 1.0), method="bvls", tol=1e-14)
    energy = 0.5 * np.sum((j @ found.x - data) ** 2)
    assert energy <= best.cost * (1 + 1e-8) + 1e-12


def test_without_active_bounds_it_is_the_linear_solution() -> None:
    """An optimum inside the box is found as by a direct solver."""
    rng = np.random.default_rng(3)
    factor = rng.normal(size=(60, 40))
    truth = rng.uniform(0.2, 0.8, 40)
    a = factor.T @ factor
    found = BoxSolver(csr_array(a), np.array([0, 40])).solve(
        a @ truth, np.full(40, 0.5), tolerance=1e-12, most_iterations=1000
    )
    np.testing.assert_allclose(found.x, truth, atol=1e-9)
    assert not found.held.any()


def test_components_do_not_feel_each_other() -> None:
    """A stiff neighbour in the same call changes no bit of a component's values."""
    rng = np.random.default_rng(5)
    factors, data = problem(rng, [8, 30], 0.2)
    stiff, more = problem(rng, [25], 2.0)
    a = [f.T @ f for f in factors]
    b = np.concatenate([factors[0].T @ data[:10], factors[1].T @ data[10:]])
    alone = BoxSolver(csr_array(block_diag(a)), np.array([0, 8, 38])).solve(b, np.full(38, 0.5))
    with_stiff = BoxSolver(csr_array(block_diag([*a, stiff[0].T @ stiff[0]])), np.array([0, 8, 38, 63])).solve(
        np.concatenate([b, stiff[0].T @ more]), np.full(63, 0.5)
    )
    np.testing.assert_array_equal(with_stiff.x[:38], alone.x)


def test_what_does_not_converge_is_told_apart() -> None:
    """Out of iterations, the easy component is solved and the hard one says it is not."""
    easy, n = np.diag([1.0, 2.0, 3.0]), 400
    chain = csr_array(np.diag(np.full(n, 2.0 + 1e-9)) - np.diag(np.ones(n - 1), 1) - np.diag(np.ones(n - 1), -1))
    matrix = csr_array(block_diag([easy, chain]))
    rhs = np.concatenate([[0.5, 0.5, 0.5], np.eye(n)[0] * 0.9])
    found = BoxSolver(matrix, np.array([0, 3, 3 + n])).solve(rhs, np.zeros(3 + n), most_iterations=50)
    assert found.converged.tolist() == [True, False]
    assert found.residual[0] < 1e-8 < found.residual[1]
    assert found.iterations <= 50


def test_held_values_are_those_that_want_to_leave() -> None:
    """A value that is 1 of its own accord is not held; one that wants 1.5 is."""
    found = BoxSolver(csr_array(np.eye(4)), np.array([0, 1, 2, 3, 4])).solve(
        np.array([1.0, 1.5, -0.5, 0.5]), np.full(4, 0.5)
    )
    np.testing.assert_array_equal(found.x, [1.0, 1.0, 0.0, 0.5])
    assert found.held.tolist() == [False, True, True, False]
