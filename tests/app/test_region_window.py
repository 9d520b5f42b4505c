"""Regions in the window: panel, list, marks, sliders, probe, brush and file."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PyQt6.QtCore import QPointF, Qt
from PyQt6.QtTest import QTest
from pytestqt.qtbot import QtBot
from settling import settle

from app.region_part import LIST, PANEL, RegionsPart
from app.region_state import Tool
from app.window import Window
from bake.region_types import GRID, PointState
from bake.regions.region_file import read_region_file
from viewer.region_view import PointSet, RegionColor

PATIENCE_MS = 180_000

pytestmark = pytest.mark.gui


@pytest.fixture
def part(shown_regions: Window) -> RegionsPart:
    """The regions' part of a window over the small level baked with regions."""
    return shown_regions.bench.part(RegionsPart)


def _wait_for_models(part: RegionsPart, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: not part.live.is_busy, timeout=PATIENCE_MS)


def test_nothing_is_drawn_until_it_is_asked_for(part: RegionsPart) -> None:
    """Regions are off by default: no mark exists."""
    viewport = part.bench.area.main
    assert part.state.view.draws_nothing
    assert not [name for name in viewport._shapes if name.startswith("region")]
    assert "region points" not in viewport._points


def test_result_without_regions_says_how_to_get_them(
    make_window: Callable[..., Window], qtbot: QtBot, result_folder: Path
) -> None:
    """The panel explains, and its button asks for a bake with automatic regions."""
    window = make_window()
    window.controller.open(result_folder)
    qtbot.waitUntil(lambda: window.document.result is not None, timeout=PATIENCE_MS)
    part = window.bench.part(RegionsPart)
    window.bench.show_panel(PANEL)
    settle()
    assert part.panel.bake.isVisible()
    assert not part.panel.shown.isVisible()
    assert not window.bench.registry["region-links"].isEnabled()
    with qtbot.waitSignal(window.panels.bake.bake_requested, timeout=1000) as asked:
        part.panel.bake.click()
    assert asked.args[0].regions == "auto"
    window.controller.cancel()


def test_boxes_have_a_legend(part: RegionsPart) -> None:
    """Whatever colours the boxes is explained in the view."""
    titles: set[str] = set()
    for color in RegionColor:
        part.panel.shown.boxes.setCurrentIndex(part.panel.shown.boxes.findData(color))
        assert part.state.view.boxes is color
        scale = part.bench.area.main._scales["region boxes"].scale
        assert scale is not None
        titles.add(scale.title)
    assert len(titles) == len(RegionColor)


def test_marks_follow_the_panel(part: RegionsPart) -> None:
    """Ticking links, centres, models and points draws them; unticking takes them away."""
    shown, viewport = part.panel.shown, part.bench.area.main
    for check in (shown.links, shown.centres, shown.models):
        check.setChecked(True)
    shown.points.setCurrentIndex(shown.points.findData(PointSet.ALL))
    names = ("region links", "region centres", "region models")
    assert all(viewport._shapes[name].actor.GetVisibility() for name in names)
    assert viewport._points["region points"].actor.GetVisibility()
    for check in (shown.links, shown.centres, shown.models):
        check.setChecked(False)
    shown.points.setCurrentIndex(shown.points.findData(PointSet.NONE))
    assert not any(viewport._shapes[name].actor.GetVisibility() for name in names)
    assert not viewport._points["region points"].actor.GetVisibility()


def test_slider_makes_models_without_tracing(part: RegionsPart, qtbot: QtBot) -> None:
    """β moves the models and the mismatch; Reset brings back those of the bake; nothing stored changes."""
    baked = part.state.regions
    assert baked is not None
    part.panel.models.slider.setValue(180)
    _wait_for_models(part, qtbot)
    assert part.state.is_preview
    moved = part.state.regions
    assert moved is not None
    assert moved.mismatch_after.max() < baked.mismatch_after.max()
    assert np.array_equal(moved.fitted.coefficients, baked.fitted.coefficients)
    part.panel.models._reset.click()
    _wait_for_models(part, qtbot)
    assert part.state.regions is baked


