"""The gradient jump across an edge."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from bake.solve.butterflies import Butterflies, find_edges, unfold
from tests.solve.solve_cases import grid
from tests.worlds import icosphere

coordinate = st.floats(-10.0, 10.0).map(lambda x: round(x, 3))
point = st.tuples(coordinate, coordinate, coordinate)


def normals_of(positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit face normals, zero for degenerate faces."""
    a, b, c = np.moveaxis(positions[faces], 1, 0)
    n = np.cross(b - a, c - a)
    return n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-300)


def butterflies(positions: np.ndarray, faces: np.ndarray, *, crease_angle: float = 180.0) -> Butterflies:
    """All butterflies of a mesh."""
    return unfold(positions, faces, find_edges(faces, normals_of(positions, faces), crease_angle))


def apply(wings: Butterflies, values: np.ndarray) -> np.ndarray:
    """G_e f of every butterfly."""
    return (wings.operator * values[wings.stencil]).sum(1)


def gradient(corners: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Gradient of the linear interpolant within the triangle's plane, by solving for it."""
    u, v = corners[1] - corners[0], corners[2] - corners[0]
    basis = np.column_stack([u, v])
    return basis @ np.linalg.solve(basis.T @ basis, values[1:] - values[0])


@given(st.tuples(point, point, point, point), st.tuples(*[st.floats(0, 1)] * 4))
def test_the_operator_is_the_gradient_jump_of_the_unfolded_pair(
    corners: tuple[tuple[float, float, float], ...], values: tuple[float, ...]
) -> None:
    """Against gradients solved in three dimensions, the second face turned into the first one's plane."""
    p, f = np.array(corners), np.array(values)
    left, right = np.array([0, 1, 2]), np.array([1, 0, 3])
    edge = p[1] - p[0]
    length = np.linalg.norm(edge)
    assume(length > 1e-2)
    edge = edge / length
    areas, across, gradients = [], [], []
    for face in (left, right):
        u, v = p[face[1]] - p[face[0]], p[face[2]] - p[face[0]]
        areas.append(0.5 * np.linalg.norm(np.cross(u, v)))
        assume(areas[-1] > 1e-3 * max(np.linalg.norm(u), np.linalg.norm(v), np.linalg.norm(u - v)) ** 2)
        out = p[face[2]] - p[0]
        across.append((out - edge * (out @ edge)) / np.linalg.norm(out - edge * (out @ edge)))
        gradients.append(gradient(p[face], f[face]))
    # unfolding maps the direction away from the edge in one face to the opposite direction in the other
    jump = gradients[0] @ across[0] + gradients[1] @ across[1]
    along = gradients[0] @ edge - gradients[1] @ edge
    wings = butterflies(p, np.array([left, right]))
    assert len(wings.stencil) == 1
    assert set(wings.stencil[0]) == {0, 1, 2, 3}
    scale = np.abs(wings.operator).max()
    assert abs(along) < 1e-6 * scale
    np.testing.assert_allclose(apply(wings, f)[0], sum(areas) * jump, atol=1e-9 * scale, rtol=1e-7)


@given(st.integers(0, 2**32 - 1), st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1))
def test_constants_and_affine_functions_on_flat_meshes_have_no_jump(seed: int, a: float, b: float, c: float) -> None:
    """However irregular the triangles are."""
    positions, faces = grid(4, 4)
    positions[:, :2] += np.random.default_rng(seed).uniform(-0.05, 0.05, (len(positions), 2))
    wings = butterflies(positions, faces)
    assert len(wings.stencil) == 40
    jumps = apply(wings, a + positions @ [b, c, 0.0])
    assert np.abs(jumps).max() < 1e-12 * np.abs(wings.operator).max()


def test_sides_are_the_edges_between_the_corners() -> None:
    """Each of the four named edges joins the unknowns that its name says."""
    positions, faces = icosphere(1)
    edges = find_edges(faces, normals_of(positions, faces), 90.0)
    wings = unfold(positions, faces, edges)
    assert len(wings.stencil) == len(edges.ends) == 120
    a, b, c, d = wings.stencil.T
    for column, ends in zip(wings.sides.T, ((a, c), (b, c), (a, d), (b, d)), strict=True):
        np.testing.assert_array_equal(edges.ends[column], np.sort(np.column_stack(ends), axis=1))
    np.testing.assert_array_equal(edges.ends[wings.hinge], np.sort(np.column_stack([a, b]), axis=1))


def test_creases_boundaries_and_fins_carry_none() -> None:
    """Two walls of a box corner, a lone triangle, and three faces on one edge."""
    p = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1.0, -1, 0]])
    corner = np.array([[0, 1, 2], [1, 0, 3]])
    assert len(butterflies(p, corner, crease_angle=40.0).stencil) == 0
    assert len(butterflies(p, corner, crease_angle=100.0).stencil) == 1
    assert len(butterflies(p, corner[:1]).stencil) == 0
    assert len(butterflies(p, np.array([[0, 1, 2], [1, 0, 4], [1, 0, 3]])).stencil) == 0


def test_duplicate_faces_count_once_and_opposed_ones_apart() -> None:
    """A face stored twice keeps its butterfly; a flipped neighbour on a flat surface loses it."""
    positions, faces = grid(1, 1)
    assert len(butterflies(positions, np.concatenate([faces, faces[:, [1, 2, 0]]])).stencil) == 1
    assert len(butterflies(positions, np.concatenate([faces[:1], faces[1:, ::-1]]), crease_angle=40.0).stencil) == 0


def test_slivers_are_left_out_and_counted() -> None:
    """A face of no height makes no butterfly, and the operator stays finite."""
    p = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1e-9, 0]])
    wings = butterflies(p, np.array([[0, 1, 2], [1, 0, 3]]))
    assert len(wings.stencil) == 0
    assert wings.degenerate == 1
