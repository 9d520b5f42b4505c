"""What is seen of a walk: the figure and its light, curves, path and pops."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_regions import row_of_regions

from bake.region_types import Regions
from bake.walk import CHOSEN, Course, PathTruth, Variant, Walk, WalkOptions, lay_out, path_in_pieces, simulate
from viewer.walk_curves import ao_curve, ao_range, frame_at, largest_steps, step_curve
from viewer.walk_figure import MIDDLE, TALL, figure, heading_at
from viewer.walk_light import light_at, lit
from viewer.walk_marks import lit_figure, path_line, picked_marks, pop_marks
from viewer.walk_rows import FIGURES, figure_rows, pop_columns

OPTIONS = WalkOptions(half_life=0.2, normal=(0.3, 0.8, -0.2), column=1)


def _truth(regions: Regions, length: float) -> PathTruth:
    """A truth that changes slowly along the way and is not known near its end."""
    distance = np.linspace(0.0, length, 41)
    sh = np.repeat(regions.points.sh[:1], 41, axis=0) * np.linspace(0.8, 1.2, 41)[:, None, None].astype(np.float32)
    return PathTruth(distance, np.zeros(41, np.int32), sh, 64, distance < 0.9 * length, np.zeros(2))


@pytest.fixture(scope="module")
def walked() -> tuple[Regions, Course, Walk, PathTruth]:
    """A walk through four regions, forth and half-way back."""
    regions = row_of_regions(4)
    path = path_in_pieces([[[0.3, 1.0, 1.0], [7.8, 1.1, 1.2], [4.0, 0.9, 0.7]]])
    truth = _truth(regions, path.length)
    course = lay_out(regions, path, speed=OPTIONS.speed, frame_rate=OPTIONS.frame_rate)
    return regions, course, simulate(regions, path, OPTIONS, truth=truth, course=course), truth


@pytest.mark.parametrize("variant", list(Variant))
def test_light_is_that_of_the_walk_about_each_of_its_normals(
    walked: tuple[Regions, Course, Walk, PathTruth], variant: Variant
) -> None:
    """Where the figure stands, its light gives exactly the AO that the walk has for the frame."""
    regions, course, walk, truth = walked
    models = regions.fitted if variant is Variant.RAW else regions.regularised
    for frame in (0, 3, 80, 161, 250, 330):
        light = light_at(regions, course, frame, variant, OPTIONS, truth)
        expected = walk.ao[variant][frame]
        if light is None:
            assert np.isnan(expected).all()
            continue
        place = walk.position[frame]
        ao = lit(light, models, 1, place, np.broadcast_to(place, (7, 3)), OPTIONS.normals)
        assert ao == pytest.approx(expected, abs=3e-4)


def test_vertices_are_lit_by_the_model_where_they_are(walked: tuple[Regions, Course, Walk, PathTruth]) -> None:
    """Away from the figure's place the model of its region is evaluated there."""
    from bake.regions.evaluate import evaluate

    regions, course, walk, _ = walked
    light = light_at(regions, course, 40, Variant.REGULARISED, OPTIONS)
    assert light is not None
    points = walk.position[40] + np.array([[0.1, 0.3, 0.0], [-0.2, -0.6, 0.1]])
    normals = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    ao = lit(light, regions.regularised, 1, walk.position[40], points, normals)
    assert ao == pytest.approx(evaluate(regions.regularised, int(course.region[40]), points, normals)[:, 1], abs=1e-5)


@given(x=st.floats(-1.0, 1.0), y=st.floats(-1.0, 1.0), z=st.floats(-1.0, 1.0), up=st.sampled_from([0, 1, 2]))
@settings(max_examples=40, deadline=None)
def test_figure_stands_upright_and_keeps_its_size(x: float, y: float, z: float, up: int) -> None:
    """Whichever way it goes, feet are below, the head above, and normals stay unit and point outward."""
    shape = figure()
    axis = np.eye(3)[up]
    positions, normals = shape.placed(np.zeros(3), np.array([x, y, z]), axis)
    assert positions @ axis == pytest.approx(shape.positions[:, 2], abs=1e-9)
    assert (positions @ axis).min() == pytest.approx(-MIDDLE)
    assert (positions @ axis).max() == pytest.approx(TALL - MIDDLE)
    lengths = np.linalg.norm(normals, axis=1)
    assert lengths == pytest.approx(np.ones(len(normals)))
    a, b, c = (positions[shape.faces[:, corner]] for corner in range(3))
    facing = np.cross(b - a, c - a)
    around = normals[shape.faces].mean(axis=1)
    large = np.linalg.norm(facing, axis=1) > 1e-6
    assert ((facing * around).sum(axis=1)[large] > 0.0).mean() > 0.95