def test_latest_of_many_slider_moves_wins(part: RegionsPart, qtbot: QtBot) -> None:
    """A hundred moves are not a hundred refits, and the last one is what is shown."""
    for value in range(20, 120):
        part.panel.models.slider.setValue(value)
    last = part.state.settings
    _wait_for_models(part, qtbot)
    assert last is not None
    assert part.state.settings == last
    from app.region_models import Fit, refit

    assert part.state.baked is not None
    expected = refit(part.state.baked, last, Fit(None, False, is_new=False)).regions
    assert part.state.regions is not None
    assert np.array_equal(part.state.regions.regularised.coefficients, expected.regularised.coefficients)


def test_settings_are_kept_for_the_bake(part: RegionsPart, qtbot: QtBot) -> None:
    """“Use in bake” puts β, sweeps and tolerance into the form."""
    part.panel.models.beta.setValue(7.5)
    part.panel.models.sweeps.setValue(33)
    part.panel.models._keep.click()
    _wait_for_models(part, qtbot)
    settings = part.bench.panels.bake.settings()
    assert settings is not None
    assert (settings.region_beta, settings.region_sweeps) == (7.5, 33)


def test_list_is_sorted_by_mismatch_and_flies_there(part: RegionsPart, qtbot: QtBot) -> None:
    """The first boundary is the worst; choosing it selects both regions and moves the camera."""
    table, state = part.table, part.state
    part.bench.show_panel(LIST)
    assert state.regions is not None
    table.select_next(1)
    worst = int(state.regions.mismatch_after[:, state.view.column].argmax())
    assert state.view.link == worst
    main = part.bench.area.main
    centre = state.regions.graph.link_centre[worst]
    qtbot.waitUntil(lambda: np.allclose(main.camera.focal, centre, atol=1e-6), timeout=5000)
    table.set_kind("Regions")
    table.view.row_chosen.emit(2)
    assert (state.view.region, state.view.link) == (2, -1)
    assert table.view.chosen() == 2


def test_table_follows_the_models_and_keeps_its_row(part: RegionsPart, qtbot: QtBot) -> None:
    """Other models give other numbers; what was chosen stays chosen."""
    part.table.select_next(1)
    chosen = part.table.view.chosen()
    before = list(part.table.view.columns.columns[4].texts)
    part.panel.models.beta.setValue(0.0)
    _wait_for_models(part, qtbot)
    qtbot.waitUntil(lambda: list(part.table.view.columns.columns[4].texts) != before, timeout=5000)
    assert part.table.view.chosen() == chosen


def test_before_and_after_by_key(part: RegionsPart) -> None:
    """R switches between models as fitted and regularised."""
    registry = part.bench.registry
    registry["region-fitted"].trigger()
    assert part.state.view.as_fitted
    assert part.panel.shown.fitted.isChecked()
    registry["region-fitted"].trigger()
    assert not part.state.view.as_fitted


def test_probe_is_placed_dragged_and_evaluated(part: RegionsPart) -> None:
    """The probe stands in the selected region, its numbers are those of the models, and a drag moves it."""
    state, main = part.state, part.bench.area.main
    state.set_view(state.view.replaced(region=1))
    part.probe_selected()
    assert state.view.probe is not None
    assert "room" in part.panel.probe._values.text()
    assert main._shapes["region probe"].actor.GetVisibility()
    main.set_camera(main.camera.aimed(state.view.probe, 0.7))
    start, middle = np.array(state.view.probe), QPointF(main.view.rect().center())
    QTest.mousePress(main.view, Qt.MouseButton.LeftButton, pos=middle.toPoint())
    QTest.mouseMove(main.view, (middle + QPointF(30.0, 0.0)).toPoint())
    QTest.mouseRelease(main.view, Qt.MouseButton.LeftButton, pos=(middle + QPointF(30.0, 0.0)).toPoint())
    moved = np.array(state.view.probe) - start
    assert moved @ main.camera.right > 0.0
    assert abs(moved @ main.camera.backward) < 1e-6


def test_tools_exclude_each_other_and_escape_puts_them_away(part: RegionsPart) -> None:
    """Brush and placing are never both in hand."""
    registry = part.bench.registry
    registry["region-place"].trigger()
    registry["region-brush"].trigger()
    assert part.state.tool is Tool.BRUSH
    assert not registry["region-place"].isChecked()
    assert not part.panel.probe.place.isChecked()
    registry["cancel"].trigger()
    assert part.state.tool is Tool.NONE


