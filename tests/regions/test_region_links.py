"""Links: which boxes meet, and how much of their boundary is open."""

from __future__ import annotations

import numpy as np
import pytest
from block_levels import TWO_ROOMS, WALLED_OFF, Block, free_space
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.regions.boundaries import Openings, measure_openings
from bake.regions.links import boundary_sections, meeting_pairs
from bake.regions.validity import reachable

LEFT: Block = ((-5.1, 0.0, -2.0), (-0.1, 3.0, 2.0))
RIGHT: Block = ((0.1, 0.0, -2.0), (5.1, 3.0, 2.0))


def measured(blocks: tuple[Block, ...], *boxes: Block) -> tuple[np.ndarray, Openings]:
    """Pairs of boxes in a level, and what is open between them."""
    low, high = np.array([b[0] for b in boxes]), np.array([b[1] for b in boxes])
    with free_space(blocks) as free:
        reach = reachable(low, high, np.full_like(low, np.nan), free, down=np.array([0.0, -1.0, 0.0]))
        pairs = meeting_pairs(low, high)
        return pairs, measure_openings(low, high, reach.valid, reach.seed, pairs, free)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 40), tolerance=st.sampled_from([0.0, 0.5]))
def test_sweep_finds_what_comparing_all_does(seed: int, count: int, tolerance: float) -> None:
    """The sweep gives exactly the pairs that share two axes and miss the third by the tolerance at most."""
    random = np.random.default_rng(seed)
    low = random.integers(0, 12, (count, 3)) * 0.5
    high = low + random.integers(1, 6, (count, 3)) * 0.5
    expected = []
    for a in range(count):
        for b in range(a + 1, count):
            shared = np.minimum(high[a], high[b]) - np.maximum(low[a], low[b])
            if (shared >= -tolerance).all() and (shared > 0).sum() >= 2:
                expected.append([a, b])
    assert meeting_pairs(low, high, tolerance=tolerance).tolist() == expected


def test_two_thousand_boxes() -> None:
    """A field of 2,000 boxes side by side has exactly the pairs that share a face."""
    i, j = np.meshgrid(np.arange(50), np.arange(40), indexing="ij")
    low = np.stack([12.0 * i.ravel(), np.zeros(2000), 12.0 * j.ravel()], axis=1)
    pairs = meeting_pairs(low, low + np.array([12.0, 3.0, 12.0]))
    assert len(pairs) == 49 * 40 + 50 * 39
    sections = boundary_sections(low, low + np.array([12.0, 3.0, 12.0]), pairs)
    np.testing.assert_allclose((sections.maximum - sections.minimum).max(axis=1), 12.0)
    assert set(sections.axis.tolist()) == {0, 2}


def test_boxes_in_the_open() -> None:
    """Where nothing is in the way, area and centre are those of the shared face, or of the middle of an overlap."""
    ground: Block = ((-50.0, -1.0, -50.0), (50.0, 0.0, 50.0))
    pairs, openings = measured(
        (ground,),
        ((0.0, 0.0, 0.0), (4.0, 3.0, 4.0)),
        ((4.0, 0.0, 1.0), (8.0, 3.0, 3.0)),
        ((7.0, 0.0, 0.0), (12.0, 3.0, 5.0)),
    )
    assert pairs.tolist() == [[0, 1], [1, 2]]
    np.testing.assert_allclose(openings.area, [6.0, 6.0])
    np.testing.assert_allclose(openings.centre[:, 0], [4.0, 7.5])
    np.testing.assert_allclose(openings.centre[:, 1:], [[1.5, 2.0]] * 2, atol=0.3)


def test_a_doorway() -> None:
    """Two rooms are linked through the thickness of the wall, with about the doorway's area, in the doorway."""
    pairs, openings = measured(TWO_ROOMS, LEFT, RIGHT)
    assert pairs.tolist() == [[0, 1]]
    assert openings.area[0] == pytest.approx(1.2 * 2.2, rel=0.35)
    assert abs(openings.centre[0, 0]) < 0.01
    assert abs(openings.centre[0, 2]) < 0.6
    assert 0.0 < openings.centre[0, 1] < 2.2


@pytest.mark.parametrize("reach", [0.0, 0.3, 1.5])
def test_no_link_through_a_wall(reach: float) -> None:
    """Boxes that end at a wall, or reach through it, are not linked where the wall has no doorway."""
    left, right = (LEFT[0], (-0.1 + reach, 3.0, 2.0)), ((0.1 - reach, 0.0, -2.0), RIGHT[1])
    pairs, openings = measured(WALLED_OFF, left, right)
    assert pairs.tolist() == [[0, 1]]
    assert openings.area[0] == 0.0
    assert np.isnan(openings.centre).all()


@pytest.mark.parametrize("reach", [0.3, 1.5])
def test_conservative_boxes_meet_in_the_doorway(reach: float) -> None:
    """Boxes that reach through the wall are linked where it is open."""
    left, right = (LEFT[0], (-0.1 + reach, 3.0, 2.0)), ((0.1 - reach, 0.0, -2.0), RIGHT[1])
    _, openings = measured(TWO_ROOMS, left, right)
    assert openings.area[0] > 0.5
    assert abs(openings.centre[0, 2]) < 1.0


def test_a_room_inside_a_larger_region() -> None:
    """A region that holds another one's box is linked with it at the openings of the inner box."""
    closed_on_three_sides: tuple[Block, ...] = (
        ((-20.0, -0.2, -20.0), (20.0, 0.0, 20.0)),
        ((-2.2, 0.0, -2.2), (2.2, 3.0, -2.0)),
        ((-2.2, 0.0, 2.0), (2.2, 3.0, 2.2)),
        ((-2.2, 0.0, -2.0), (-2.0, 3.0, 2.0)),
        ((-2.2, 3.0, -2.2), (2.2, 3.2, 2.2)),
    )
    pairs, openings = measured(
        closed_on_three_sides, ((-2.0, 0.0, -2.0), (2.2, 3.0, 2.0)), ((-12.0, 0.0, -12.0), (12.0, 8.0, 12.0))
    )
    assert pairs.tolist() == [[0, 1]]
    assert openings.area[0] == pytest.approx(12.0, rel=0.15)
    np.testing.assert_allclose(openings.centre[0], [2.2, 1.5, 0.0], atol=0.5)
