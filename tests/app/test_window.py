"""The window on the real engine: open, look, read values, bake, compare, survive."""

from __future__ import annotations

import logging
import os
import shutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import bake_doubles
import numpy as np
import pytest
from PyQt6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PyQt6.QtGui import QDropEvent, QImage, QKeySequence
from PyQt6.QtTest import QTest
from PyQt6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from app.engine import EngineState
from app.parts.files import FilesPart
from app.parts.help import HelpPart
from app.recent_files import recent_files
from app.window import Window
from bake.settings import MappingKind
from bake.solve import map_to_vertices
from bake.types import BakeResult, VertexState
from viewer.display import Display
from viewer.fields import Quantity
from viewer.picking import Pick
from viewer.probe import read_out

PATIENCE_MS = 180_000
LEFT = Qt.MouseButton.LeftButton

pytestmark = pytest.mark.gui


def _wait(qtbot: QtBot, condition: Callable[[], bool]) -> None:
    qtbot.waitUntil(condition, timeout=PATIENCE_MS)


def _look_at(window: Window, path: str) -> QPoint:
    """Frames an object and returns where its middle is in the view."""
    window.commands.select_path(path)
    bounds = window.document.object_bounds(window.document.selected)
    assert bounds is not None
    window.area.main.frame(*bounds, fly=False)
    view = window.area.main.view
    return QPoint(view.width() // 2, view.height() // 2)


def test_scene_is_shown_and_waits_for_the_bake_button(window: Window, qtbot: QtBot, level: Path) -> None:
    """Opening a scene shows its geometry, objects and findings, and starts nothing."""
    assert window.area.main.hint.isVisible()
    window.controller.open(level)
    _wait(qtbot, lambda: window.document.world is not None and window.controller.is_idle)
    assert not window.area.main.hint.isVisible()
    assert window.document.result is None
    assert not window.engine.is_baking
    assert window.windowTitle() == "small.obj — Obscura"
    assert window.panels.outliner.name_of(0) == "Ground"
    assert recent_files(window.store) == [level.resolve()]
    assert window.panels.bake._bake.isEnabled()


def test_bake_by_button_shows_the_result_and_is_found_again(
    make_window: Callable[..., Window], qtbot: QtBot, level: Path
) -> None:
    """The Bake button bakes in the engine; the next window that opens the scene shows that result at once."""
    window = make_window()
    window.controller.open(level)
    _wait(qtbot, lambda: window.document.world is not None and window.controller.is_idle)
    window.panels.bake.form.editor("rays").set_value(4)
    window.panels.bake.request_bake()
    assert window.progress.isVisible()
    assert not window.panels.bake._bake.isEnabled()
    _wait(qtbot, lambda: window.document.result is not None)
    result = window.document.result
    assert result is not None
    assert result.settings.rays == 4
    assert not window.progress.isVisible()
    assert window.panels.stages.view.proxy.rowCount() == len(result.stages)
    window.panels.bake.request_bake()
    _wait(qtbot, lambda: "Nothing had changed" in window.banner.text())

    second = make_window()
    second.controller.open(level)
    _wait(qtbot, lambda: second.document.result is not None)
    assert second.document.result is not None
    assert second.document.result.settings.rays == 4
    assert second.panels.bake.settings() == result.settings


def test_hover_reads_exact_values(shown: Window, qtbot: QtBot, baked: BakeResult) -> None:
    """The strip has the values of the arrays at the point under the cursor, and follows the cursor."""
    middle = _look_at(shown, "Crate")
    view = shown.area.main.view
    with qtbot.waitSignal(shown.area.main.hovered):
        QTest.mouseMove(view, middle)
    pick = shown.area.main.pick_at(QPointF(middle))
    assert pick is not None
    expected = read_out(baked.world, pick, baked)
    corners = np.asarray(baked.world.faces[pick.face])
    np.testing.assert_allclose(expected.ao, np.array(pick.barycentric) @ baked.field.ao[corners], rtol=1e-6)
    assert shown.strip.text().startswith("Crate  static")
    for value in expected.ao:
        assert f"{value:.4f}" in shown.strip.text()
    with qtbot.waitSignal(shown.area.main.hovered):
        view.mouse_left.emit()
    assert shown.strip.text() == ""


def test_pick_agrees_with_the_picture(shown: Window) -> None:
    """Where the picture shows background nothing is picked, and the other way round."""
    _look_at(shown, "Crate")
    main = shown.area.main
    shown.commands.frame_all()
    main.navigation.stop()
    main.frame(*(np.asarray(f(axis=0)) for f in (baked_positions(shown).min, baked_positions(shown).max)), fly=False)
    image = main.view.grabFramebuffer()
    background = image.pixelColor(2, 2).getRgb()
    agreements = []
    for x in range(20, main.view.width() - 20, 45):
        for y in range(20, main.view.height() - 120, 45):
            drawn = image.pixelColor(x, y).getRgb() != background
            agreements.append(drawn == (main.pick_at(QPointF(x, y)) is not None))
    assert np.mean(agreements) > 0.97  # a pixel on a silhouette may fall either way


def baked_positions(window: Window) -> np.ndarray:
    """The positions in view."""
    assert window.document.world is not None
    return np.asarray(window.document.world.positions)


def test_click_pins_and_selects_and_the_background_lets_go(shown: Window, qtbot: QtBot) -> None:
    """A click keeps the point's readout and selects its object everywhere."""
    middle = _look_at(shown, "Crate")
    shown.document.select(-1)
    QTest.mouseClick(shown.area.main.view, LEFT, pos=middle)
    document = shown.document
    assert document.pinned is not None
    assert document.pinned.object == "Crate"
    assert document.world is not None
    assert document.world.object_paths[document.selected] == "Crate"
    assert shown.panels.outliner.is_chosen(document.selected)
    assert shown.panels.probe.view.proxy.rowCount() >= 5
    shown.panels.probe._copy()
    clipboard = QApplication.clipboard()
    assert clipboard is not None
    assert "Object: Crate" in clipboard.text()
    shown.readouts.click(None)
    assert document.pinned is None
    assert document.selected == -1


def test_tables_follow_the_selection(shown: Window) -> None:
    """What is selected in view or list is selected in the findings too, without ending a selection of several."""
    document, findings = shown.document, shown.panels.findings
    assert document.world is not None
    named = [finding.object for finding in document.findings if finding.object in document.world.object_paths]
    assert named
    chosen = document.world.object_paths.index(named[0])
    other = (chosen + 1) % document.world.object_count
    document.select_all((chosen, other), chosen)
    row = findings.view.chosen()
    assert row is not None
    assert row[1].text == named[0]
    assert len(document.selection) == 2
    document.select(-1)
    assert findings.view.chosen() is None


def test_orbit_pan_and_zoom_by_mouse(shown: Window, qtbot: QtBot) -> None:
    """A drag is no click; the wheel zooms at the cursor; keys of a flight are not the window's."""
    view, navigation = shown.area.main.view, shown.area.main.navigation
    middle = _look_at(shown, "Ground")
    before = navigation.camera
    QTest.mousePress(view, LEFT, pos=middle)
    QTest.mouseMove(view, middle + QPoint(60, 10))
    QTest.mouseRelease(view, LEFT, pos=middle + QPoint(60, 10))
    assert navigation.camera.azimuth != before.azimuth
    assert navigation.camera.focal == before.focal
    assert shown.document.pinned is None
    QTest.mousePress(view, Qt.MouseButton.MiddleButton, pos=middle)
    QTest.mouseMove(view, middle + QPoint(60, 10))
    QTest.mouseRelease(view, Qt.MouseButton.MiddleButton, pos=middle)
    assert navigation.camera.focal != before.focal
    nearer = navigation.camera
    view.wheel_turned.emit(QPointF(middle), 2.0)
    assert navigation.camera.distance < nearer.distance
    QTest.mousePress(view, Qt.MouseButton.RightButton, pos=middle)
    eye = navigation.camera.eye
    QTest.keyPress(view, Qt.Key.Key_Q)
    qtbot.wait(120)
    QTest.keyRelease(view, Qt.Key.Key_Q)
    QTest.mouseRelease(view, Qt.MouseButton.RightButton, pos=middle)
    assert shown.isVisible()
    assert navigation.camera.eye[1] < eye[1]


def test_display_choices_reach_the_picture(shown: Window) -> None:
    """Distance, range, colours and 5 bits change the colours that are drawn, and only by way of the document."""
    document, surface = shown.document, shown.area.main._surface
    assert surface is not None
    result = document.result
    assert result is not None
    document.set_display(Display(quantity=Quantity.DISTANCE, column=0))
    np.testing.assert_array_equal(surface.colors[:, 0], np.floor(result.field.ao[:, 0] * 255 + 0.5).astype(np.uint8))
    shown.panels.display._on_range(0.25, 0.5)
    clamped = np.clip((result.field.ao[:, 0] - 0.25) * 1020 + 0.5, 0, 255).astype(np.uint8)
    assert np.abs(surface.colors[:, 0].astype(int) - clamped).max() <= 1
    assert shown.panels.display.range.value_range() == (0.25, 0.5)
    shown.actions_by_id["next-distance"].trigger()
    assert document.display.column == 1
    shown.actions_by_id["game"].trigger()
    assert document.display.game
    assert shown.panels.display.game.isChecked()
    scale = shown.area.main.legend.scale
    assert scale is not None
    assert "5 bits" in scale.note
    shown.actions_by_id["geometry"].trigger()
    assert document.shown() is None
    assert not shown.area.main.legend.isVisible()


def test_threshold_moves_without_tracing(shown: Window, qtbot: QtBot, baked: BakeResult) -> None:
    """The slider's counts and values are those of the stored samples at the new threshold; nothing is stored."""
    panel, document = shown.panels.overlays, shown.document
    shown.actions_by_id["invalid"].trigger()
    panel._slider.setValue(600)
    assert document.threshold == 0.6
    invalid = int((~baked.tally.valid(0.6)).sum())
    assert f"{invalid:,} of {len(baked.samples):,} samples invalid" in panel._counts.text()
    _wait(qtbot, lambda: document.is_preview)
    settings = baked.settings.replaced(back_face_threshold=0.6)
    expected = map_to_vertices(baked.world, baked.samples, baked.tally.ao, baked.tally.valid(0.6), settings)
    assert document.field is not None
    np.testing.assert_allclose(document.field.ao, expected.ao, atol=1.0 / 1024.0)
    np.testing.assert_array_equal(document.field.state, expected.state)
    scale = shown.area.main.legend.scale
    assert scale is not None
    assert "not stored" in scale.note
    filled = int((expected.state == VertexState.FILLED).sum())
    assert f"{filled:,} vertices filled" in panel._counts.text()
    shown.panels.overlays._keep.click()
    settings_in_form = shown.panels.bake.settings()
    assert settings_in_form is not None
    assert settings_in_form.back_face_threshold == 0.6
    panel._reset.click()
    assert not document.is_preview
    assert document.threshold == baked.settings.back_face_threshold


def test_mappings_side_by_side(shown: Window, qtbot: QtBot, baked: BakeResult) -> None:
    """The other mapping is solved and shown beside the first on one camera, and their difference can be shown."""
    document, area = shown.document, shown.area
    shown.actions_by_id["compare"].trigger()
    assert area.other is not None
    _wait(qtbot, lambda: document.other is not None)
    settings = baked.settings.replaced(mapping=MappingKind.AVERAGE)
    valid = baked.tally.valid(settings.back_face_threshold)
    expected = map_to_vertices(baked.world, baked.samples, baked.tally.ao, valid, settings)
    assert document.other is not None
    np.testing.assert_array_equal(document.other.ao, expected.ao)
    assert "Least squares" in area.main.caption.text()
    assert "Weighted average" in area.other.caption.text()
    area.main.navigation.set_camera(area.main.camera.orbited(0.3, 0.1))
    assert area.other.camera == area.main.camera
    area.other.navigation.set_camera(area.other.camera.orbited(0.2, 0.0))
    assert area.other.camera == area.main.camera
    document.set_display(document.display.replaced(quantity=Quantity.DIFFERENCE))
    difference = document.shown()
    assert difference is not None
    np.testing.assert_allclose(difference.values, baked.field.ao[:, 0] - expected.ao[:, 0])
    assert shown.area.picture().width() > area.main.picture().width()
    shown.actions_by_id["compare"].trigger()
    assert area.other is None
    assert not area.main.caption.isVisible()


def test_hidden_objects_are_neither_drawn_nor_picked(shown: Window, qtbot: QtBot) -> None:
    """Unticking an object in the list takes it out of the picture and out of the cursor's way."""
    middle = _look_at(shown, "Crate")
    index = shown.document.selected
    shown.panels.outliner.toggle(index)
    assert not shown.document.visible[index]
    shown.picker.finish()
    pick = shown.area.main.pick_at(QPointF(middle))
    world = shown.document.world
    assert world is not None
    assert pick is None or world.face_object[pick.face] != index


def test_cancel_answers_and_keeps_the_window(
    make_window: Callable[..., Window], qtbot: QtBot, result_folder: Path
) -> None:
    """Cancel says so at once, ends the bake, and leaves result and window as they were."""
    window = make_window(bake_doubles.hanging)
    window.controller.open(result_folder)
    _wait(qtbot, lambda: window.document.result is not None)
    before = window.document.result
    window.panels.bake.request_bake()
    _wait(qtbot, lambda: window.engine.state is EngineState.BUSY)
    qtbot.mouseClick(window.progress._cancel, LEFT)
    assert "Cancelling" in window.progress._stage.text()
    _wait(qtbot, lambda: "Cancelled" in window.banner.text())
    assert not window.progress.isVisible()
    assert window.panels.bake._bake.isEnabled()
    assert window.document.result is before


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_window_survives_its_engine(make_window: Callable[..., Window], qtbot: QtBot, result_folder: Path) -> None:
    """kill -9 of the engine in a bake leaves the window alive, with a message, and able to bake again."""
    window = make_window(bake_doubles.endless)
    window.controller.open(result_folder)
    _wait(qtbot, lambda: window.document.result is not None)
    window.panels.bake.request_bake()
    _wait(qtbot, lambda: window.engine.state is EngineState.BUSY)
    assert window.engine.pid is not None
    os.kill(window.engine.pid, signal.SIGKILL)
    _wait(qtbot, lambda: "SIGKILL" in window.banner.text())
    assert window.banner.level == logging.ERROR
    assert "SIGKILL" in window.panels.log.text()
    assert window.document.result is not None
    _wait(qtbot, lambda: window.engine.state is EngineState.IDLE)
    window.panels.bake.request_bake()
    _wait(qtbot, lambda: window.engine.state is EngineState.BUSY)


@pytest.mark.parametrize("name", ["missing.glb", "broken.glb", "folder"])
def test_what_cannot_be_opened_is_said_in_a_line(shown: Window, qtbot: QtBot, tmp_path: Path, name: str) -> None:
    """A bad file leaves what was open and shows one readable line, in banner and log."""
    path = tmp_path / name
    if name == "broken.glb":
        path.write_bytes(b"glTF\x02\x00\x00\x00 and then nothing")
    elif name == "folder":
        path.mkdir()
    before = shown.document.result
    shown.controller.open(path)
    _wait(qtbot, lambda: shown.banner.isVisible())
    assert name in shown.banner.text()
    assert "\n" not in shown.banner.text()
    assert shown.document.result is before
    assert not shown.progress.isVisible()
    qtbot.mouseClick(shown.banner.findChild(type(shown.panels.probe._buttons[0])), LEFT)
    assert name in shown.panels.log.text()


def test_dropped_result_is_opened(window: Window, qtbot: QtBot, result_folder: Path) -> None:
    """A result folder dropped on the window is shown."""
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(result_folder))])
    event = QDropEvent(QPointF(50, 50), Qt.DropAction.CopyAction, data, LEFT, Qt.KeyboardModifier.NoModifier)
    window.dropEvent(event)
    _wait(qtbot, lambda: window.document.result is not None)
    assert window.windowTitle() == "small.obj — Obscura"


