"""Where characters cross from region to region, and how far models may be apart there."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.region_types import GRID, PARAMETERS, PointState, RegionGraph, RegionModels
from bake.regions.boxes import Boxes
from bake.regions.crossings import MARGIN, MOST, Crossings, find_crossings
from bake.regions.evaluate import AXIS_NORMALS, evaluate
from bake.regions.fit import fit_regions, with_errors
from bake.regions.moments import sum_points
from bake.regions.regularise import LARGEST_SLOPE, LARGEST_STEP, regularise
from bake.settings import BakeSettings
from bake.spherical_harmonics import Y0
from tests.regions.synthetic import build_regions, chain, points_of, random_field


def steps_at(models: RegionModels, graph: RegionGraph, places: Crossings) -> np.ndarray:
    """How far the models of each link are apart at its places, about the worst of six normals, at any distance."""
    link, number = np.nonzero(places.counts)
    position = places.position[link, number]
    worst = np.zeros(len(link))
    for normal in AXIS_NORMALS:
        a, b = (evaluate(models, graph.link[link, side], position, normal, clamp=False) for side in (0, 1))
        worst = np.maximum(worst, np.abs(a - b).max(axis=1))
    return worst


def constant(value: float, graph: RegionGraph) -> np.ndarray:
    """Harmonics of a constant AO at every grid point of a graph."""
    sh = np.zeros((len(graph) * GRID**3, 9, 2))
    sh[:, 0] = value / Y0
    return sh


def test_boxes_that_touch_are_crossed_on_their_face() -> None:
    """All places lie on the face that two boxes share, spread over it to its corners."""
    graph = chain(np.array([[0.0, 0, 0], [4.0, 0, 0]]), np.array([[4.0, 3, 6], [8.0, 3, 6]]))
    found = find_crossings(graph, points_of(graph, random_field(1)))
    places = found.position[0, found.counts[0]]
    assert 10 <= len(places) <= MOST
    np.testing.assert_allclose(places[0], graph.link_centre[0])
    np.testing.assert_allclose(places[:, 0], 4.0)
    assert (places[:, 1:].max(axis=0) > [2.6, 5.2]).all()
    assert (places[:, 1:].min(axis=0) < [0.4, 0.8]).all()


def test_boxes_that_overlap_are_crossed_where_the_tags_change() -> None:
    """Of a wide overlap those places count where neither box holds a character better by more than the margin."""
    graph = chain(np.array([[0.0, 0, 0], [6.0, 0, 0]]), np.array([[10.0, 9, 9], [16.0, 9, 9]]))
    found = find_crossings(graph, points_of(graph, random_field(1)))
    places = found.position[0, found.counts[0]][1:]
    boxes = Boxes(graph, points_of(graph, random_field(1)))
    apart = np.abs(boxes.held_depth(np.int64(0), places) - boxes.held_depth(np.int64(1), places))
    assert len(places)
    assert (apart <= MARGIN + 0.15).all()


def test_what_one_region_does_not_reach_is_not_crossed() -> None:
    """Behind a wall, in half of the face, nobody crosses; where nobody can at all, the middle stays."""
    graph = chain(np.array([[0.0, 0, 0], [4.0, 0, 0]]), np.array([[4.0, 3, 8], [8.0, 3, 8]]))
    z = np.arange(GRID)
    free = np.broadcast_to(z < GRID // 2, (2, GRID, GRID, GRID)).ravel()
    found = find_crossings(graph, points_of(graph, random_field(1), valid=free))
    assert found.position[0, found.counts[0]][1:, 2].max() <= 5.0
    points = points_of(graph, random_field(1))
    closed = dataclasses.replace(points, state=np.full(len(points.state), PointState.UNREACHABLE, np.uint8))
    found = find_crossings(graph, closed)
    assert found.counts.sum() == 1
    np.testing.assert_array_equal(found.position[0], np.repeat(graph.link_centre, MOST, axis=0))


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), share=st.sampled_from([0.1, 0.5, 1.0]))
def test_places_lie_in_what_boxes_share(seed: int, share: float) -> None:
    """Wherever two boxes lie, gaps between them included, places are finite and in what they share."""
    random = np.random.default_rng(seed)
    low = random.uniform(-3.0, 3.0, (2, 3))
    high = low + random.uniform(0.2, 6.0, (2, 3))
    graph = chain(low, high)
    points = points_of(graph, random_field(1), valid=random.random(2 * GRID**3) < share)
    found = find_crossings(graph, points)
    ends = np.stack([low.max(axis=0), high.min(axis=0)])
    places = found.position[0, 1:][found.counts[0, 1:]]
    assert found.counts[0, 0]
    assert np.isfinite(found.position).all()
    assert (places >= ends.min(axis=0) - 1e-9).all()
    assert (places <= ends.max(axis=0) + 1e-9).all()


def rooms(values: list[float], *, size: float = 12.0) -> RegionGraph:
    """Rooms in a row that overlap by a metre; the last opening is tiny beside the others."""
    count = len(values)
    low = np.stack([np.arange(count) * (size - 1.0), np.zeros(count), np.zeros(count)], axis=1)
    graph = chain(low, low + np.array([size, 3.0, size]))
    area = np.full(count - 1, 30.0)
    area[-1] = 0.05
    return dataclasses.replace(graph, link_area=area)


def test_no_step_is_larger_than_the_bound() -> None:
    """Rooms of very different AO agree to the bound all over their boundaries, behind a tiny opening too."""
    values = [0.9, 0.8, 0.7, 0.1]
    graph = rooms(values)
    sh = np.concatenate([constant(v, rooms([v] * 2))[: GRID**3] for v in values])
    points = dataclasses.replace(points_of(graph, random_field(1)), sh=sh.astype(np.float32))
    moments, places = sum_points(points, graph), find_crossings(graph, points)
    fitted = fit_regions(points, graph, BakeSettings(), moments=moments)
    gentle, bounded = (
        regularise(fitted, graph, beta=0.1, sweeps=200, moments=moments, crossings=places, largest_step=step).models
        for step in (np.inf, LARGEST_STEP)
    )
    assert steps_at(gentle, graph, places).max() > 0.3
    assert steps_at(bounded, graph, places).max() < 1.1 * LARGEST_STEP
    slope = np.abs(bounded.coefficients[:, 1:, 0] * Y0).max()
    assert slope < 1.15 * LARGEST_SLOPE


def test_changes_go_where_nothing_is_valid() -> None:
    """With the sums over valid points, the same agreement costs less error at those points than without."""
    graph = rooms([0.5] * 4)
    random = np.random.default_rng(3)
    low = np.broadcast_to(np.arange(GRID)[None, None, :, None] < 3, (4, GRID, GRID, GRID)).ravel()
    points = points_of(graph, random_field(5), valid=low & (random.random(4 * GRID**3) < 0.9))
    moments, places = sum_points(points, graph), find_crossings(graph, points)
    fitted = fit_regions(points, graph, BakeSettings(), moments=moments)
    errors: list[float] = []
    for sums in (None, moments):
        made = regularise(fitted, graph, beta=100.0, sweeps=300, moments=sums, crossings=places).models
        errors.append(float(with_errors(made, moments).rmse.mean()))
        assert steps_at(made, graph, places).max() < 1.1 * LARGEST_STEP
    assert errors[1] < errors[0]


def test_large_beta_makes_neighbours_agree_wherever_they_meet() -> None:
    """As β grows, models agree at all places, not only at the middle of each boundary."""
    regions = build_regions(5)
    places = find_crossings(regions.graph, regions.points)
    worst = [
        steps_at(regularise(regions.fitted, regions.graph, beta=beta, sweeps=500, crossings=places).models,
                 regions.graph, places).max()
        for beta in (0.1, 1e2, 1e5)
    ]  # fmt: skip
    assert worst[0] > worst[1] > worst[2]
    assert worst[2] < 1e-3


@pytest.mark.parametrize("value", [0.02, 0.6])
def test_dark_levels_have_a_smaller_bound(value: float) -> None:
    """Where AO is low at a distance, the largest step shrinks with it."""
    graph = rooms([value] * 3)
    sh = np.concatenate([constant(v, rooms([v] * 2))[: GRID**3] for v in (0.2 * value, value, 1.8 * value)])
    points = dataclasses.replace(points_of(graph, random_field(1)), sh=sh.astype(np.float32))
    places = find_crossings(graph, points)
    fitted = fit_regions(points, graph, BakeSettings())
    made = regularise(fitted, graph, beta=1e-3, sweeps=200, crossings=places).models
    assert steps_at(made, graph, places).max() < 1.1 * min(LARGEST_STEP, 0.4 * value)
    assert made.coefficients.shape[1] == PARAMETERS
