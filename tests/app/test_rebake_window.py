"""Edits in the window, and rebakes that follow them: what is in view, on disk and on the undo stack."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PyQt6.QtCore import QEvent, QPointF, Qt
from PyQt6.QtGui import QMouseEvent
from pytestqt.qtbot import QtBot

from app.parts.faces import FacesPart
from app.parts.placing import PlacingPart
from app.parts.rebake import RebakePart
from app.viewport import Viewport
from app.window import Window
from bake.pipeline import BakeRequest, run_bake
from bake.results import load_result
from bake.scene.side_file_writer import edit_side_file
from viewer.gizmo import Motion
from viewer.picture import picture_matrix

PATIENCE_MS = 180_000

pytestmark = pytest.mark.gui


def _wait(qtbot: QtBot, condition: Callable[[], bool]) -> None:
    qtbot.waitUntil(condition, timeout=PATIENCE_MS)


def _select(window: Window, qtbot: QtBot, path: str) -> None:
    document = window.document
    assert document.world is not None
    document.select(document.world.object_paths.index(path))
    window.bench.show_panel("Object")
    _wait(qtbot, lambda: document.current is not None and document.current.scene is not None)


def _move(window: Window, qtbot: QtBot, x: float) -> None:
    before = None if window.document.current is None else window.document.current.files
    window.part(PlacingPart).place_by(Motion((x, 0.0, 0.0)))
    _wait(qtbot, lambda: window.document.current is not None and window.document.current.files != before)


def _centre(window: Window, path: str) -> np.ndarray:
    world = window.document.world
    assert world is not None
    index = world.object_paths.index(path)
    own = world.positions[world.first_vertex[index] : world.first_vertex[index + 1]]
    return own.mean(axis=0) + world.origin


def _rebake(window: Window, qtbot: QtBot, name: str = "rebake") -> None:
    assert window.actions_by_id[name].isEnabled(), window.bench.registry.why_disabled(name)
    with qtbot.waitSignal(window.controller.bake_ended, timeout=PATIENCE_MS) as ended:
        window.actions_by_id[name].trigger()
    assert ended.args == [True]
    _settle(window, qtbot)


def _settle(window: Window, qtbot: QtBot) -> None:
    _wait(qtbot, lambda: window.controller.is_idle and not window.bench.jobs.is_busy)
    qtbot.wait(50)
    _wait(qtbot, lambda: window.controller.is_idle and not window.bench.jobs.is_busy)


def _stale(window: Window) -> frozenset[str]:
    assert window.document.current is not None
    return window.document.current.stale


def test_a_moved_object_is_elsewhere_and_stale_at_once(opened: Window, qtbot: QtBot) -> None:
    """The drag shows it, the side file keeps it, undo takes it back to the bit."""
    _select(opened, qtbot, "Crate")
    world = opened.document.world
    assert world is not None
    before, positions = _centre(opened, "Crate"), np.array(world.positions)
    _move(opened, qtbot, 0.5)
    _wait(qtbot, lambda: _stale(opened) == {"Crate"})
    np.testing.assert_allclose(_centre(opened, "Crate") - before, [0.5, 0.0, 0.0], atol=1e-9)
    assert opened.document.result is not None, "values stay in view"
    opened.actions_by_id["undo"].trigger()
    _wait(qtbot, lambda: not _stale(opened))
    assert opened.document.world is not None
    np.testing.assert_array_equal(opened.document.world.positions, positions)


def test_an_arrow_is_dragged(opened: Window, qtbot: QtBot) -> None:
    """The object follows the cursor; Escape takes the drag back, letting go writes it."""
    _select(opened, qtbot, "Crate")
    opened.actions_by_id["frame"].trigger()
    opened.actions_by_id["move-tool"].trigger()
    qtbot.wait(600)
    part, viewport = opened.part(PlacingPart), opened.area.main
    gizmo = part.tool._gizmo()
    assert gizmo is not None
    assert opened.document.world is not None
    start = _pixel(viewport, gizmo.centre + 0.9 * gizmo.size * np.array((1.0, 0.0, 0.0)))
    end = _pixel(viewport, gizmo.centre + (0.9 * gizmo.size + 0.5) * np.array((1.0, 0.0, 0.0)))
    before, files = _centre(opened, "Crate"), opened.document.current
    assert part.tool.press(_mouse(start))
    part.tool.move(_mouse(end))
    assert part.tool.label.text().endswith("along X")
    opened.actions_by_id["cancel"].trigger()
    assert not part.tool.is_dragging
    assert opened.document.current is files
    assert part.tool.press(_mouse(start))
    part.tool.move(_mouse(end))
    part.tool.release(_mouse(end))
    _wait(qtbot, lambda: _stale(opened) == {"Crate"})
    np.testing.assert_allclose(_centre(opened, "Crate") - before, [0.5, 0.0, 0.0], atol=0.02)
    assert not part.tool.press(_mouse(QPointF(3.0, 3.0))), "the camera's drags stay its own"


def _pixel(viewport: Viewport, point: np.ndarray) -> QPointF:
    matrix = np.array(picture_matrix(viewport.camera, viewport.view.aspect)).reshape(4, 4)
    x, y, _, w = matrix @ np.append(point, 1.0)
    return QPointF(
        (x / w + 1.0) / 2.0 * viewport.view.width() - 0.5, (1.0 - y / w) / 2.0 * viewport.view.height() - 0.5
    )


def _mouse(place: QPointF) -> QMouseEvent:
    button = Qt.MouseButton.LeftButton
    return QMouseEvent(QEvent.Type.MouseMove, place, place, button, button, Qt.KeyboardModifier.NoModifier)


def test_copies_come_and_go(opened: Window, qtbot: QtBot) -> None:
    """A duplicate is an object of its own, selected, without values; deleting it leaves nothing."""
    document = opened.document
    _select(opened, qtbot, "Crate")
    assert document.world is not None
    count = document.world.object_count
    opened.actions_by_id["duplicate"].trigger()
    _wait(qtbot, lambda: document.world is not None and document.world.object_count == count + 1)
    assert document.world.object_paths[-1] == "Crate_copy"
    assert document.selection == (count,)
    assert document.current is not None
    assert document.current.new == {"Crate_copy"}
    assert document.field is not None
    assert np.isnan(document.field.ao[document.world.first_vertex[count] :]).all()
    _rebake(opened, qtbot)
    assert document.result is not None
    assert document.result.world.object_paths[-1] == "Crate_copy"
    assert document.selection == (count,), "the selection outlives the rebake"
    opened.actions_by_id["delete"].trigger()
    _wait(qtbot, lambda: document.current is not None and document.current.gone == {"Crate_copy"})
    assert document.absent()[count]


def test_a_deleted_object_is_hidden_and_can_come_back(opened: Window, qtbot: QtBot) -> None:
    """Objects of the file are ignored from then on, and not drawn."""
    document = opened.document
    _select(opened, qtbot, "Crate")
    opened.actions_by_id["delete"].trigger()
    _wait(qtbot, lambda: document.absent().any())
    assert document.face_visible() is not None
    opened.actions_by_id["bring-back"].trigger()
    _wait(qtbot, lambda: not document.absent().any())


def test_a_rebake_equals_a_bake(opened: Window, qtbot: QtBot) -> None:
    """What is stored after a move is what a bake of the moved level stores, within the bound; one step undoes it."""
    document = opened.document
    assert document.result is not None
    assert document.result_path is not None
    before = np.array(document.result.field.ao)
    _select(opened, qtbot, "Crate")
    _move(opened, qtbot, 0.5)
    _wait(qtbot, lambda: _stale(opened) == {"Crate"})
    _rebake(opened, qtbot)
    _wait(qtbot, lambda: not _stale(opened))
    rebaked = load_result(document.result_path)
    assert document.scene_path is not None
    steps = run_bake(
        BakeRequest(document.scene_path, document.result_path.with_name("whole"), rebaked.settings.to_json())
    )
    for _ in steps:
        pass
    whole = load_result(document.result_path.with_name("whole"))
    assert rebaked.world.object_hash == whole.world.object_hash
    assert np.nanmax(np.abs(rebaked.field.ao - whole.field.ao)) <= 2.0 / 255.0
    assert not np.allclose(rebaked.field.ao, before, equal_nan=True)
    assert not document.is_preview
    opened.actions_by_id["undo"].trigger()
    _settle(opened, qtbot)
    assert document.result is not None
    np.testing.assert_array_equal(document.result.field.ao, before)
    _wait(qtbot, lambda: _stale(opened) == {"Crate"})


def test_every_change_is_followed_at_once(opened: Window, qtbot: QtBot) -> None:
    """With the toggle on, edits are rebaked without being asked; the last of several counts."""
    part, document = opened.part(RebakePart), opened.document
    _select(opened, qtbot, "Crate")
    opened.actions_by_id["rebake-at-once"].trigger()
    for _ in range(3):
        _move(opened, qtbot, 0.2)
    _wait(qtbot, lambda: document.current is not None and document.current.is_fresh and not part.rebaker.is_busy)
    assert document.result is not None
    _settle(opened, qtbot)
    index = document.result.world.object_paths.index("Crate")
    own = slice(*document.result.world.first_vertex[index : index + 2])
    x = float(np.mean(document.result.world.positions[own, 0])) + float(document.result.world.origin[0])
    assert x == pytest.approx(4.6)


def test_a_killed_engine_leaves_what_was_there(opened: Window, qtbot: QtBot) -> None:
    """In the middle of a rebake: the last values come back, the result on disk is whole, and a rebake works again."""
    part, document = opened.part(RebakePart), opened.document
    _select(opened, qtbot, "Crate")
    _move(opened, qtbot, 0.5)
    _wait(qtbot, lambda: _stale(opened) == {"Crate"})
    opened.actions_by_id["rebake"].trigger()
    assert part.rebaker.is_busy
    assert opened.engine.pid is not None
    with qtbot.waitSignal(opened.engine.crashed, timeout=PATIENCE_MS):
        os.kill(opened.engine.pid, signal.SIGKILL)
    assert not part.rebaker.is_busy
    assert not document.is_preview
    assert document.result_path is not None
    load_result(document.result_path)
    _rebake(opened, qtbot)
    _wait(qtbot, lambda: document.current is not None and document.current.is_fresh)


def test_part_of_a_layer_is_rejected(opened: Window, qtbot: QtBot) -> None:
    """The chosen objects get their former values, on disk too, and are stale; the rest keeps the new ones."""
    document = opened.document
    assert document.result is not None
    before = np.array(document.result.field.ao)
    _select(opened, qtbot, "Crate")
    _move(opened, qtbot, 1.0)
    _wait(qtbot, lambda: _stale(opened) == {"Crate"})
    _rebake(opened, qtbot)
    after = np.array(document.result.field.ao)
    world = document.result.world
    ground = world.object_paths.index("Ground")
    own = slice(*world.first_vertex[ground : ground + 2])
    assert not np.array_equal(after[own], before[own])
    _select(opened, qtbot, "Ground")
    _rebake(opened, qtbot, "layer-reject")
    assert document.result is not None
    np.testing.assert_array_equal(document.result.field.ao[own], before[own])
    rest = np.ones(len(after), bool)
    rest[own] = False
    np.testing.assert_array_equal(document.result.field.ao[rest], after[rest])
    _wait(qtbot, lambda: _stale(opened) == {"Ground"})
    _rebake(opened, qtbot)
    assert document.result is not None
    np.testing.assert_allclose(document.result.field.ao, after, atol=2.0 / 255.0)
    _wait(qtbot, lambda: not _stale(opened))


def test_smoothing_alone_traces_no_ray(opened: Window, qtbot: QtBot) -> None:
    """With the toggle on, another alpha in the Bake panel is followed at once, from the stored samples."""
    part, document = opened.part(RebakePart), opened.document
    assert document.result is not None
    before = np.array(document.result.field.ao)
    reports = []
    part.rebaker.done.connect(lambda done: reports.append(done.report))
    opened.actions_by_id["rebake-at-once"].trigger()
    with qtbot.waitSignal(opened.controller.bake_ended, timeout=PATIENCE_MS) as ended:
        opened.panels.bake.form.editor("alpha").set_value(0.5)
        opened.panels.bake.form.changed.emit()
    assert ended.args == [True]
    assert reports[-1].rays_traced == 0
    assert document.result is not None
    assert document.result.settings.alpha == 0.5
    assert not np.allclose(document.result.field.ao, before, equal_nan=True)


def test_an_older_result_is_shown_as_stale(opened: Window, qtbot: QtBot) -> None:
    """A scene that was edited since its bake opens with the values it has, and says what is stale."""
    document = opened.document
    assert document.result is not None
    path, before = document.scene_path, np.array(document.result.field.ao)
    assert path is not None
    edit_side_file(path, {"Crate": {"translate": [0.3, 0.0, 0.0]}})
    opened.controller.open(path)
    _wait(qtbot, lambda: document.result is None)
    _wait(qtbot, lambda: document.result is not None and document.current is not None)
    np.testing.assert_array_equal(document.result.field.ao, before)
    _wait(qtbot, lambda: _stale(opened) == {"Crate"})
    _settle(opened, qtbot)
    _rebake(opened, qtbot)
    _wait(qtbot, lambda: not _stale(opened))


def test_chosen_triangles_are_rebaked_alone(opened: Window, qtbot: QtBot) -> None:
    """A box in the view chooses what is seen in it; only values there change, the rest of the object is stale."""
    part, document = opened.part(FacesPart), opened.document
    _select(opened, qtbot, "Ground")
    opened.actions_by_id["frame"].trigger()
    qtbot.wait(500)
    part._choose(np.array([(-0.9, -0.9), (0.1, -0.9), (0.1, 0.9), (-0.9, 0.9)]), 0)
    _wait(qtbot, lambda: bool(part.chosen.any()))
    world = document.world
    assert world is not None
    assert "Ground" in part.by_object()
    assert not part.chosen.all()
    seen = np.unique(world.faces[part.chosen])
    assert document.result is not None
    before = np.array(document.result.field.ao)
    _select(opened, qtbot, "Crate")
    _move(opened, qtbot, -1.0)
    _wait(qtbot, lambda: "Crate" in _stale(opened))
    _rebake(opened, qtbot, "rebake-faces")
    assert document.result is not None
    after = document.result.field.ao
    changed = np.flatnonzero((np.abs(after - before) > 1e-6).any(axis=1))
    assert len(changed)
    assert set(changed) <= set(seen)
    part.clear()
    assert not part.by_object()


@pytest.mark.slow
def test_two_hundred_edits_leave_nothing_behind(opened: Window, qtbot: QtBot) -> None:
    """Edit after edit with rebakes at once: memory of window and engine grows by less than a twentieth."""
    part = opened.part(RebakePart)
    _select(opened, qtbot, "Crate")
    opened.actions_by_id["rebake-at-once"].trigger()

    def resident() -> tuple[float, float]:
        pages = os.sysconf("SC_PAGE_SIZE")
        sizes = [Path(f"/proc/{pid}/statm").read_text().split()[1] for pid in (os.getpid(), opened.engine.pid)]
        return int(sizes[0]) * pages / 1e6, int(sizes[1]) * pages / 1e6

    def followed() -> bool:
        current = opened.document.current
        return current is not None and current.is_fresh and not part.rebaker.is_busy

    warm = (0.0, 0.0)
    for number in range(200):
        _move(opened, qtbot, 0.3 if number % 2 else -0.3)
        _wait(qtbot, followed)
        if number == 40:  # all that is kept once is there: the layers, the session, compiled kernels
            warm = resident()
    for before, after in zip(warm, resident(), strict=True):
        assert after < 1.05 * before, (warm, resident())


@pytest.mark.parametrize("seed", [1, 2])
def test_rebakes_cancelled_and_killed_at_random(opened: Window, qtbot: QtBot, seed: int) -> None:
    """Whenever a rebake is stopped, or its process dies, view and disk agree on a state, and the next one is right."""
    part, document, random = opened.part(RebakePart), opened.document, np.random.default_rng(seed)
    _select(opened, qtbot, "Crate")
    path = document.result_path
    assert path is not None
    for number in range(6):
        _move(opened, qtbot, float(random.uniform(-0.4, 0.4)))
        opened.actions_by_id["rebake"].trigger()
        qtbot.wait(int(random.choice([0, 30, 80, 200, 500, 900]) * random.uniform(0.5, 1.5)))
        if number % 3 == 2 and part.rebaker.is_busy and opened.engine.pid is not None:
            with qtbot.waitSignal(opened.engine.crashed, timeout=PATIENCE_MS):
                os.kill(opened.engine.pid, signal.SIGKILL)
        else:
            part.rebaker.cancel()
        assert not part.rebaker.is_busy
        assert opened.isVisible()
        _settle(opened, qtbot)
        stored = load_result(path)  # all of it is verified
        assert document.result is not None
        assert not document.is_preview
        np.testing.assert_array_equal(document.result.field.ao, stored.field.ao)
    if document.current is None or not document.current.is_fresh:
        _rebake(opened, qtbot)
    _wait(qtbot, lambda: document.current is not None and document.current.is_fresh)
    assert document.scene_path is not None
    whole = path.parent / "whole"
    for _ in run_bake(BakeRequest(document.scene_path, whole, document.result.settings.to_json())):
        pass
    difference = np.abs(document.result.field.ao - load_result(whole).field.ao)
    assert np.nanmax(difference) <= 2.0 / 255.0