def test_figure_is_lit_in_grey(walked: tuple[Regions, Course, Walk, PathTruth]) -> None:
    """Its colours are the grey of its AO."""
    shape = figure()
    positions, _ = shape.placed(np.ones(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    drawn, faces, colors = lit_figure(shape, positions, np.full(len(positions), 0.6, np.float32))
    assert drawn.shape == (len(positions), 3)
    assert faces.max() == len(positions) - 1
    assert set(colors.ravel().tolist()) == {153}


def test_thinned_curve_keeps_extremes(walked: tuple[Regions, Course, Walk, PathTruth]) -> None:
    """However few pixels there are, the highest and lowest value of each are kept."""
    _, _, walk, _ = walked
    end = float(walk.time[-1])
    full = ao_curve(walk, Variant.RAW, CHOSEN, 0.0, end, 100_000)
    thin = ao_curve(walk, Variant.RAW, CHOSEN, 0.0, end, 30)
    values = [np.concatenate([piece[:, 1] for piece in curve.pieces]) for curve in (full, thin)]
    assert len(values[0]) == len(walk)
    assert len(values[1]) <= 66
    assert values[1].min() == values[0].min()
    assert values[1].max() == values[0].max()
    assert all((np.diff(piece[:, 0]) >= 0.0).all() for piece in thin.pieces)


def test_curve_of_the_truth_ends_where_it_is_not_known(walked: tuple[Regions, Course, Walk, PathTruth]) -> None:
    """Unknown values leave a gap, not a line."""
    _, _, walk, _ = walked
    curve = ao_curve(walk, Variant.TRUTH, 2, 0.0, float(walk.time[-1]), 500)
    assert len(curve.pieces) == 1
    known = walk.time[np.isfinite(walk.ao[Variant.TRUTH][:, 2])]
    assert curve.pieces[0][-1, 0] == pytest.approx(known[-1])


def test_curve_breaks_at_a_teleport() -> None:
    """Two pieces of a path are two lines."""
    regions = row_of_regions(3)
    path = path_in_pieces([[[0.5, 1.0, 1.0], [1.5, 1.0, 1.0]], [[4.5, 1.0, 1.0], [5.5, 1.0, 1.0]]])
    walk = simulate(regions, path, OPTIONS)
    assert len(ao_curve(walk, Variant.BLENDED, 0, 0.0, 10.0, 500).pieces) == 2
    positions, cells, _ = path_line(path)
    assert len(positions) == 4
    assert cells.tolist() == [[0, 1], [2, 3]]


def test_steps_and_range(walked: tuple[Regions, Course, Walk, PathTruth]) -> None:
    """The largest step agrees with the walk's figures, and the range holds all that is shown."""
    _, _, walk, _ = walked
    values = largest_steps(walk, Variant.RAW)
    assert values.max() == pytest.approx(walk.metrics[Variant.RAW].worst_step, abs=1e-6)
    assert step_curve(walk, values, 0.0, 1.0, 200).pieces
    low, high = ao_range(walk, frozenset({Variant.RAW, Variant.TRUTH}), CHOSEN, 0.0, 100.0)
    shown = walk.ao[Variant.RAW][:, CHOSEN]
    assert 0.0 <= low <= shown.min()
    assert shown.max() <= high <= 1.0
    assert ao_range(walk, frozenset(), CHOSEN, 0.0, 100.0) == (0.0, 1.0)


def test_frame_at_a_time(walked: tuple[Regions, Course, Walk, PathTruth]) -> None:
    """A time shows the last frame that has begun; times outside show the ends."""
    _, _, walk, _ = walked
    assert frame_at(walk, float(walk.time[17])) == 17
    assert frame_at(walk, float(walk.time[17]) + 0.4 / 60.0) == 17
    assert frame_at(walk, -1.0) == 0
    assert frame_at(walk, 1e9) == len(walk) - 1


def test_heading_follows_the_way(walked: tuple[Regions, Course, Walk, PathTruth]) -> None:
    """The figure faces where it goes, at both ends too."""
    _, _, walk, _ = walked
    assert heading_at(walk.position, 0, 5)[0] > 0.0
    assert heading_at(walk.position, len(walk) - 1, 5)[0] < 0.0


def test_pops_have_a_mark_and_a_row_each(walked: tuple[Regions, Course, Walk, PathTruth]) -> None:
    """Each pop is drawn where it shows and named by its boundary."""
    regions, _, walk, _ = walked
    assert walk.pops
    positions, _, colors = pop_marks(walk, walk.pops)
    assert len(positions) == 6 * len(walk.pops) == len(colors)
    columns = pop_columns(walk.pops, regions)
    assert {len(column.texts) for column in columns} == {len(walk.pops)}
    assert columns[0].keys == sorted(columns[0].keys, reverse=True)
    assert "→" in columns[2].texts[0]
    none = pop_marks(walk, ())
    assert not len(none[0])


def test_figures_have_a_row_a_variant(walked: tuple[Regions, Course, Walk, PathTruth]) -> None:
    """All variants are listed; those without a truth have no error."""
    regions, course, walk, _ = walked
    rows = figure_rows(walk)
    assert [len(row) for row in rows] == [1 + len(FIGURES)] * 6
    assert rows[0][-1] != "–"
    alone = simulate(regions, course.path, dataclasses.replace(OPTIONS), course=course)
    assert [row[-1] for row in figure_rows(alone)] == ["–"] * 5


def test_picked_points_are_marked() -> None:
    """One diamond a point."""
    positions, cells, _ = picked_marks(np.zeros((3, 3)))
    assert (len(positions), len(cells)) == (18, 24)
