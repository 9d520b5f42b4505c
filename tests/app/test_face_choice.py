"""Triangles chosen in the view with the mouse: by box, lasso and brush, added and taken away, undone, carried over."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pytest
from PyQt6.QtCore import QEvent, QPointF, Qt
from PyQt6.QtGui import QMouseEvent
from pytestqt.qtbot import QtBot

from app.face_tool import Outline
from app.parts.faces import FacesPart
from app.window import Window

PATIENCE_MS = 180_000
NONE, SHIFT, CTRL, ALT = (
    Qt.KeyboardModifier.NoModifier,
    Qt.KeyboardModifier.ShiftModifier,
    Qt.KeyboardModifier.ControlModifier,
    Qt.KeyboardModifier.AltModifier,
)

pytestmark = pytest.mark.gui


@pytest.fixture
def faces(opened: Window, qtbot: QtBot) -> FacesPart:
    """The part that chooses, with the ground seen from above."""
    document = opened.document
    assert document.world is not None
    document.select(document.world.object_paths.index("Ground"))
    opened.actions_by_id["frame"].trigger()
    qtbot.wait(500)
    return opened.part(FacesPart)


def _drag(part: FacesPart, places: Iterable[tuple[float, float]], held: Qt.KeyboardModifier = NONE) -> None:
    """A drag of the left button along places given as shares of the picture."""
    view = part.bench.area.main.view
    points = [QPointF(x * view.width(), y * view.height()) for x, y in places]
    for kind, point, signal in (
        (QEvent.Type.MouseButtonPress, points[0], view.mouse_pressed),
        *((QEvent.Type.MouseMove, point, view.mouse_moved) for point in points[1:]),
        (QEvent.Type.MouseButtonRelease, points[-1], view.mouse_released),
    ):
        button = Qt.MouseButton.LeftButton
        signal.emit(QMouseEvent(kind, point, point, button, button, held))


def _wait(qtbot: QtBot, part: FacesPart, condition: Callable[[], bool] = lambda: True) -> np.ndarray:
    jobs = part.bench.jobs
    qtbot.waitUntil(lambda: not jobs.is_busy and not part._busy and condition(), timeout=PATIENCE_MS)
    return part.chosen.copy()


def _take(part: FacesPart, outline: Outline) -> None:
    part.bench.registry[f"faces-{outline.value}"].trigger()
    assert part.tool.outline is outline


LEFT, RIGHT, ALL = ((0.1, 0.1), (0.5, 0.9)), ((0.5, 0.1), (0.9, 0.9)), ((0.02, 0.02), (0.98, 0.98))


def test_a_box_chooses_adds_and_takes_away(faces: FacesPart, qtbot: QtBot) -> None:
    """A plain drag replaces, with Shift it adds, with Ctrl it takes away; each is a step that can be undone."""
    _take(faces, Outline.BOX)
    _drag(faces, LEFT)
    left = _wait(qtbot, faces, lambda: bool(faces.chosen.any()))
    _drag(faces, RIGHT)
    right = _wait(qtbot, faces)
    assert right.any()
    assert not np.array_equal(left, right)
    _drag(faces, LEFT, SHIFT)
    np.testing.assert_array_equal(_wait(qtbot, faces), left | right)
    qtbot.wait(900)  # slower than what is merged
    _drag(faces, RIGHT, CTRL)
    np.testing.assert_array_equal(_wait(qtbot, faces), left & ~right)
    faces.bench.undo.undo()
    np.testing.assert_array_equal(faces.chosen, left | right)
    faces.bench.undo.redo()
    np.testing.assert_array_equal(faces.chosen, left & ~right)


def test_a_lasso_and_a_brush_choose_what_they_cover(faces: FacesPart, qtbot: QtBot) -> None:
    """A lasso along a box chooses as the box does; a wider brush chooses at least what a narrow one does."""
    _take(faces, Outline.BOX)
    _drag(faces, LEFT)
    box = _wait(qtbot, faces, lambda: bool(faces.chosen.any()))
    _take(faces, Outline.LASSO)
    (x0, y0), (x1, y1) = LEFT
    _drag(faces, ((x0, y0), (x1, y0), (x1, y1), (x0, y1)))
    lasso = _wait(qtbot, faces)
    assert (lasso != box).mean() < 0.02, "but for triangles at the rim"
    _take(faces, Outline.BRUSH)
    way = ((0.3, 0.5), (0.5, 0.5), (0.7, 0.5))
    faces.set_radius(5)
    _drag(faces, way)
    narrow = _wait(qtbot, faces)
    assert narrow.any()
    for _ in range(12):
        faces.bench.registry["faces-wider"].trigger()
    assert faces.group.radius.value() > 30
    _drag(faces, way)
    wide = _wait(qtbot, faces)
    assert (wide >= narrow).all()
    assert wide.sum() > narrow.sum()


def test_a_click_chooses_one_triangle(faces: FacesPart, qtbot: QtBot) -> None:
    """The one under the cursor, of which the panel tells; none where nothing lies."""
    _take(faces, Outline.BOX)
    faces.bench.picker.finish()
    _drag(faces, ((0.5, 0.5), (0.5, 0.5)))
    assert _wait(qtbot, faces).sum() == 1
    assert "1</b> triangle of one object" in faces.group._state.text()
    _drag(faces, ((0.005, 0.005), (0.005, 0.005)))
    assert not _wait(qtbot, faces).any()
    assert "None chosen" in faces.group._state.text()


def test_hidden_ones_are_chosen_when_asked_for(faces: FacesPart, qtbot: QtBot) -> None:
    """Both ticks widen the choice: what lies behind others, and what turns its back."""
    _take(faces, Outline.BOX)
    _drag(faces, ALL)
    seen = _wait(qtbot, faces, lambda: bool(faces.chosen.any()))
    faces.group.hidden.setChecked(True)
    _drag(faces, ALL)
    hidden = _wait(qtbot, faces)
    assert (hidden >= seen).all()
    assert hidden.sum() > seen.sum()
    faces.group.front.setChecked(False)
    _drag(faces, ALL)
    assert _wait(qtbot, faces).sum() > hidden.sum()


def test_tools_give_way_to_each_other_and_to_escape(faces: FacesPart, qtbot: QtBot) -> None:
    """One tool at a time; Escape drops the outline, then the tool; with Alt drags are the camera's."""
    registry, view = faces.bench.registry, faces.bench.area.main
    registry["move-tool"].trigger()
    _take(faces, Outline.LASSO)
    assert not registry["move-tool"].isChecked()
    _take(faces, Outline.BOX)
    assert not registry["faces-lasso"].isChecked()
    camera = view.camera
    _drag(faces, LEFT, ALT)
    assert view.camera != camera
    assert not faces.chosen.any()
    point = QPointF(20.0, 20.0)
    button = Qt.MouseButton.LeftButton
    view.view.mouse_pressed.emit(QMouseEvent(QEvent.Type.MouseButtonPress, point, point, button, button, NONE))
    assert faces.tool.is_dragging
    registry["cancel"].trigger()
    assert not faces.tool.is_dragging
    assert faces.tool.outline is Outline.BOX
    view.view.mouse_released.emit(QMouseEvent(QEvent.Type.MouseButtonRelease, point, point, button, button, NONE))
    assert not _wait(qtbot, faces).any()
    registry["cancel"].trigger()
    assert faces.tool.outline is None
    assert not registry["faces-box"].isChecked()
    _take(faces, Outline.BRUSH)
    registry["move-tool"].trigger()
    assert faces.tool.outline is None


def test_a_choice_outlives_a_copy_of_an_object(faces: FacesPart, qtbot: QtBot) -> None:
    """Objects that come change the numbers of triangles; the chosen ones stay the same triangles."""
    document, registry = faces.bench.document, faces.bench.registry
    assert document.world is not None
    document.select(document.world.object_paths.index("Ground"))
    registry["faces-objects"].trigger()
    before = faces.by_object()
    assert list(before) == ["Ground"]
    assert registry["rebake-faces"].isEnabled()
    document.select(document.world.object_paths.index("Crate"))
    faces.bench.show_panel("Object")
    qtbot.waitUntil(lambda: document.current is not None and document.current.scene is not None, timeout=PATIENCE_MS)
    count = document.world.object_count
    registry["duplicate"].trigger()
    qtbot.waitUntil(
        lambda: document.world is not None and document.world.object_count == count + 1, timeout=PATIENCE_MS
    )
    after = faces.by_object()
    assert list(after) == ["Ground"]
    np.testing.assert_array_equal(after["Ground"], before["Ground"])
    registry["faces-none"].trigger()
    assert not faces.by_object()
    assert not registry["rebake-faces"].isEnabled()
