"""Distribution by area, clipping and autofit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from viewer.histogram import clipped_shares, histogram_of, robust_range, vertex_areas


def test_vertex_areas_sum_to_the_surface() -> None:
    """Every face gives a third of its area to each corner; an unreferenced vertex gets none."""
    positions = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0], [2, 3, 0], [9, 9, 9]], float)
    areas = vertex_areas(positions, np.array([[0, 1, 2], [1, 3, 2]], np.int32))
    np.testing.assert_allclose(areas, [1, 2, 2, 1, 0])


def test_histogram_weighs_by_area() -> None:
    """A large face counts more than a small one; missing values do not count."""
    values = np.array([0.05, 0.95, np.nan], np.float32)
    found = histogram_of(values, np.array([1.0, 3.0, 100.0]), 0.0, 1.0, bins=10)
    assert found.shares[0] == pytest.approx(0.25)
    assert found.shares[9] == pytest.approx(0.75)
    assert found.mean == pytest.approx(0.725)
    assert not found.is_empty


def test_histogram_without_values_is_empty() -> None:
    """Nothing finite, nothing counted."""
    assert histogram_of(np.full(3, np.nan, np.float32), np.ones(3), 0.0, 1.0).is_empty


@given(hnp.arrays(np.float32, st.integers(1, 60), elements=st.floats(-1, 2, width=32)))
def test_histogram_counts_everything_once(values: np.ndarray) -> None:
    """Shares sum to 1, also with values outside the bins."""
    assert histogram_of(values, np.ones(len(values)), 0.0, 1.0).shares.sum() == pytest.approx(1.0)


def test_autofit_drops_outliers_and_keeps_the_rest() -> None:
    """A thousandth of the area at each end does not decide the range."""
    values = np.concatenate((np.linspace(0.4, 0.6, 5000), [-50.0, 74.0])).astype(np.float32)
    low, high = robust_range(values, np.ones(len(values)))
    assert 0.39 < low < 0.41
    assert 0.59 < high < 0.61


def test_autofit_of_a_constant_has_width() -> None:
    """A range must be drawable; without values it is [0, 1]."""
    low, high = robust_range(np.full(9, 0.5, np.float32), np.ones(9))
    assert low < 0.5 < high
    assert robust_range(np.full(2, np.nan, np.float32), np.ones(2)) == (0.0, 1.0)


def test_clipped_shares() -> None:
    """Area below and above the range, missing values left out."""
    values = np.array([0.1, 0.5, 0.9, np.nan], np.float32)
    assert clipped_shares(values, np.array([1.0, 2.0, 1.0, 50.0]), 0.2, 0.8) == pytest.approx((0.25, 0.25))
