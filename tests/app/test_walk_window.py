"""The walk in the window: tour, points, file, playing, plot, pops, camera and table."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from PyQt6.QtCore import QPoint, QPointF, Qt
from PyQt6.QtTest import QTest
from pytestqt.qtbot import QtBot
from settling import settle

from app.region_part import RegionsPart
from app.region_state import Tool
from app.walk_part import WalkPart
from app.walk_state import Follow
from app.window import Window
from bake.walk import CHOSEN, Variant
from viewer.walk_curves import TITLES

PATIENCE_MS = 180_000
WAY = [[-4.0, 1.6, 4.0], [-4.0, 1.5, -3.5], [0.0, 1.5, -3.5], [4.0, 1.5, -2.0], [4.2, 1.6, 4.0]]

pytestmark = pytest.mark.gui


@pytest.fixture
def part(shown_regions: Window) -> WalkPart:
    """The walk's part of a window over the small level baked with regions."""
    return shown_regions.bench.part(WalkPart)


@pytest.fixture
def walked(part: WalkPart, qtbot: QtBot, tmp_path: Path) -> WalkPart:
    """The same, with a walk from a file."""
    path = tmp_path / "way.json"
    path.write_text(json.dumps(WAY))
    part.show()
    part.live.read_file(path)
    qtbot.waitUntil(lambda: part.state.walk is not None, timeout=PATIENCE_MS)
    return part


def _wait(part: WalkPart, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: not part.live.is_busy, timeout=PATIENCE_MS)


def test_tour_with_truth_comes_from_the_engine(part: WalkPart, qtbot: QtBot) -> None:
    """A tour is walked and compared with what was traced along it; the panel says how far it went."""
    part.tour()
    assert part.live.is_tracing
    qtbot.waitUntil(lambda: part.state.truth is not None, timeout=PATIENCE_MS)
    _wait(part, qtbot)
    walk = part.state.walk
    assert walk is not None
    assert Variant.TRUTH in walk.ao
    assert part.state.visited is not None
    assert "Tour of" in part.panel.path._what.text()
    assert "Truth" in part.panel._figures.text()


def test_truth_can_be_traced_later_and_cancelled(walked: WalkPart, qtbot: QtBot) -> None:
    """A path from a file has no truth until it is asked for; cancelling leaves the walk."""
    assert walked.state.truth is None
    assert not walked.list.buttons[Variant.TRUTH].isEnabled()
    walked.trace_truth()
    walked.live.cancel()
    qtbot.waitUntil(lambda: not walked.live.is_tracing, timeout=PATIENCE_MS)
    walked.trace_truth()
    qtbot.waitUntil(lambda: walked.state.truth is not None, timeout=PATIENCE_MS)
    _wait(walked, qtbot)
    assert walked.state.walk is not None
    assert np.isfinite(walked.state.walk.ao[Variant.TRUTH]).any()
    assert walked.list.buttons[Variant.TRUTH].isEnabled()


def test_picked_points_are_the_path(part: WalkPart, qtbot: QtBot) -> None:
    """Clicks add points a metre above the floor; taking one back shortens the path."""
    main, world = part.bench.area.main, part.bench.document.world
    assert world is not None
    part.bench.registry["walk-pick"].trigger()
    assert part.regions.tool is Tool.PATH
    for x in (-3.0, -3.5, -4.2):
        place = np.array([x, 0.0, 3.0]) - world.origin
        main.set_camera(main.camera.aimed(place, 1.5))
        main._on_click(QPointF(main.view.rect().center()))
    assert len(part.state.picked) == 3
    _wait(part, qtbot)
    path = part.state.path
    assert path is not None
    assert len(path.points) == 3
    part.unpick()
    assert part.state.path is not None
    assert part.state.path.length < path.length
    part.bench.registry["walk-clear"].trigger()
    assert part.state.path is None
    assert part.state.walk is None


def test_options_walk_anew_and_keep_the_moment(walked: WalkPart, qtbot: QtBot) -> None:
    """Another frame rate gives other frames; what is in view stays in view."""
    state = walked.state
    state.set_frame(200)
    moment = state.time
    walked.panel.play.frame_rate.setCurrentText("30")
    walked.panel.play.half_life.setValue(0.3)
    _wait(walked, qtbot)
    assert state.walk is not None
    assert state.walk.options.frame_rate == 30.0
    assert state.walk.options.half_life == pytest.approx(0.3)
    assert state.time == pytest.approx(moment, abs=0.04)


