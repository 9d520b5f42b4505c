"""Blend, remap curve and the game's 5 bits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewer.tone import RemapCurve, blend, dither_thresholds, quantise

shares = st.floats(0.0, 1.0, width=32)


def test_blend_takes_the_longest_and_the_shortest_distance() -> None:
    """97 % of the longest and 3 % of the shortest, whatever their order, and nothing of those between."""
    ao = np.array([[0.5, 0.1, 0.9]], np.float32)
    assert blend(ao, (20.0, 2.0, 300.0))[0] == pytest.approx(0.03 * 0.1 + 0.97 * 0.9, abs=1e-6)
    assert blend(ao, (300.0, 20.0, 2.0), short_share=0.25)[0] == pytest.approx(0.25 * 0.9 + 0.75 * 0.5, abs=1e-6)


def test_blend_of_one_distance_is_that_distance() -> None:
    """A single column is shown as it is."""
    ao = np.array([[0.25], [np.nan]], np.float32)
    np.testing.assert_array_equal(blend(ao, (2.0,)), ao[:, 0])


@given(st.lists(shares, min_size=1, max_size=20))
def test_straight_curve_changes_nothing(values: list[float]) -> None:
    """The default curve is the identity, bit for bit."""
    array = np.array(values, np.float32)
    np.testing.assert_array_equal(RemapCurve()(array), array)


@given(shares, st.floats(0.2, 5.0))
def test_curve_stays_within_bounds_and_order(middle: float, exponent: float) -> None:
    """A rising curve keeps values in [0, 1] and in order."""
    curve = RemapCurve(((0.0, 0.0), (0.5, middle), (1.0, 1.0)), exponent)
    shown = curve(np.linspace(0.0, 1.0, 50, dtype=np.float32))
    assert shown.min() >= 0.0
    assert shown.max() <= 1.0
    assert np.all(np.diff(shown) >= -1e-6)


def test_curve_passes_through_its_points() -> None:
    """A point of the curve is met exactly; the exponent comes after it; missing stays missing."""
    curve = RemapCurve(((0.0, 0.1), (0.4, 0.8), (1.0, 1.0)), 2.0)
    shown = curve(np.array([0.4, np.nan], np.float32))
    assert shown[0] == pytest.approx(0.64, abs=1e-6)
    assert np.isnan(shown[1])


@pytest.mark.parametrize(
    "points",
    [
        ((0.0, 0.0),),
        ((0.1, 0.0), (1.0, 1.0)),
        ((0.0, 0.0), (0.5, 1.0), (0.5, 0.2), (1.0, 1.0)),
        ((0.0, -0.1), (1.0, 1.0)),
    ],
)
def test_impossible_curves_are_refused(points) -> None:
    """Too few points, a wrong start, equal inputs and outputs outside [0, 1] raise."""
    with pytest.raises(ValueError, match="curve"):
        RemapCurve(points)


@given(shares)
def test_rounding_is_within_half_a_level(value: float) -> None:
    """Without dither a stored value is off by at most half of 1/31."""
    assert abs(quantise(np.array(value)) / 31 - value) <= 0.5 / 31 + 1e-6


def test_dither_keeps_the_mean() -> None:
    """Over a 4 × 4 block the dithered codes average to the value within a sixteenth of a level."""
    for value in np.linspace(0.0, 1.0, 97):
        codes = quantise(np.full((4, 4), value), thresholds=dither_thresholds(4, 4))
        assert abs(codes.mean() / 31 - value) <= 1.0 / 16 / 31 + 1e-9


def test_exact_levels_are_not_dithered() -> None:
    """A value that the 5 bits can hold is stored the same at every pixel."""
    for code in range(32):
        assert np.all(quantise(np.full((4, 4), code / 31), thresholds=dither_thresholds(4, 4)) == code)
