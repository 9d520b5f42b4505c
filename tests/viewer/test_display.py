"""Which numbers a display shows, and the marks over them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from bake.types import BakeResult, VertexField, VertexState
from viewer import overlays
from viewer.colormaps import BLUE_WHITE_ORANGE, NOT_BAKED_COLOR
from viewer.display import Display, shown_field
from viewer.fields import Quantity, distance_label
from viewer.overlays import (
    all_sample_points,
    invalid_count,
    invalid_sample_points,
    sample_positions,
    vertices_in_state,
)
from viewer.tone import RemapCurve, blend


def test_distance_and_blend_show_the_stored_values(baked: BakeResult) -> None:
    """A distance is its column, the blend is the mix after the curve."""
    field, distances = baked.field, baked.settings.column_distances
    shown = shown_field(Display(quantity=Quantity.DISTANCE, column=1), baked, field)
    assert shown is not None
    np.testing.assert_array_equal(shown.values, field.ao[:, 1])
    curve = RemapCurve(exponent=1.5)
    mixed = shown_field(Display(short_share=0.2, curve=curve), baked, field)
    assert mixed is not None
    np.testing.assert_array_equal(mixed.values, curve(blend(np.asarray(field.ao), distances, 0.2)))


def test_geometry_has_no_values(baked: BakeResult) -> None:
    """Plain geometry and a difference without a partner show nothing."""
    assert shown_field(Display(quantity=Quantity.GEOMETRY), baked, baked.field) is None
    assert shown_field(Display(quantity=Quantity.DIFFERENCE), baked, baked.field) is None


def test_difference_is_signed_and_symmetric(baked: BakeResult) -> None:
    """First minus second, with zero in the middle of a diverging map."""
    other = VertexField(np.asarray(baked.field.ao) * np.float32(0.5), baked.field.state, baked.field.report)
    shown = shown_field(Display(quantity=Quantity.DIFFERENCE, column=0), baked, baked.field, other)
    assert shown is not None
    np.testing.assert_allclose(shown.values, 0.5 * baked.field.ao[:, 0], rtol=1e-5)
    assert shown.low == -shown.high
    assert shown.color_map is BLUE_WHITE_ORANGE


def test_ranges_of_values_and_differences_are_kept_apart(baked: BakeResult) -> None:
    """Narrowing the range of AO leaves that of differences alone; None goes back to the field's own."""
    display = Display()
    plain = shown_field(display, baked, baked.field)
    assert plain is not None
    narrowed = display.with_range(plain, 0.2, 0.7)
    assert narrowed.range_for(plain) == (0.2, 0.7)
    assert narrowed.difference_range is None
    assert narrowed.with_range(plain, None, None).range_for(plain) == (0.0, 1.0)


def test_objects_that_are_not_baked_are_slate(baked: BakeResult) -> None:
    """No value due is not the same as a value missing."""
    state = np.array(baked.field.state)
    ao = np.array(baked.field.ao)
    state[:5], ao[:5] = VertexState.NOT_BAKED, np.nan
    field = VertexField(ao, state, baked.field.report)
    shown = shown_field(Display(), baked, field)
    assert shown is not None
    colors = shown.colors(shown.color_map, 0.0, 1.0)
    assert tuple(colors[0]) == NOT_BAKED_COLOR
    assert shown.missing_count == int(np.isnan(ao[5:, 0]).sum())


@pytest.mark.parametrize(("metres", "text"), [(2.0, "2 m"), (0.25, "0.25 m"), (300.0, "300 m"), (1500.0, "1.5 km")])
def test_distance_labels(metres: float, text: str) -> None:
    """Distances are named as people would."""
    assert distance_label(metres) == text


def test_invalid_samples_follow_the_threshold(baked: BakeResult) -> None:
    """Marks and count are those of the tally at every threshold; more tolerance, fewer marks."""
    counts = []
    for threshold in (0.0, 0.25, 0.6, 1.0):
        points = invalid_sample_points(baked.world, baked.samples, baked.tally, threshold)
        assert points.total == invalid_count(baked.tally, threshold) == (~baked.tally.valid(threshold)).sum()
        assert len(points.positions) == len(points.colors) == points.total
        counts.append(points.total)
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > 0
    assert counts[-1] == 0


def test_samples_lie_on_their_faces(baked: BakeResult) -> None:
    """A sample's position is inside its triangle's box and on its plane."""
    world, samples = baked.world, baked.samples
    points = sample_positions(world, samples, np.arange(len(samples))).astype(np.float64)
    corners = np.asarray(world.positions)[np.asarray(world.faces)[np.asarray(samples.face)]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.abs(((points - corners[:, 0]) * normals).sum(1)).max() < 1e-5
    assert np.all(points >= corners.min(1) - 1e-5)
    assert np.all(points <= corners.max(1) + 1e-5)


def test_marks_are_thinned_and_say_so(baked: BakeResult, monkeypatch: pytest.MonkeyPatch) -> None:
    """Above the limit every n-th mark is drawn, and the total is kept."""
    monkeypatch.setattr(overlays, "MOST_POINTS", 10)
    points = all_sample_points(baked.world, baked.samples, baked.tally, 0)
    assert points.total == len(baked.samples)
    assert len(points.positions) <= 10


def test_vertices_are_marked_by_state(baked: BakeResult) -> None:
    """Filled vertices are exactly those of that state."""
    points = vertices_in_state(baked.world, baked.field, VertexState.FILLED)
    filled = np.flatnonzero(np.asarray(baked.field.state) == VertexState.FILLED)
    np.testing.assert_allclose(points.positions, baked.world.positions[filled], atol=1e-6)


def test_display_is_a_value() -> None:
    """Displays compare by content, so that nothing is redrawn for an equal one."""
    assert Display() == dataclasses.replace(Display(game=True), game=False)
    assert Display().replaced(edges=True) != Display()