def test_models_made_again_are_walked_again(walked: WalkPart, qtbot: QtBot) -> None:
    """The slider of β reaches the walk: what is regularised changes, what is raw does not."""
    before = walked.state.walk
    assert before is not None
    regions = walked.bench.part(RegionsPart)
    regions.panel.models.beta.setValue(0.0)
    qtbot.waitUntil(
        lambda: walked.state.walk is not before and not regions.live.is_busy and not walked.live.is_busy,
        timeout=PATIENCE_MS,
    )
    after = walked.state.walk
    assert after is not None
    assert np.array_equal(after.ao[Variant.RAW], before.ao[Variant.RAW])
    assert np.allclose(after.ao[Variant.REGULARISED], after.ao[Variant.RAW], atol=1e-6)
    assert not np.allclose(before.ao[Variant.REGULARISED], before.ao[Variant.RAW], atol=1e-3)


def test_playing_keeps_time_and_ends(walked: WalkPart, qtbot: QtBot) -> None:
    """It plays by the clock at the chosen rate, stops at the end, and begins anew from there."""
    state = walked.state
    assert state.walk is not None
    state.set_view(rate=4.0)
    state.set_frame(len(state.walk) - 40)
    walked.bench.registry["walk-play"].trigger()
    assert state.is_playing
    qtbot.waitUntil(lambda: not state.is_playing, timeout=PATIENCE_MS)
    assert state.frame == len(state.walk) - 1
    walked.bench.registry["walk-play"].trigger()
    assert state.frame == 0
    state.set_playing(False)


def test_figure_stands_where_the_walk_is(walked: WalkPart) -> None:
    """The figure is drawn around the place of the frame, in the grey of its AO."""
    main, state = walked.bench.area.main, walked.state
    state.set_frame(100)
    shape = main._shapes["walk figure"]
    assert shape.actor.GetVisibility()
    low_x, high_x, low_y, high_y, _, _ = shape.actor.GetBounds()
    place = state.place()
    assert place is not None
    assert (low_x + high_x) / 2.0 == pytest.approx(place[0], abs=0.05)
    assert low_y == pytest.approx(place[1] - 1.0, abs=0.01)
    assert high_y == pytest.approx(place[1] + 0.8, abs=0.01)
    state.set_view(marks=False)
    assert not shape.actor.GetVisibility()


def test_every_variant_can_light_the_figure(walked: WalkPart) -> None:
    """The legend says which one does; without a truth the figure falls back to what there is."""
    main = walked.bench.area.main
    for number, lit in enumerate(Variant):
        walked.state.set_view(lit=lit)
        walked.state.set_frame(60 + number)
        assert main._shapes["walk figure"].actor.GetVisibility()
        scale = main._scales["walk figure"].scale
        assert scale is not None
        shown = TITLES[Variant.BLENDED if lit is Variant.TRUTH else lit]
        assert scale.note.endswith(shown.lower())


def test_camera_follows(walked: WalkPart) -> None:
    """The camera goes along, and stays near the figure."""
    main, state = walked.bench.area.main, walked.state
    for follow in (Follow.BESIDE, Follow.BEHIND):
        state.set_view(follow=Follow.STAY)
        state.set_frame(10)
        main.set_camera(main.camera.aimed(state.place(), 5.0))
        state.set_view(follow=follow)
        for frame in (11, 60, 200):
            state.set_frame(frame)
            place = state.place()
            assert place is not None
            assert np.linalg.norm(np.array(main.camera.focal) - place) < 1.0
        assert main.camera.distance < 5.1


def test_pops_lead_to_their_boundary(walked: WalkPart) -> None:
    """Choosing a pop goes to its frame and selects the link between its two regions."""
    state = walked.state
    assert state.pops
    pop = next(pop for pop in state.pops if pop.before != pop.after)
    walked.list.view.row_chosen.emit(state.pops.index(pop))
    assert state.frame == pop.frame
    graph = walked.regions.regions
    assert graph is not None
    link = walked.regions.view.link
    if link >= 0:
        assert set(graph.graph.link[link].tolist()) == {pop.before, pop.after}
    else:
        assert walked.regions.view.region == pop.after


