from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bake.errors import SceneError
from bake.scene.polygons import triangulate_polygons


def normals(corners: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Twice the area vectors of triangles."""
    points = corners[triangles]
    return np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])


@given(st.lists(st.floats(0.2, 1.0), min_size=3, max_size=24), st.integers(0, 2), st.booleans())
def test_star_shaped_polygons_keep_area_and_winding(radii: list[float], axis: int, reverse: bool) -> None:
    """Whatever the dents, all triangles look the polygon's way and cover exactly its area."""
    angles = np.arange(len(radii)) * 2 * np.pi / len(radii)
    flat = np.array(radii)[:, None] * np.column_stack((np.cos(angles), np.sin(angles)))
    flat = flat[::-1] if reverse else flat
    corners = np.roll(np.column_stack((flat, np.zeros(len(flat)))), axis, axis=1)
    triangles, owner = triangulate_polygons(corners, np.array([len(radii)]))
    x, y = flat.T
    area = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum()
    found = normals(corners, triangles)[:, (2 + axis) % 3] * np.sign(area)
    assert len(triangles) == len(radii) - 2
    assert (owner == 0).all()
    assert found.sum() == pytest.approx(abs(area))
    assert (found > -1e-9).all()


def test_concave_quad_is_cut_along_its_dent() -> None:
    """An arrowhead is cut from its dent, not across it, wherever the dent is stored."""
    arrow = np.array([[0, 0, 0], [2, 0, 0], [0.5, 0.5, 0], [0, 2, 0]], float)
    for shift in range(4):
        corners = np.roll(arrow, shift, axis=0)
        triangles, _ = triangulate_polygons(corners, np.array([4]))
        assert (normals(corners, triangles)[:, 2] > 0).all()


def test_polygon_with_a_hole() -> None:
    """A square whose hole is reached by a cut keeps its hole."""
    outer, inner = [(0, 0), (4, 0), (4, 4), (0, 4)], [(1, 1), (1, 3), (3, 3), (3, 1)]
    flat = np.array([*outer, outer[0], *inner, inner[0]], float)
    corners = np.column_stack((flat, np.zeros(len(flat))))
    found = normals(corners, triangulate_polygons(corners, np.array([len(flat)]))[0])[:, 2] / 2
    assert found.sum() == pytest.approx(12.0)
    assert (found >= 0).all()


def test_polygons_of_all_sizes_keep_their_order() -> None:
    """Triangles come in the order of their polygons, and those without area or corners give what they can."""
    counts = np.array([4, 0, 3, 2, 5, 1, 3])
    corners = np.random.default_rng(3).random((counts.sum(), 3))
    triangles, owner = triangulate_polygons(corners, counts)
    np.testing.assert_array_equal(owner, [0, 0, 2, 4, 4, 4, 6])
    first = np.cumsum(counts) - counts
    assert ((triangles >= first[owner, None]) & (triangles < (first + counts)[owner, None])).all()


def test_no_polygons() -> None:
    """Nothing in, nothing out."""
    triangles, owner = triangulate_polygons(np.zeros((0, 3)), np.zeros(0, np.int64))
    assert triangles.shape == (0, 3)
    assert len(owner) == 0


def test_huge_concave_polygon_is_refused() -> None:
    """A concave polygon of thousands of corners is refused instead of taking for ever; a convex one is not."""
    angles = np.linspace(0, 2 * np.pi, 5000, endpoint=False)
    circle = np.column_stack((np.cos(angles), np.sin(angles), 0 * angles))
    assert len(triangulate_polygons(circle, np.array([5000]))[0]) == 4998
    circle[7] *= 0.5
    with pytest.raises(SceneError, match="5000 corners"):
        triangulate_polygons(circle, np.array([5000]))


def test_crossing_polygon_still_gives_all_triangles() -> None:
    """A polygon that crosses itself has no right answer, but the count stays."""
    corners = np.array([[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0], [0.5, -1, 0]], float)
    assert len(triangulate_polygons(corners, np.array([5]))[0]) == 3
