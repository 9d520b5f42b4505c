"""Models of regions as spheres, and the tables of regions and boundaries."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_regions import OPEN, row_of_regions

from bake.region_types import Regions
from viewer.region_glyph import axis_table, model_spheres, probe_ao, probe_needle, probe_region, probe_sphere
from viewer.region_rows import boundary_columns, region_columns
from viewer.region_view import RegionView


def _constant(value: float) -> Regions:
    regions = row_of_regions(2)
    coefficients = np.zeros_like(regions.fitted.coefficients)
    coefficients[:, 0, 0] = value * OPEN
    models = dataclasses.replace(regions.fitted, coefficients=coefficients)
    return dataclasses.replace(regions, fitted=models, regularised=models)


def test_probe_of_a_constant_model_is_a_sphere_of_that_radius() -> None:
    """Where AO is the same about every normal, the deformed glyph is a sphere with the AO as radius."""
    view = RegionView(probe=(1.0, 1.2, 0.7), deformed=True, probe_size=2.0)
    shape = probe_sphere(_constant(0.4), view)
    assert shape is not None
    assert np.linalg.norm(shape[0] - np.array(view.probe), axis=1) == pytest.approx(0.8, abs=1e-4)


def test_lit_probe_is_grey_by_ao() -> None:
    """The lit sphere keeps its size and takes the AO as grey."""
    view = RegionView(probe=(1.0, 1.2, 0.7), probe_size=2.0)
    shape = probe_sphere(_constant(0.4), view)
    assert shape is not None
    assert np.linalg.norm(shape[0] - np.array(view.probe), axis=1) == pytest.approx(2.0, abs=1e-4)
    assert set(shape[2].ravel().tolist()) == {102}


def test_probe_takes_the_region_that_it_lies_in_unless_told_otherwise() -> None:
    """Without a choice the region around the probe is evaluated; a chosen one may lie elsewhere."""
    regions = row_of_regions(3)
    assert probe_region(regions, RegionView(probe=(3.0, 1.0, 1.0))) == 1
    assert probe_region(regions, RegionView(probe=(3.0, 1.0, 1.0), probe_region=2)) == 2
    assert probe_region(regions, RegionView(probe=(30.0, 1.0, 1.0))) == -1
    assert probe_region(regions, RegionView()) == -1
    assert probe_sphere(regions, RegionView(probe=(30.0, 1.0, 1.0))) is None
    assert axis_table(regions, RegionView(probe=(30.0, 1.0, 1.0))) is None


@given(azimuth=st.floats(0.0, 360.0), elevation=st.floats(-90.0, 90.0), up=st.sampled_from([1, 2]))
@settings(max_examples=30, deadline=None)
def test_needle_is_a_unit_normal(azimuth: float, elevation: float, up: int) -> None:
    """Whatever the angles, the normal has unit length and its height is the elevation's sine."""
    normal = np.array(RegionView(azimuth=azimuth, elevation=elevation).normal(up))
    assert np.linalg.norm(normal) == pytest.approx(1.0)
    assert normal[up] == pytest.approx(np.sin(np.radians(elevation)), abs=1e-9)


def test_probe_about_an_axis_agrees_with_the_table() -> None:
    """The needle straight up shows the number of the table's +Y row."""
    regions, view = row_of_regions(3), RegionView(probe=(3.2, 1.1, 0.4), elevation=90.0)
    table, upward = axis_table(regions, view), probe_ao(regions, view, 1)
    assert table is not None
    assert upward is not None
    assert upward[0] == pytest.approx(table[0][2], abs=1e-6)
    assert upward[1] == pytest.approx(table[1][2], abs=1e-6)
    assert probe_needle(regions, view, 1) is not None


def test_small_spheres_lie_in_their_regions() -> None:
    """Every region has a sphere around its model's centre."""
    regions = row_of_regions(4)
    positions, cells, colors = model_spheres(regions, RegionView())
    centres = positions.reshape(4, -1, 3)
    assert (centres.min(axis=1) > regions.graph.minimum).all()
    assert (centres.max(axis=1) < regions.graph.maximum).all()
    assert cells.max() == len(positions) - 1 == len(colors) - 1


def test_tables_have_a_row_a_region_and_a_boundary() -> None:
    """Columns have as many cells as there are regions or links, and errors follow the view."""
    regions = row_of_regions(4)
    memory = np.full(4, 352)
    for as_fitted in (True, False):
        columns = region_columns(regions, RegionView(as_fitted=as_fitted), (2.0, 300.0), memory)
        assert {len(column.texts) for column in columns} == {4}
        models = regions.fitted if as_fitted else regions.regularised
        error = next(column for column in columns if column.heading == "RMSE 2 m")
        assert error.keys == pytest.approx(models.rmse[:, 0].tolist())
        assert list(error.texts) == [f"{value:.4f}" for value in models.rmse[:, 0]]
    columns = boundary_columns(regions, (2.0, 300.0))
    assert {len(column.texts) for column in columns} == {3}
    assert columns[0].texts == ["cell 0", "cell 1", "cell 2"]
    assert columns[1].texts == ["cell 1", "cell 2", "cell 3"]


def test_absorbed_regions_say_whose_model_they_use() -> None:
    """Both sides of an absorption are named, and its cost."""
    regions = dataclasses.replace(
        row_of_regions(3), absorbed=(("cell 1", "cell 0"),), absorbed_error=np.array([[0.01, 0.02]], np.float32)
    )
    column = region_columns(regions, RegionView(), (2.0, 300.0), np.zeros(3))[-1]
    assert list(column.texts) == ["takes cell 1", "in cell 0, costs 0.0200", ""]


def test_region_without_points_has_a_dash_for_its_error() -> None:
    """An unknown error is a dash and sorts below all others."""
    regions = row_of_regions(2)
    rmse = regions.regularised.rmse.copy()
    rmse[1] = np.nan
    regions = dataclasses.replace(regions, regularised=dataclasses.replace(regions.regularised, rmse=rmse))
    column = next(
        column
        for column in region_columns(regions, RegionView(), (2.0, 300.0), np.zeros(2))
        if column.heading == "RMSE 300 m"
    )
    assert column.texts[1] == "–"
    assert column.keys[1] < column.keys[0]