def test_pops_by_key(walked: WalkPart) -> None:
    """J and Shift+J go through the pops in time."""
    state = walked.state
    frames = sorted({pop.frame for pop in state.pops})
    state.set_frame(0)
    registry = walked.bench.registry
    seen = []
    for _ in frames:
        registry["walk-next-pop"].trigger()
        seen.append(state.frame)
    assert seen == frames
    registry["walk-last-pop"].trigger()
    assert state.frame == (frames[-2] if len(frames) > 1 else frames[0])


def test_hidden_variants_have_neither_curve_nor_pops(walked: WalkPart) -> None:
    """A button above the plot takes a variant out of plot and table."""
    state = walked.state
    raw = sum(pop.variant is Variant.RAW for pop in state.pops)
    before = len(state.pops)
    assert raw
    walked.list.buttons[Variant.RAW].click()
    assert len(state.pops) == before - raw
    assert walked.list.view.columns.rowCount() == before - raw


def test_plot_scrubs_zooms_and_goes_to_pops(walked: WalkPart) -> None:
    """A drag goes to a moment, the wheel shortens the span about the cursor, a double click shows all."""
    plot, state = walked.list.plot, walked.state
    plot.grab()
    layout = plot.layout_now
    QTest.mousePress(plot, Qt.MouseButton.LeftButton, pos=QPoint(int(layout.x(3.0)), int(layout.upper.center().y())))
    QTest.mouseRelease(plot, Qt.MouseButton.LeftButton, pos=QPoint(int(layout.x(3.0)), int(layout.upper.center().y())))
    assert state.time == pytest.approx(3.0, abs=layout.time(1.0) - layout.time(0.0) + 0.02)
    plot.zoom(4.0, 3.0)
    begin, end = plot.layout_now.begin, plot.layout_now.end
    assert begin < 3.0 < end
    assert end - begin == pytest.approx((layout.end - layout.begin) / 4.0)
    plot.grab()
    plot.show_all()
    assert plot.layout_now.begin == 0.0
    pop = state.pops[0]
    found = plot.pop_at(QPointF(plot.layout_now.x(pop.time), 8.0))
    assert found is not None
    assert abs(found.time - pop.time) < layout.time(8.0) - layout.time(0.0)
    assert plot._tip(found)


def test_needle_is_the_chosen_normal(walked: WalkPart, qtbot: QtBot) -> None:
    """The probe's needle decides which normal is plotted besides the axes."""
    regions = walked.regions
    regions.set_view(regions.view.replaced(azimuth=90.0, elevation=0.0))
    _wait(walked, qtbot)
    walk = walked.state.walk
    assert walk is not None
    assert walk.options.normal == pytest.approx(regions.view.normal(1))
    assert walk.ao[Variant.RAW][:, CHOSEN] == pytest.approx(walk.ao[Variant.RAW][:, 0], abs=1e-5)


def test_table_is_written(walked: WalkPart, qtbot: QtBot, tmp_path: Path) -> None:
    """The CSV has a row a frame with the columns of the command line."""
    target = tmp_path / "walk.csv"
    walked.export_csv(target)
    qtbot.waitUntil(target.exists, timeout=PATIENCE_MS)
    with target.open() as file:
        rows = list(csv.DictReader(file))
    assert walked.state.walk is not None
    assert len(rows) == len(walked.state.walk)
    assert set(rows[0]) >= {"time_s", "x", "y", "z", "region", "raw", "regularised", "blended", "spatial", "truth"}


def test_bad_path_is_refused_in_a_line(part: WalkPart, qtbot: QtBot, tmp_path: Path) -> None:
    """What is no path says so in the banner and changes nothing."""
    path = tmp_path / "bad.json"
    path.write_text("[[1, 2]]")
    with qtbot.waitSignal(part.live.failed, timeout=PATIENCE_MS) as failed:
        part.live.read_file(path)
    assert "point 0 is not three numbers" in failed.args[1]
    assert part.state.path is None


def test_result_without_regions_has_no_walk(walked: WalkPart, qtbot: QtBot, result_folder: Path) -> None:
    """Another result takes path, figure and curves away, and greys the menu."""
    walked.bench.controller.open(result_folder)
    qtbot.waitUntil(lambda: walked.regions.regions is None, timeout=PATIENCE_MS)
    settle()
    assert walked.state.walk is None
    assert not walked.bench.registry["walk-tour"].isEnabled()
    assert not walked.bench.area.main._shapes["walk figure"].actor.GetVisibility()
    walked.list.plot.grab()
