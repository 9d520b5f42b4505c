from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bake.explain.cause_names import CauseKind
from bake.explain.clusters import cluster
from bake.explain.spots import Spots, find_spots
from bake.samples import place_samples
from bake.settings import BakeSettings
from bake.solve import map_to_vertices
from bake.types import BakeResult, Finding, Float64Array, Tally, VertexState, World
from tests.worlds import make_world

SETTINGS = BakeSettings(samples_per_face=(2, 2), distances=(2.0, 300.0))


def floor(cells: int = 20, size: float = 10.0) -> tuple[np.ndarray, np.ndarray]:
    """A square of small triangles facing up."""
    line = np.linspace(-size / 2, size / 2, cells + 1)
    x, z = np.meshgrid(line, line)
    corner = np.arange(cells * (cells + 1)).reshape(cells, cells + 1)[:, :-1].ravel()
    faces = [[corner, corner + cells + 1, corner + 1], [corner + 1, corner + cells + 1, corner + cells + 2]]
    positions = np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, 3)
    return positions, np.concatenate([np.stack(half, axis=1) for half in faces])


def result_of(world: World, ao_at: Float64Array, *, findings: tuple[Finding, ...] = ()) -> BakeResult:
    """A bake whose samples have the AO of their face's first corner, mapped as usual."""
    samples = place_samples(world, SETTINGS)
    corners = world.faces[samples.face]
    ao = np.repeat(ao_at[corners].mean(axis=1)[:, None], 2, axis=1).astype(np.float32)
    tally = replace(Tally.empty(len(samples), 2), ao=ao)
    field = map_to_vertices(world, samples, ao, np.ones(len(samples), bool), SETTINGS)
    return BakeResult(
        Path("/levels/a.glb"), {}, SETTINGS, world, samples, tally, field, (), findings, "cpu", "brute", 0, {}
    )


@pytest.fixture
def dark_patch() -> BakeResult:
    """A light floor with one dark patch of a metre around (2, 0, 1)."""
    world = make_world(floor())
    away = np.linalg.norm(world.positions - [2.0, 0.0, 1.0], axis=1)
    return result_of(world, np.where(away < 0.6, 0.1, 0.9))


def test_the_dark_patch_is_the_gravest_spot(dark_patch: BakeResult) -> None:
    """It is one spot, where it is, with what is usual around."""
    spots = find_spots(dark_patch)
    assert len(spots) >= 1
    assert np.linalg.norm(spots.centre[0] - [2.0, 0.0, 1.0]) < 0.5
    assert spots.value[0] < 0.4
    assert spots.usual[0] > spots.value[0] + 0.3
    assert spots.severity[0] > 0.3
    assert spots.area[0] > 0.2
    assert "dark" in spots.signs_of(0)


def test_an_even_floor_has_no_spots() -> None:
    """Nothing stands out where all is alike, however dark."""
    world = make_world(floor())
    assert len(find_spots(result_of(world, np.full(world.vertex_count, 0.2)))) == 0


def test_spots_are_consistent(dark_patch: BakeResult) -> None:
    """Members are counted, belong to the spot's object, lie within its radius and include its vertex."""
    spots = find_spots(dark_patch, least=0.02)
    assert list(np.diff(spots.first)) == list(spots.vertices)
    for i in range(len(spots)):
        members = spots.members_of(i)
        assert spots.vertex[i] in members
        assert np.linalg.norm(dark_patch.world.positions[members] - spots.centre[i], axis=1).max() <= (
            spots.radius[i] + 1e-9
        )
    everything = np.concatenate([spots.members_of(i) for i in range(len(spots))])
    assert len(np.unique(everything)) == len(everything)


def test_most_bounds_the_list(dark_patch: BakeResult) -> None:
    """The gravest are kept and the rest is counted."""
    every = find_spots(dark_patch, least=0.01)
    first = find_spots(dark_patch, least=0.01, most=1)
    assert len(first) == 1
    assert first.left_out == len(every) - 1
    assert first.vertex[0] == every.vertex[0]


def two_floors(step: float) -> Spots:
    """Two floors side by side, not welded, `step` apart in AO."""
    one, faces = floor(8, 4.0)
    right = np.array([2.0, 0.0, 0.0])
    world = make_world((one - right, faces), (one + 1.000025 * right, faces))
    return find_spots(result_of(world, np.where(world.positions[:, 0] < 0.00001, 0.9, 0.9 - step)))


def test_a_step_at_a_seam_is_seen() -> None:
    """Vertices at one place with unlike values make a spot that is guessed to be a seam; equal ones make none."""
    spots = two_floors(0.4)
    assert "seam" in spots.signs_of(0)
    assert CauseKind.SEAM in spots.guess
    assert len(two_floors(0.0)) == 0


def test_filled_vertices_are_marked(dark_patch: BakeResult) -> None:
    """A filled vertex that is dark is guessed to be starved."""
    field = dark_patch.field
    state = field.state.copy()
    dark = field.ao[:, 0] < 0.5
    state[dark] = VertexState.FILLED
    spots = find_spots(replace(dark_patch, field=replace(field, state=state)))
    assert "filled" in spots.signs_of(0)
    assert spots.guess[0] is CauseKind.STARVED


def test_the_nearest_distance_is_taken(dark_patch: BakeResult) -> None:
    """Without one, the shortest."""
    assert find_spots(dark_patch).distance == 2.0
    assert find_spots(dark_patch, distance=200.0).distance == 300.0


def test_clusters_join_by_faces_and_by_cells() -> None:
    """Neighbours along a face join, so do vertices in one cell of an object; others stay apart."""
    positions = np.array([[0.0, 0, 0], [5, 0, 0], [9, 0, 0], [0.1, 0, 0], [0.15, 0, 0]])
    corners = np.array([[0, 1, 2]])
    owner = np.array([0, 0, 0, 0, 1])
    label = cluster(np.array([True, True, False, True, True]), corners, positions, owner, 2.0)
    assert label[0] == label[1] == label[3]
    assert label[4] != label[0]
    assert label[2] == -1


def test_a_wide_cluster_is_divided() -> None:
    """What spans many reaches becomes several places."""
    positions, faces = floor(40, 40.0)
    owner = np.zeros(len(positions), np.int64)
    label = cluster(np.ones(len(positions), bool), faces, positions, owner, 0.5)
    assert label.max() > 20
    assert widest(positions, label) < 8.0


def widest(positions: np.ndarray, label: np.ndarray) -> float:
    """Greatest extent of a cluster along an axis."""
    return max(np.ptp(positions[label == i], axis=0).max() for i in range(label.max() + 1))
