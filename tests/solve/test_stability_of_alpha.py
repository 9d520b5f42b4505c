"""Components that conjugate gradients give up are solved all the same."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

from bake.solve.butterflies import find_edges
from bake.solve.conjugate_gradient import BoxSolver
from bake.solve.direct import finished


def stiff(size: int, alpha: float, seed: int) -> tuple[csr_array, np.ndarray]:
    """Two chains of `size` unknowns: mass plus alpha times squared second differences."""
    rng = np.random.default_rng(seed)
    bend = np.zeros((size - 2, size))
    for i in range(size - 2):
        bend[i, i : i + 3] = (1.0, -2.0, 1.0)
    own = np.diag(rng.uniform(0.5, 2.0, size)) + alpha * bend.T @ bend
    whole = np.zeros((2 * size, 2 * size))
    whole[:size, :size] = whole[size:, size:] = own
    return csr_array(whole), whole @ rng.uniform(-0.4, 1.4, 2 * size)


@settings(max_examples=30)
@given(st.integers(4, 60), st.floats(0.0, 6.0), st.integers(0, 1000))
def test_what_the_iteration_gives_up_is_optimal_in_the_end(size: int, power: float, seed: int) -> None:
    """Values in bounds, no slope where they are free, and the slope outward where they are held."""
    matrix, rhs = stiff(size, 10.0**power, seed)
    diagonal = matrix.diagonal()
    solver = BoxSolver(matrix.copy(), np.array([0, size, 2 * size]))
    start = np.full(2 * size, 0.5)
    solution = finished(solver, rhs, solver.solve(rhs, start, tolerance=1e-12, most_iterations=3))
    assert solution.converged.all()
    assert solution.residual.max() < 1e-8
    x, slope = solution.x, (matrix @ solution.x - rhs) / diagonal
    assert x.min() >= 0.0 and x.max() <= 1.0
    assert np.abs(slope[(x > 0) & (x < 1)]).max(initial=0.0) < 1e-8
    assert slope[x <= 0].min(initial=0.0) > -1e-8 and slope[x >= 1].max(initial=0.0) < 1e-8


def test_what_converged_is_left_alone() -> None:
    """The very same solution comes back."""
    matrix, rhs = stiff(6, 1.0, 1)
    solver = BoxSolver(matrix, np.array([0, 6, 12]))
    solution = solver.solve(rhs, np.full(12, 0.5), tolerance=1e-6)
    assert solution.converged.all() and finished(solver, rhs, solution) is solution


def test_faces_without_area_part_nobody() -> None:
    """A face of two points on the diagonal of a square leaves the pair of faces beside it a pair."""
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 2, 0], [2, 0, 4]])
    normals = np.array([[0.0, 0.0, 1.0]] * 2 + [[0.0, 0.0, 0.0]] * 2)
    assert len(find_edges(faces[:2], normals[:2], 40.0).wings) == 1
    with_dirt = find_edges(faces, normals, 40.0)
    assert len(with_dirt.wings) == 1
    assert sorted(with_dirt.wings[0] // 3) == pytest.approx([0, 1])