def test_brush_switches_points_and_can_be_undone(part: RegionsPart, qtbot: QtBot) -> None:
    """A stroke takes points out, the region is fitted again at once, and undo gives the bake back."""
    state, main = part.state, part.bench.area.main
    assert state.regions is not None
    state.set_view(state.view.replaced(region=0, points=PointSet.SELECTED, through_walls=True))
    target = state.regions.points.position[300].astype(float)
    main.set_camera(main.camera.aimed(target, 3.0))
    state.set_tool(Tool.BRUSH)
    state.set_brush(on=False, radius=0.8)
    before = state.regions.fitted.coefficients[0].copy()
    camera = main.camera
    middle = main.view.rect().center()
    QTest.mousePress(main.view, Qt.MouseButton.LeftButton, pos=middle)
    QTest.mouseMove(main.view, middle + QPointF(20.0, 10.0).toPoint())
    QTest.mouseRelease(main.view, Qt.MouseButton.LeftButton, pos=middle + QPointF(20.0, 10.0).toPoint())
    assert main.camera == camera
    assert state.is_edited
    _wait_for_models(part, qtbot)
    assert state.regions is not None
    off = int((state.regions.points.state == PointState.UNREACHABLE).sum())
    assert state.baked is not None
    assert off > int((state.baked.points.state == PointState.UNREACHABLE).sum())
    assert not np.allclose(state.regions.fitted.coefficients[0], before)
    part.bench.undo.undo()
    _wait_for_models(part, qtbot)
    assert not state.is_edited
    assert state.regions is state.baked
    part.bench.undo.redo()
    assert state.is_edited


def test_untraced_points_wait_for_the_next_bake(part: RegionsPart, qtbot: QtBot) -> None:
    """Points that are switched on without having been traced are marked as such."""
    part.state.set_view(part.state.view.replaced(region=0, points=PointSet.SELECTED))
    part.panel.validity._all_on.click()
    _wait_for_models(part, qtbot)
    assert part.state.pending is not None
    waiting = int(part.state.pending.sum())
    assert waiting > 0
    assert f"{waiting:,} of them are traced at the next bake" in part.panel.validity._counts.text()


def test_region_file_is_written_and_used(part: RegionsPart, qtbot: QtBot, tmp_path: Path) -> None:
    """The file has boxes, links and bits in world metres, and the next bake is set to it."""
    part.state.set_view(part.state.view.replaced(region=2))
    part.panel.validity._all_off.click()
    target = tmp_path / "mine.json"
    part.save_file(target)
    qtbot.waitUntil(target.exists, timeout=PATIENCE_MS)
    read = read_region_file(target)
    assert [region.name for region in read.regions] == ["west", "room", "north", "east"]
    assert read.regions[1].minimum == pytest.approx((-1.5, 0.1, -1.5))
    assert read.regions[2].valid is not None
    assert not read.regions[2].valid.any()
    assert read.regions[0].valid is not None
    assert read.regions[0].valid.shape == (GRID**3,)
    assert json.loads(target.read_text())["links"]
    qtbot.waitUntil(lambda: part.bench.panels.bake.form.editor("regions").value() == str(target), timeout=5000)


def test_click_in_the_view_selects_the_region_there(part: RegionsPart) -> None:
    """While boxes are drawn, a click on the ground selects the region above it."""
    state, main = part.state, part.bench.area.main
    world = part.bench.document.world
    assert world is not None
    state.set_view(state.view.replaced(boxes=RegionColor.ERROR))
    place = np.array([-3.5, 0.2, 2.5]) - world.origin
    main.set_camera(main.camera.aimed(place, 4.0))
    main._on_click(QPointF(main.view.rect().center()))
    assert state.view.region == 0


def test_other_result_starts_afresh(part: RegionsPart, qtbot: QtBot, result_folder: Path) -> None:
    """A result without regions takes everything out of the view."""
    part.state.set_view(part.state.view.replaced(boxes=RegionColor.ERROR, links=True, region=1))
    part.bench.controller.open(result_folder)
    qtbot.waitUntil(lambda: part.state.regions is None, timeout=PATIENCE_MS)
    shapes = part.bench.area.main._shapes
    assert not any(shape.actor.GetVisibility() for name, shape in shapes.items() if name.startswith("region"))
    assert part.state.view.region == -1
