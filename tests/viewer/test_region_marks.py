"""Regions as marks, and the numbers that colour them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from synthetic_regions import row_of_regions

from bake.region_types import GRID, PointState
from viewer.region_marks import (
    DROPPED_COLOR,
    PENDING_COLOR,
    SELECTED_COLOR,
    UNREACHABLE_COLOR,
    VALID_COLOR,
    box_faces,
    box_lines,
    grid_points,
    highlighted,
    link_bars,
    model_centres,
    region_at,
    state_swatches,
)
from viewer.region_values import (
    NONE_COLOR,
    link_scale,
    region_colors,
    region_scale,
    region_values,
    term_counts,
    valid_counts,
    worst_mismatch,
)
from viewer.region_view import PointSet, RegionColor, RegionView


@pytest.mark.parametrize("color", list(RegionColor))
def test_every_colouring_has_a_colour_a_region_and_a_scale(color: RegionColor) -> None:
    """Whatever colours the boxes, each box gets one, and the legend has a title and finite ends."""
    regions = row_of_regions(5)
    memory = np.full(5, 336)
    colors = region_colors(regions, RegionView(), color, memory)
    scale = region_scale(regions, RegionView(), color, memory, "2 m")
    assert colors.shape == (5, 3)
    assert scale.title
    assert scale.low < scale.high
    assert (scale.color_map is None) == (color is RegionColor.CENTRE)


def test_worst_mismatch_is_that_of_the_worst_link() -> None:
    """A region's mismatch is the larger of its two boundaries'."""
    regions = row_of_regions(3)
    before = regions.mismatch_before[:, 1]
    worst = worst_mismatch(regions, RegionView(as_fitted=True, column=1))
    assert worst == pytest.approx([before[0], before.max(), before[1]])


def test_region_without_neighbour_has_no_mismatch() -> None:
    """A lone region is drawn in a colour of its own and the legend says why."""
    regions = row_of_regions(1)
    colors = region_colors(regions, RegionView(), RegionColor.MISMATCH, np.zeros(1))
    scale = region_scale(regions, RegionView(), RegionColor.MISMATCH, np.zeros(1), "2 m")
    assert tuple(colors[0]) == NONE_COLOR
    assert scale.swatches == ((NONE_COLOR, "no neighbour"),)


def test_scale_does_not_move_with_regularisation() -> None:
    """Before and after share a range, so that colours can be compared."""
    regions = row_of_regions(6)
    scales = [link_scale(regions, RegionView(as_fitted=on), 2.0) for on in (True, False)]
    before, after = regions.mismatch_before[:, 0], regions.mismatch_after[:, 0]
    assert scales[0].high == scales[1].high == pytest.approx(max(np.quantile(before, 0.75), after.max()))
    assert ("up to" in scales[0].note) == (before.max() > scales[0].high)
    assert "up to" not in scales[1].note


def test_counts_of_points_and_terms() -> None:
    """Valid points exclude unreachable and dropped ones; terms are counted from their bits."""
    regions = row_of_regions(2)
    unreachable = len(range(0, GRID**3, 7))
    assert valid_counts(regions).tolist() == [GRID**3 - unreachable - 1] * 2
    terms = np.array([0b1111111, 0b0000101], np.uint8)
    models = dataclasses.replace(regions.fitted, terms=terms)
    assert term_counts(models).tolist() == [7, 2]
    share = region_values(regions, RegionView(), RegionColor.VALID, np.zeros(2))
    assert share == pytest.approx(100.0 * valid_counts(regions) / GRID**3)


def test_boxes_enclose_their_regions() -> None:
    """Drawn corners span exactly the region's box."""
    regions = row_of_regions(3)
    corners, edges, colors = box_lines(regions, np.zeros((3, 3), np.uint8))
    assert corners.reshape(3, 8, 3).min(axis=1) == pytest.approx(regions.graph.minimum)
    assert corners.reshape(3, 8, 3).max(axis=1) == pytest.approx(regions.graph.maximum)
    assert edges.shape == (36, 2)
    assert len(colors) == 24
    _, sides, tint = box_faces(regions, np.array([1]))
    assert sides.shape == (6, 4)
    assert tuple(tint[0]) == SELECTED_COLOR


def test_links_run_through_the_middle_of_their_boundary() -> None:
    """Bars begin and end at the regions' middles; the selected one stands out."""
    regions = row_of_regions(3)
    positions, cells, colors = link_bars(regions, RegionView(link=1))
    assert np.isfinite(positions).all()
    assert cells.max() == len(positions) - 1
    middles = positions[:32].reshape(4, 2, 4, 3).mean(axis=2)
    assert middles[0, 1] == pytest.approx(regions.graph.link_centre[0])
    assert middles[3, 1] == pytest.approx(regions.graph.seed[2])
    assert (colors == SELECTED_COLOR).all(axis=1).sum() == 2 * 8 + 6


def test_points_are_coloured_by_state() -> None:
    """Valid, unreachable, dropped and pending points each have their colour, and the legend counts them."""
    regions = row_of_regions(2)
    pending = np.zeros(2 * GRID**3, bool)
    pending[GRID**3] = True
    view = RegionView(points=PointSet.SELECTED, region=1)
    points = grid_points(regions, view, pending)
    assert points is not None
    assert points.total == GRID**3
    assert tuple(points.colors[0]) == PENDING_COLOR
    assert tuple(points.colors[7]) == UNREACHABLE_COLOR
    assert tuple(points.colors[3]) == DROPPED_COLOR
    assert tuple(points.colors[1]) == VALID_COLOR
    counts = [int(word.split(" ")[0]) for _, word in state_swatches(regions, view, pending)]
    assert sum(counts) == GRID**3
    assert regions.points.state[GRID**3] == PointState.UNREACHABLE


def test_nothing_is_built_for_a_view_that_asks_for_nothing() -> None:
    """The default view draws nothing."""
    regions = row_of_regions(2)
    assert RegionView().draws_nothing
    assert grid_points(regions, RegionView()) is None
    assert grid_points(regions, RegionView(points=PointSet.SELECTED)) is None
    assert not len(highlighted(regions, RegionView()))
    assert not len(highlighted(regions, RegionView(region=99, link=99)))


def test_boundary_highlights_both_regions() -> None:
    """A selected boundary highlights the two regions that it joins, whatever region was selected before."""
    regions = row_of_regions(4)
    assert highlighted(regions, RegionView(region=0, link=2)).tolist() == [2, 3]


def test_centres_have_a_diamond_each() -> None:
    """One diamond a model, around its centre."""
    regions = row_of_regions(3)
    positions, cells, _ = model_centres(regions, RegionView())
    assert positions.reshape(3, 6, 3).mean(axis=1) == pytest.approx(regions.fitted.centre)
    assert cells.shape == (24, 3)


def test_smallest_of_overlapping_regions_is_found() -> None:
    """A point in two boxes belongs to the smaller one; outside there is none."""
    regions = row_of_regions(2)
    low = regions.graph.minimum.copy()
    low[1] = (-1.0, -1.0, -1.0)
    graph = dataclasses.replace(regions.graph, minimum=low)
    regions = dataclasses.replace(regions, graph=graph)
    assert region_at(regions, np.array([0.5, 0.5, 0.5])) == 0
    assert region_at(regions, np.array([3.5, 0.5, 0.5])) == 1
    assert region_at(regions, np.array([9.0, 0.5, 0.5])) == -1