def test_damaged_result_is_named(window: Window, qtbot: QtBot, result_folder: Path, tmp_path: Path) -> None:
    """A damaged file of a result is named, not shown."""
    copy = tmp_path / "damaged"
    shutil.copytree(result_folder, copy)
    victim = max(copy.rglob("*.npy"), key=lambda path: path.stat().st_size)
    data = bytearray(victim.read_bytes())
    data[-1] ^= 0xFF
    victim.write_bytes(bytes(data))
    window.controller.open(copy)
    _wait(qtbot, lambda: window.banner.isVisible())
    assert victim.name in window.banner.text()
    assert window.document.result is None


def test_picture_has_view_and_legend(shown: Window, tmp_path: Path) -> None:
    """A saved picture is what the view shows, legend included."""
    size, legend = shown.area.main.view.size(), shown.area.main.legend
    shown.part(FilesPart).save_picture(tmp_path / "view.png")
    image = QImage(str(tmp_path / "view.png"))
    assert image.size() == size
    corner = image.pixelColor(legend.x() + 20, size.height() - 16)
    assert corner.lightness() < 90
    shown.part(FilesPart).save_picture(tmp_path / "missing" / "view.png")
    assert "could not be written" in shown.banner.text()


def test_result_is_saved_elsewhere(shown: Window, qtbot: QtBot, tmp_path: Path) -> None:
    """Save result as copies the folder; the copy opens like the original."""
    shown.controller.save_result_as(tmp_path / "mine")
    _wait(qtbot, lambda: "saved" in shown.banner.text())
    shown.controller.open(tmp_path / "mine")
    _wait(qtbot, lambda: shown.document.result_path == (tmp_path / "mine").resolve())


