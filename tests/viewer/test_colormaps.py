"""Colour maps: ends, order, and values that are missing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewer.colormaps import BLUE_WHITE_ORANGE, CIVIDIS, GREY, INVALID_COLOR, VALUE_MAPS, WARNING, color_map_named


@pytest.mark.parametrize("color_map", [*VALUE_MAPS, BLUE_WHITE_ORANGE, WARNING], ids=lambda item: item.name)
def test_table_starts_and_ends_at_its_stops(color_map) -> None:
    """A map's first and last colours are those of its first and last stop."""
    table = color_map.table()
    assert bytes(table[0]).hex() == color_map.stops[0][1]
    assert bytes(table[-1]).hex() == color_map.stops[-1][1]
    assert not (table == INVALID_COLOR).all(axis=1).any()


@pytest.mark.parametrize("color_map", VALUE_MAPS, ids=lambda item: item.name)
def test_value_maps_brighten_steadily(color_map) -> None:
    """More open is brighter in every map for values, so that they read right in grey too."""
    luma = color_map.table().astype(float) @ (0.2126, 0.7152, 0.0722)
    assert np.all(np.diff(luma) > -1.0)
    assert luma[-1] - luma[0] > 150


def test_diverging_map_is_neutral_in_the_middle() -> None:
    """No difference is almost white."""
    middle = BLUE_WHITE_ORANGE.colors(np.zeros(1, np.float32), -1.0, 1.0)[0].astype(int)
    assert middle.min() > 230
    assert middle.max() - middle.min() < 10


@given(st.lists(st.floats(-10, 10, width=32), min_size=1), st.floats(-2, 1), st.floats(0.01, 3))
def test_colors_are_clamped_to_the_range(values: list[float], low: float, width: float) -> None:
    """What lies outside the range gets the colour of the nearer end."""
    array = np.array(values, np.float32)
    colors = GREY.colors(array, low, low + width)
    assert np.all(colors[array <= low] == 0)
    assert np.all(colors[array >= low + width] == 255)


def test_missing_values_are_magenta() -> None:
    """NaN is no colour of the map."""
    colors = CIVIDIS.colors(np.array([np.nan, 0.5], np.float32), 0.0, 1.0)
    assert tuple(colors[0]) == INVALID_COLOR
    assert tuple(colors[1]) != INVALID_COLOR


def test_range_without_width_is_a_step() -> None:
    """Two equal ends do not divide by zero."""
    colors = GREY.colors(np.array([0.4, 0.6], np.float32), 0.5, 0.5)
    assert colors[0, 0] == 0
    assert colors[1, 0] == 255


def test_unknown_name_falls_back_to_grey() -> None:
    """A name from another version is no error."""
    assert color_map_named("jet") is GREY
    assert color_map_named("cividis") is CIVIDIS
