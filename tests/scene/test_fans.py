"""Edges found by sorting and fans found by walking, against comparing every pair of sides."""

from __future__ import annotations

from collections import defaultdict
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bake.bench.synthetic import comparison_field, write_ply
from bake.scene.edges import EdgeCounts, MeshEdges, count_edges, known_edge_counts
from bake.scene.load import load_scene
from bake.scene.mesh_check import check_mesh
from bake.scene.normals import CreaseSplit, crease_normals
from bake.scene.weld import known_places, places_of, weld_positions
from tests.worlds import icosphere

SOUPS = (
    hnp.arrays(np.float64, (12, 3), elements=st.integers(-1, 1).map(float)),
    hnp.arrays(np.int64, st.tuples(st.integers(0, 24), st.just(3)), elements=st.integers(0, 11)),
)


def _sides_of_edges(welded: np.ndarray) -> dict[tuple[int, int], list[tuple[int, bool]]]:
    """The sides of each edge, in order, and whether each runs upwards."""
    sides: dict[tuple[int, int], list[tuple[int, bool]]] = defaultdict(list)
    for side, (tail, head) in enumerate(zip(welded.ravel(), welded[:, [1, 2, 0]].ravel(), strict=True)):
        sides[min(tail, head), max(tail, head)].append((side, bool(tail < head)))
    return sides


def _plain_groups(welded: np.ndarray, directions: np.ndarray, least_cosine: float) -> np.ndarray:
    """The group of each corner, numbered by their first corners: every pair of sides of an edge is looked at."""
    start = welded.ravel()
    row: list[int] = []
    column: list[int] = []
    for sides in _sides_of_edges(welded).values():
        for (nearer, (one, _)), (farther, (other, _)) in combinations(enumerate(sides), 2):
            if farther - nearer >= 8 or (directions[one // 3] * directions[other // 3]).sum() < least_cosine:
                continue
            next_one, next_other = one + 1 - 3 * (one % 3 == 2), other + 1 - 3 * (other % 3 == 2)
            row += [one, next_one]
            column += [other, next_other] if start[one] == start[other] else [next_other, other]
    graph = coo_array((np.ones(len(row)), (row, column)), shape=(len(start), len(start)))
    return connected_components(graph, directed=False)[1]


def _agrees(positions: np.ndarray, faces: np.ndarray, angle: float) -> CreaseSplit:
    split = crease_normals(positions, faces, angle)
    corners = positions[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1])
    length = np.linalg.norm(across, axis=1, keepdims=True)
    directions = np.divide(across, length, out=np.zeros_like(across), where=length > 0.0)
    group = _plain_groups(weld_positions(positions)[faces], directions, float(np.cos(np.radians(angle))))
    pairs = np.column_stack((faces.ravel(), group))
    unused = np.setdiff1d(np.arange(len(positions)), faces)
    every, number = np.unique(
        np.concatenate((pairs, np.column_stack((unused, np.zeros_like(unused))))), axis=0, return_inverse=True
    )
    np.testing.assert_array_equal(split.source, every[:, 0])
    np.testing.assert_array_equal(split.faces.ravel(), number.ravel()[: faces.size])
    np.testing.assert_array_equal(
        split.place[:, None] == split.place, (positions[split.source][:, None] == positions[split.source]).all(axis=2)
    )
    return split


@given(*SOUPS, st.sampled_from([0.0, 40.0, 90.5, 180.0]))
def test_soups_split_as_comparing_every_pair_says(positions: np.ndarray, faces: np.ndarray, angle: float) -> None:
    """With degenerate faces, edges of many, faces that disagree, and vertices at one place."""
    split = _agrees(positions, faces, angle)
    assert split.edges == count_edges(places_of(positions)[faces])


@pytest.mark.parametrize("kept", [1.0, 0.9])
@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("angle", [5.0, 40.0])
def test_spheres_split_as_comparing_every_pair_says(kept: float, apart: bool, angle: float) -> None:
    """Closed or with holes, with shared vertices or without, smooth or parted at most edges."""
    random = np.random.default_rng(2)
    corners, faces = icosphere(2)
    positions, faces = np.asarray(corners, np.float64) * [1.0, 1.0, 0.3], np.asarray(faces, np.int64)
    faces = faces[random.random(len(faces)) < kept]
    if apart:
        positions, faces = positions[faces.ravel()], np.arange(faces.size).reshape(-1, 3)
    _agrees(positions, faces, angle)


def test_fans_that_touch_at_a_point_stay_apart() -> None:
    """Two cones tip to tip: each goes round at the tip, but neither through all of its corners."""
    ring = np.array([[np.cos(a), np.sin(a), 0.1] for a in np.linspace(0.0, 2.0 * np.pi, 6, endpoint=False)])
    positions = np.concatenate(([[0.0, 0.0, 0.0]], ring, ring * [1.0, 1.0, -1.0]))
    up = np.array([[0, 1 + i, 1 + (i + 1) % 6] for i in range(6)])
    down = np.array([[0, 7 + (i + 1) % 6, 7 + i] for i in range(6)])
    split = _agrees(positions, np.concatenate((up, down)), 40.0)
    assert np.count_nonzero(split.source == 0) == 2


@given(*SOUPS)
def test_odd_edges_are_counted_as_by_hand(positions: np.ndarray, faces: np.ndarray) -> None:
    """Those that end where they begin do not count."""
    welded = weld_positions(positions)[faces]
    inconsistent = non_manifold = 0
    for (low, high), sides in _sides_of_edges(welded).items():
        if low != high:
            inconsistent += len(sides) == 2 and sides[0][1] == sides[1][1]
            non_manifold += len(sides) > 2
    assert count_edges(welded) == EdgeCounts(inconsistent, non_manifold)


def test_sides_of_an_edge_lie_together() -> None:
    """Two triangles that share an edge: one pair, and nobody else is on it."""
    edges = MeshEdges(np.array([[0, 1, 2], [2, 1, 3]]))
    same, alone = edges.neighbours()
    assert edges.side[same].tolist() == [1]
    assert edges.side[same + 1].tolist() == [3]
    assert alone.tolist() == [True]


def test_what_is_told_is_what_would_be_found(tmp_path: Path) -> None:
    """What splitting at creases knows of a mesh's places and edges is what its check would find out."""
    file = tmp_path / "field.ply"
    positions, faces = comparison_field(4)
    write_ply(file, (positions, faces[: len(faces) * 2 // 3]))
    mesh = load_scene(file).meshes[0]
    told, found = known_places(mesh.positions), places_of(mesh.positions)
    assert len(np.unique(np.column_stack((told, found)), axis=0)) == len(np.unique(told)) == len(np.unique(found))
    assert known_edge_counts(mesh.positions, mesh.faces) == count_edges(found[mesh.faces])
    check = check_mesh(mesh)
    assert (check.inconsistent_edges, check.non_manifold_edges) == (0, 0)
