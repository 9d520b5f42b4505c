"""Small regions take over a neighbour's model: whose, in what order, and at what cost."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.region_types import GRID, RegionGraph
from bake.regions.absorb import absorb
from bake.regions.empty import OPEN
from bake.regions.evaluate import evaluate
from bake.regions.model_findings import model_findings
from bake.regions.models import fit_and_absorb, refit_regions, regularised_regions
from bake.regions.moments import sum_points
from bake.settings import BakeSettings
from tests.regions.synthetic import build_regions, chain, points_of, random_field
from tests.results.synthetic_results import build_result

SETTINGS = BakeSettings()


def boxes(*widths: float) -> RegionGraph:
    """A row of boxes of the given widths along x, 3 m high and deep."""
    edges = np.cumsum([0.0, *widths])
    low = np.stack([edges[:-1], np.zeros(len(widths)), np.zeros(len(widths))], axis=1)
    return chain(low, low + np.stack([np.array(widths), np.full(len(widths), 3.0), np.full(len(widths), 3.0)], axis=1))


def levels(*values: float, edges: np.ndarray):
    """A field that is constant in each box of a row."""

    def field(positions: np.ndarray) -> np.ndarray:
        sh = np.zeros((len(positions), 9, 2))
        room = np.searchsorted(edges, positions[:, 0], side="right") - 1
        sh[:, 0] = (np.array(values)[np.clip(room, 0, len(values) - 1)] * OPEN)[:, None]
        return sh

    return field


def test_the_like_neighbour_takes_it() -> None:
    """A closet between a dark and a bright hall joins the one whose AO it has, whatever their order."""
    for values, expected in (((0.2, 0.75, 0.8), 2), ((0.2, 0.25, 0.8), 0)):
        graph = boxes(5.0, 0.1, 5.0)
        points = points_of(graph, levels(*values, edges=graph.minimum[:, 0]))
        found = absorb(sum_points(points, graph), graph, 1.0)
        assert found.absorbed == (1,)
        assert found.owner.tolist() == [0, expected, 2]


def test_cost_is_told() -> None:
    """The absorbed region's error grows by what its own model did better; its taker's hardly changes."""
    graph = boxes(5.0, 0.1, 5.0)
    points = points_of(graph, levels(0.2, 0.7, 0.8, edges=graph.minimum[:, 0]))
    fitted = fit_and_absorb(points, graph, SETTINGS)
    regions, _ = regularised_regions(points, graph, fitted, SETTINGS.replaced(region_beta=0.0))
    assert regions.absorbed == (("room 1", "room 2"),)
    assert 0.03 < regions.absorbed_error[0, 0] <= 0.1 + 1e-3
    assert regions.fitted.rmse[2, 0] < 0.02
    np.testing.assert_array_equal(regions.fitted.coefficients[1], regions.fitted.coefficients[2])
    said = [item for item in model_findings(regions, fitted) if item.what == "region-absorbed"]
    assert [item.object for item in said] == ["room 1"]
    assert "room 2" in said[0].detail


def test_chains_grow_until_large_enough() -> None:
    """Slices that are each too small join until they are not, and large neighbours stay what they are."""
    graph = boxes(*[0.05] * 6, 5.0)
    points = points_of(graph, levels(*[0.5] * 6, 0.1, edges=graph.minimum[:, 0]))
    found = absorb(sum_points(points, graph), graph, 1.0)
    owners = found.owner
    volume = np.bincount(owners, np.prod(graph.maximum - graph.minimum, axis=1), 7)
    assert (volume[np.unique(owners)] >= 1.0).all()
    assert (owners[owners] == owners).all()
    assert len(found.absorbed) == 7 - len(np.unique(owners))


def test_without_neighbours_it_stays() -> None:
    """A small region that nothing is linked to keeps its own model, and is told of."""
    graph = boxes(0.1, 5.0)
    graph = dataclasses.replace(
        graph, link=np.zeros((0, 2), np.int32), link_area=np.zeros(0), link_centre=np.zeros((0, 3))
    )
    points = points_of(graph, random_field(1))
    fitted = fit_and_absorb(points, graph, SETTINGS)
    assert fitted.absorption.kept == (0,)
    regions, _ = regularised_regions(points, graph, fitted, SETTINGS)
    assert {item.what for item in model_findings(regions, fitted)} == {"small-region-kept"}


def test_regions_without_points_are_absorbed_too() -> None:
    """Nothing is known of them, so that they join the neighbour with which they share most boundary."""
    graph = boxes(5.0, 0.1, 5.0)
    graph = dataclasses.replace(graph, link_area=np.array([2.0, 9.0]))
    valid = np.repeat([True, False, True], GRID**3)
    points = points_of(graph, random_field(1), valid=valid)
    fitted = fit_and_absorb(points, graph, SETTINGS)
    assert fitted.absorption.owner.tolist() == [0, 2, 2]
    assert np.isnan(fitted.absorbed_error()).all()


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 9), smallest=st.sampled_from([0.0, 1.0, 20.0, 1e6]))
def test_owners_are_consistent(seed: int, count: int, smallest: float) -> None:
    """Every region has an owner that owns itself; with links all along, one is left in the end."""
    widths = np.random.default_rng(seed).uniform(0.05, 4.0, count)
    graph = boxes(*widths)
    found = absorb(sum_points(points_of(graph, random_field(seed)), graph), graph, smallest)
    assert (found.owner[found.owner] == found.owner).all()
    assert sorted(found.absorbed) == np.flatnonzero(found.owner != np.arange(count)).tolist()
    if smallest == 0.0:
        assert not found.absorbed
    if smallest == 1e6:
        assert len(np.unique(found.owner)) == 1


@pytest.mark.parametrize(
    "changes",
    [{"region_beta": 7.0}, {"optimise_centre": True}, {"region_smallest": 100.0}, {"back_face_threshold": 1.0}],
)
def test_refit_equals_a_new_bake(changes: dict[str, object]) -> None:
    """Under other settings of the models, a stored result gives what a bake with these settings would."""
    regions = build_regions(5)
    result = dataclasses.replace(build_result(), settings=SETTINGS, regions=regions)
    wanted = SETTINGS.replaced(**changes)
    again = refit_regions(result, wanted)
    fitted = fit_and_absorb(regions.points, regions.graph, wanted)
    anew, _ = regularised_regions(regions.points, regions.graph, fitted, wanted)
    for name in ("mismatch_before", "mismatch_after", "owner"):
        np.testing.assert_array_equal(getattr(again, name), getattr(anew, name))
    for name in ("coefficients", "centre", "rmse"):
        np.testing.assert_array_equal(getattr(again.regularised, name), getattr(anew.regularised, name))
    p = regions.graph.seed
    assert np.isfinite(evaluate(again.regularised, np.arange(5), p, [0.0, 1.0, 0.0])).all()
