"""Which region a character is in."""

from __future__ import annotations

import dataclasses

import numpy as np
from synthetic import build_regions, chain, row_of_boxes

from bake.region_types import GRID, PointState, RegionGraph, Regions
from bake.regions.boxes import Boxes
from bake.walk.tags import tag_regions


def tags(regions: Regions, positions: list[tuple[float, float, float]], teleports: tuple[int, ...] = ()) -> list[int]:
    """Tags along a way."""
    teleported = np.isin(np.arange(len(positions)), [0, *teleports])
    boxes = Boxes(regions.graph, regions.points)
    return tag_regions(regions.graph, boxes, np.array(positions), teleported)[0].tolist()


def boxes_of(low: list[list[float]], high: list[list[float]]) -> RegionGraph:
    """Boxes linked in a row."""
    return chain(np.array(low, np.float64), np.array(high, np.float64))


def test_it_stays_until_beyond_the_boundary() -> None:
    """In an overlap it changes a little beyond the middle, on the way there and on the way back."""
    regions = build_regions(graph=boxes_of([[0, 0, 0], [3, 0, 0]], [[4, 3, 3], [7, 3, 3]]), invalid=0.0)
    there = [(x, 1.5, 1.5) for x in (1.0, 3.2, 3.45, 3.55, 3.65, 5.0)]
    assert tags(regions, there) == [0, 0, 0, 0, 1, 1]
    assert tags(regions, there[::-1]) == [1, 1, 1, 1, 0, 0]


def test_a_region_inside_another_has_its_own_sides() -> None:
    """Well inside a closet's box it is in the closet, though it is inside the hall's box around that too."""
    low, high = np.array([[0, 0, 0], [4, 0, 4]], float), np.array([[20, 8, 20], [7, 3, 7]], float)
    regions = build_regions(graph=chain(low, high), invalid=0.0)
    assert tags(regions, [(x, 1.5, 5.5) for x in (1.0, 3.9, 4.1, 5.0, 6.0, 6.6, 7.1, 9.0)]) == [0, 0, 0, 1, 1, 1, 0, 0]


def test_after_a_teleport_the_past_does_not_count() -> None:
    """In an overlap it takes the box in which it lies deeper if nothing is known of before."""
    regions = build_regions(graph=boxes_of([[0, 0, 0], [3, 0, 0]], [[5, 3, 3], [6, 3, 3]]), invalid=0.0)
    way = [(1.0, 1.5, 1.5), (3.5, 1.5, 1.5), (4.0, 1.5, 1.5)]
    assert tags(regions, way) == [0, 0, 0]
    assert tags(regions, way, teleports=(2,)) == [0, 0, 1]


def test_linked_neighbours_come_first() -> None:
    """Of two boxes around a point, the one linked with the last region wins over one in which it lies deeper."""
    low, high = np.array([[0, 0, 0], [2, 0, 0], [2, 0, 0]], float), np.array([[2, 3, 3], [6, 3, 3], [4, 3, 3]], float)
    graph = dataclasses.replace(
        chain(low, high),
        link=np.array([[0, 1]], np.int32),
        link_area=np.ones(1),
        link_centre=np.array([[2.0, 1.5, 1.5]]),
    )
    regions = build_regions(graph=graph, invalid=0.0)
    assert tags(regions, [(1.0, 1.5, 1.5), (2.5, 1.5, 1.5)]) == [0, 1]
    assert tags(regions, [(1.0, 1.5, 1.5), (2.5, 1.5, 1.5)], teleports=(1,)) == [0, 2]


def test_a_region_holds_only_what_its_seed_reaches() -> None:
    """Behind a wall in its own box the character is another region's, even while the box still holds it."""
    regions = build_regions(graph=boxes_of([[0, 0, 0], [4, 0, 0]], [[8, 4, 4], [12, 4, 4]]), invalid=0.0)
    state = regions.points.state.reshape(2, GRID, GRID, GRID).copy()
    state[0, 4:] = PointState.UNREACHABLE
    regions = dataclasses.replace(regions, points=dataclasses.replace(regions.points, state=state.ravel()))
    assert tags(regions, [(1.0, 2.0, 2.0), (3.0, 2.0, 2.0), (6.0, 2.0, 2.0), (9.0, 2.0, 2.0)]) == [0, 0, 1, 1]


def test_it_goes_through_links_only() -> None:
    """Where only an unlinked box holds it, the last region counts on for a metre."""
    low, high = np.array([[0, 0, 0], [4, 0, 0]], float), np.array([[4, 3, 3], [8, 3, 3]], float)
    empty = (np.empty((0, 2), np.int32), np.empty(0), np.empty((0, 3)))
    graph = dataclasses.replace(chain(low, high), link=empty[0], link_area=empty[1], link_centre=empty[2])
    regions = build_regions(graph=graph, invalid=0.0)
    assert tags(regions, [(x, 1.5, 1.5) for x in (3.0, 4.5, 4.9, 5.1, 4.5)]) == [0, 0, 0, 1, 1]


def test_outside_of_all_boxes_the_nearest_counts() -> None:
    """Beyond the boxes the character takes the nearest, the last one where two are as near."""
    regions = build_regions(graph=row_of_boxes(2), invalid=0.0)
    way = [(1.0, 1.0, 1.0), (1.0, 5.0, 1.0), (7.0, 5.0, 1.0), (4.0, 9.0, 1.0), (4.0, 9.0, 2.0)]
    boxes = Boxes(regions.graph, regions.points)
    found, inside = tag_regions(regions.graph, boxes, np.array(way), np.array([True, False, False, False, False]))
    assert found.tolist() == [0, 0, 1, 1, 1]
    assert inside.tolist() == [True, False, False, False, False]
