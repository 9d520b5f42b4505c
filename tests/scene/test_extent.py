"""Boxes around points, and points through a matrix."""

from __future__ import annotations

import numpy as np
import pytest

from bake.in_parts import AT_ONCE
from bake.scene.extent import box_of, through_matrix, used_positions
from bake.scene.normals import unit_vectors

SIZES = (1, 255, 256, 257, 1000, AT_ONCE + 1, 3 * AT_ONCE + 2)


@pytest.mark.parametrize("count", SIZES)
def test_boxes_are_least_and_greatest_coordinates(count: int) -> None:
    """However many points there are."""
    points = np.random.default_rng(count).normal(size=(count, 3))
    low, high = box_of(points)
    np.testing.assert_array_equal(low, points.min(axis=0))
    np.testing.assert_array_equal(high, points.max(axis=0))


def test_only_vertices_that_a_face_uses_count() -> None:
    """And where all do, nothing is copied."""
    points = np.arange(12.0).reshape(4, 3)
    faces = np.array([[0, 1, 3]], np.int32)
    np.testing.assert_array_equal(used_positions(points, faces), points[[0, 1, 3]])
    three = points[:3]
    assert used_positions(three, np.array([[2, 0, 1]], np.int32)) is three


@pytest.mark.parametrize("count", SIZES)
def test_points_go_through_a_matrix_as_they_do_one_by_one(count: int) -> None:
    """In parts or not, up to the rounding of one product."""
    random = np.random.default_rng(count)
    points, matrix = random.normal(size=(count, 3)), random.normal(size=(3, 3))
    out = np.empty((count, 3))
    through_matrix(points, matrix, out)
    np.testing.assert_allclose(out, np.einsum("ij,nj->ni", matrix, points), rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("count", SIZES)
def test_unit_vectors_of_a_matrix_are_those_of_the_products(count: int) -> None:
    """With vectors of any length among them, and none."""
    random = np.random.default_rng(count)
    vectors, matrix = random.normal(size=(count, 3)), random.normal(size=(3, 3))
    vectors[0] = 0.0
    made = unit_vectors(vectors, matrix).astype(np.float64)
    products = vectors @ matrix.T
    lengths = np.linalg.norm(products, axis=1, keepdims=True)
    np.testing.assert_allclose(
        made, np.divide(products, lengths, out=np.zeros_like(products), where=lengths > 0.0), atol=1e-7
    )
