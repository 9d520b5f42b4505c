"""Blending in space and in time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic import build_regions, chain, row_of_boxes
from walk_fields import constants

from bake.region_types import RegionGraph, Regions
from bake.regions.boxes import Boxes
from bake.walk import Variant, WalkOptions, path_through, simulate
from bake.walk.spatial import SpatialBlend, Weights
from bake.walk.temporal import blend_in_time

HALF_LIVES = st.floats(0.01, 2.0)
RATES = (30.0, 60.0, 144.0)


def weights_at(regions: Regions, points: np.ndarray) -> Weights:
    """Weights at points that lie in or near boxes."""
    boxes = Boxes(regions.graph, regions.points)
    tagged = np.zeros(len(points), np.int32)
    nearest = np.clip(points, regions.graph.minimum.min(axis=0), regions.graph.maximum.max(axis=0))
    return SpatialBlend(regions.graph, boxes).weights(points, nearest, tagged)


def dense(weights: Weights, regions: int) -> np.ndarray:
    """Weights as a matrix, a row a point."""
    rows = np.repeat(np.arange(len(weights.first) - 1), np.diff(weights.first))
    matrix = np.zeros((len(weights.first) - 1, regions))
    matrix[rows, weights.region] = weights.weight
    return matrix


def random_chain(seed: int, count: int) -> RegionGraph:
    """Boxes in a row that overlap, touch or leave a gap, each linked with the next."""
    random = np.random.default_rng(seed)
    low, high = np.zeros((count, 3)), np.zeros((count, 3))
    x = 0.0
    for number in range(count):
        size = random.uniform(1.0, 6.0, 3)
        low[number] = (x, *random.uniform(-0.5, 0.5, 2))
        high[number] = low[number] + size
        x = high[number, 0] + random.choice([0.0, 0.3, -0.05, -0.8])
    return chain(low, high)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 5))
def test_weights_are_continuous_along_a_way_through_links(seed: int, count: int) -> None:
    """Through the middles of boxes and links, a millimetre changes weights by little, and they sum to 1."""
    graph = random_chain(seed, count)
    middle = 0.5 * (graph.minimum + graph.maximum)
    way = np.stack([middle[:-1], graph.link_centre], axis=1).reshape(-1, 3)
    path = path_through(np.concatenate([way, middle[-1:]]))
    distance = np.arange(0.0, path.length, 0.001)
    points = np.stack([np.interp(distance, path.distance, path.points[:, axis]) for axis in range(3)], axis=1)
    regions = build_regions(graph=graph, invalid=0.0)
    matrix = dense(weights_at(regions, points), count)
    assert np.allclose(matrix.sum(axis=1), 1.0)
    assert (matrix >= 0.0).all()
    assert np.abs(np.diff(matrix, axis=0)).max() < 0.05


def test_boxes_that_touch_share_their_face() -> None:
    """On the face between two boxes each counts half, and half a metre from it only one does."""
    regions = build_regions(graph=row_of_boxes(2, size=(4.0, 3.0, 5.0)), invalid=0.0)
    points = np.array([[x, 1.5, 2.5] for x in (3.4, 3.9, 4.0, 4.1, 4.6)])
    first = dense(weights_at(regions, points), 2)[:, 0]
    assert first[[0, 2, 4]] == pytest.approx([1.0, 0.5, 0.0])
    assert first[1] == pytest.approx(1.0 - first[3])


def test_nothing_leaks_through_walls() -> None:
    """Boxes that are not linked never count on the other side, and linked ones only near what they share."""
    graph = row_of_boxes(2)
    alone = RegionGraph(
        graph.names, graph.minimum, graph.maximum, graph.seed, np.empty((0, 2), np.int32), np.empty(0),
        np.empty((0, 3)), "file",
    )  # fmt: skip
    near = np.array([[3.99, 1.5, 2.5], [4.01, 1.5, 2.5]])
    assert dense(weights_at(build_regions(graph=alone, invalid=0.0), near), 2).tolist() == [[1, 0], [0, 1]]
    low, high = np.array([[0, 0, 0], [4, 0, 0]], float), np.array([[4, 3, 9], [8, 3, 2]], float)
    partly = build_regions(graph=chain(low, high), invalid=0.0)
    points = np.array([[3.9, 1.5, 1.0], [3.9, 1.5, 7.0]])
    matrix = dense(weights_at(partly, points), 2)
    assert matrix[0, 1] > 0.2
    assert matrix[1, 1] == 0.0


@settings(max_examples=50, deadline=None)
@given(HALF_LIVES, st.sampled_from(RATES), st.integers(0, 1000))
def test_blending_is_the_recurrence(half_life: float, rate: float, seed: int) -> None:
    """The closed form gives what a runtime computes frame by frame, snapping on the first frame and on teleports."""
    random = np.random.default_rng(seed)
    values, teleported = random.random((200, 3)), random.random(200) < 0.02
    expected = np.empty_like(values)
    for frame in range(200):
        snap = frame == 0 or teleported[frame]
        share = 1.0 if snap else 1.0 - 2.0 ** (-1.0 / rate / half_life)
        before = values[frame] if snap else expected[frame - 1]
        expected[frame] = before + (values[frame] - before) * share
    found = blend_in_time(values, teleported, frame_time=1.0 / rate, half_life=half_life)
    assert np.allclose(found, expected, atol=1e-12)


def test_no_half_life_blends_nothing() -> None:
    """Half-life 0 gives the values back."""
    values = np.random.default_rng(1).random((5, 2))
    assert blend_in_time(values, np.zeros(5, bool), frame_time=0.1, half_life=0.0) is values


def test_half_of_a_jump_is_left_after_a_half_life() -> None:
    """At any frame rate, however long the walk."""
    for rate in RATES:
        values = np.ones((round(2000 * rate), 1))
        values[0] = 0.0
        found = blend_in_time(values, np.zeros(len(values), bool), frame_time=1.0 / rate, half_life=0.5)
        assert found[round(0.5 * rate), 0] == pytest.approx(0.5)
        assert found[-1, 0] == pytest.approx(1.0)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.05, 0.6), st.lists(st.floats(0.1, 0.9), min_size=3, max_size=3))
def test_walks_of_all_frame_rates_agree(half_life: float, values: list[float]) -> None:
    """At the times that 30, 60 and 144 Hz share, constant regions give the same AO in every variant within 1e-6."""
    # 6 Hz is common to all; each boundary is crossed just after such a time.
    graph = row_of_boxes(3, size=(2.0 + 1e-9, 3.0, 5.0), at=0.0)
    regions = constants(graph, values)
    path = path_through([[0.5, 1.0, 2.0], [5.5, 1.0, 2.0]])
    found = {}
    for rate in RATES:
        walk = simulate(regions, path, WalkOptions(speed=1.5, frame_rate=rate, half_life=half_life))
        found[rate] = {variant: ao[:: round(rate / 6.0)] for variant, ao in walk.ao.items()}
    for variant in (Variant.RAW, Variant.REGULARISED, Variant.BLENDED, Variant.SPATIAL):
        for rate in (60.0, 144.0):
            assert np.abs(found[rate][variant] - found[30.0][variant]).max() < 1e-6