def test_up_axis_and_back_faces(shown: Window) -> None:
    """Z can be up; hidden back faces are not picked either."""
    shown.actions_by_id["up-z"].trigger()
    assert shown.area.main.camera.up_axis == 2
    assert shown.actions_by_id["up-z"].isChecked()
    assert not shown.actions_by_id["up-y"].isChecked()
    shown.actions_by_id["up-y"].trigger()
    middle = _look_at(shown, "Flipped")
    outside = shown.area.main.pick_at(QPointF(middle))
    shown.actions_by_id["back-faces"].trigger()
    inside = shown.area.main.pick_at(QPointF(middle))
    assert outside is not None
    assert inside is not None
    assert inside.distance > outside.distance


def test_layout_and_habits_come_back(make_window: Callable[..., Window]) -> None:
    """Closed panels and the palette are remembered."""
    first = make_window()
    first.docks["Log"].close()
    first.actions_by_id["dark-palette"].trigger()
    first.close()
    second = make_window()
    assert second.docks["Log"].isHidden()
    assert second.actions_by_id["dark-palette"].isChecked()
    second.actions_by_id["reset-layout"].trigger()
    assert not second.docks["Log"].isHidden()
    second.actions_by_id["dark-palette"].trigger()


def test_every_action_is_described_once(window: Window) -> None:
    """Each action has a tip, no key means two things, and the table of keys has them all."""
    specs, table = window.bench.registry.specs, window.part(HelpPart).keys_text()
    keys = [key for spec in specs for key in spec.keys]
    assert len(keys) == len(set(keys))
    assert set(window.actions_by_id) == {spec.id for spec in specs}
    assert all(spec.tip and not spec.tip.endswith(".") for spec in specs)
    assert all(QKeySequence(key).toString() in table for key in keys)
    assert {"F", "E", "Q"} <= set(keys)


def test_every_control_has_a_tooltip(window: Window) -> None:
    """No control is left without an explanation."""
    from PyQt6.QtWidgets import QAbstractButton, QAbstractSlider, QAbstractSpinBox, QComboBox, QScrollBar

    silent = [
        f"{title}: {type(widget).__name__} {widget.text() if isinstance(widget, QAbstractButton) else ''}"
        for title, holder in {**window.docks, "progress": window.progress, "banner": window.banner}.items()
        for kind in (QAbstractButton, QAbstractSlider, QAbstractSpinBox, QComboBox)
        for widget in holder.findChildren(kind)
        if not isinstance(widget, QScrollBar)
        and type(widget) is not QAbstractButton  # the corner of a table
        and not widget.objectName().startswith(("qt_dockwidget", "qt_toolbar", "ScrollLeft", "ScrollRight"))
        and not (widget.toolTip() or widget.parent().toolTip())
    ]
    assert silent == []


def test_background_pick_is_none(shown: Window) -> None:
    """A ray into the sky hits nothing."""
    origin, direction = np.array([0.0, 50.0, 0.0]), np.array([0.0, 1.0, 0.0])
    found: Pick | None = shown.picker.pick(origin, direction, cull_back_faces=False)
    assert found is None
