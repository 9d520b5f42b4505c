"""A seeded monkey that uses a window: any action of its registry, the mouse in the view, lists and sliders."""

from __future__ import annotations

import random
from collections.abc import Callable

from PyQt6.QtCore import QEvent, QPoint, QPointF, Qt, QTimer
from PyQt6.QtGui import QMouseEvent
from PyQt6.QtTest import QTest
from PyQt6.QtWidgets import QApplication, QDialog, QMainWindow, QMenu, QMessageBox, QWidget

from app.parts.placing import PlacingPart
from app.parts.rebake import RebakePart
from app.region_part import RegionsPart
from app.window import Window
from viewer.gizmo import Motion

_MODIFIERS = (Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.AltModifier)
LEFT_ALONE = {"quit", "open-sample"}
"""They end the window, or bake for minutes."""


class Monkey:
    """Does random things; dialogs that come up are closed again.

    Args:
        window: Where it sits.
        seed: The same one does the same.
    """

    def __init__(self, window: Window, seed: int) -> None:
        self._window, self._dice = window, random.Random(seed)
        self.done: list[str] = []
        self._closer = QTimer(window)
        self._closer.setInterval(20)
        self._closer.timeout.connect(close_dialogs)
        self._closer.start()

    def act(self) -> None:
        """Does one thing."""
        things: list[tuple[int, Callable[[], str]]] = [
            (60, self._action),
            (10, self._click),
            (5, self._wheel),
            (5, self._drag),
            (5, self._faces),
            (3, self._place),
            (3, self._layer),
            (6, self._list),
            (5, self._range),
            (4, self._threshold),
            (3, self._palette),
            (2, self._resize),
        ]
        thing = self._dice.choices([thing for _, thing in things], [weight for weight, _ in things])[0]
        self.done.append(thing())

    def stop(self) -> None:
        """Comes down, and closes what it has opened."""
        self._closer.stop()
        close_dialogs()

    def _action(self) -> str:
        actions = self._window.actions_by_id
        name = self._dice.choice(sorted(set(actions) - LEFT_ALONE))
        actions[name].trigger()
        return name

    def _spot(self) -> QPoint:
        view = self._window.area.main.view
        return QPoint(self._dice.randrange(max(view.width(), 1)), self._dice.randrange(max(view.height(), 1)))

    def _click(self) -> str:
        button = self._dice.choice([Qt.MouseButton.LeftButton, Qt.MouseButton.LeftButton, Qt.MouseButton.RightButton])
        QTest.mouseClick(self._window.area.main.view, button, pos=self._spot())
        return f"click {button.name}"

    def _wheel(self) -> str:
        self._window.area.main.view.wheel_turned.emit(QPointF(self._spot()), self._dice.choice([-2.0, 1.0, 3.0]))
        return "wheel"

    def _drag(self) -> str:
        view = self._window.area.main.view
        button = self._dice.choice([Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton, Qt.MouseButton.RightButton])
        begin, end = self._spot(), self._spot()
        QTest.mousePress(view, button, pos=begin)
        QTest.mouseMove(view, end)
        QTest.mouseRelease(view, button, pos=end)
        return f"drag {button.name}"

    def _faces(self) -> str:
        """Chooses triangles: with some tool, along some way, adding or taking away."""
        view, dice = self._window.area.main.view, self._dice
        name = f"faces-{dice.choice(['box', 'lasso', 'brush'])}"
        if not self._window.actions_by_id[name].isChecked():
            self._window.actions_by_id[name].trigger()
        held = dice.choice([Qt.KeyboardModifier.NoModifier, *_MODIFIERS])
        way = [QPointF(self._spot()) for _ in range(dice.randrange(1, 6))]
        left = Qt.MouseButton.LeftButton
        for kind, place, signal in (
            (QEvent.Type.MouseButtonPress, way[0], view.mouse_pressed),
            *((QEvent.Type.MouseMove, place, view.mouse_moved) for place in way[1:]),
            (QEvent.Type.MouseButtonRelease, way[-1], view.mouse_released),
        ):
            signal.emit(QMouseEvent(kind, place, place, left, left, held))
        return name

    def _place(self) -> str:
        """Moves, turns or scales what is selected, or gives it keys of its own."""
        part, dice = self._window.part(PlacingPart), self._dice
        match dice.randrange(3):
            case 0:
                part.place_by(Motion((dice.uniform(-1.0, 1.0), 0.0, dice.uniform(-1.0, 1.0))))
            case 1:
                part.place_by(Motion(factor=dice.uniform(0.8, 1.25)))
            case _:
                name, values = dice.choice([("samples", [None, 2, 5]), ("alpha", [None, 0.0, 0.3])])
                part.panel.key_set.emit(name, dice.choice(values))
        return "place"

    def _layer(self) -> str:
        """Chooses a layer, and sometimes a region to turn it down in."""
        layers = self._window.part(RebakePart).panel.layers
        layers.show_row(self._dice.randrange(-1, max(layers.rows.rowCount(), 1)))
        state = self._window.part(RegionsPart).state
        if state.regions is not None:
            state.set_view(state.view.replaced(region=self._dice.randrange(-1, len(state.regions.graph))))
        return "layer"

    def _list(self) -> str:
        outliner, world = self._window.panels.outliner, self._window.document.world
        if world is None:
            return "no list"
        index = self._dice.randrange(world.object_count)
        match self._dice.randrange(4):
            case 0:
                outliner.toggle(index)
            case 1:
                outliner.filter.setText(self._dice.choice(["", "", "c", "is:hidden", "role:static", "zz"]))
            case 2:
                header = outliner.tree.header()
                assert header is not None
                header.setSortIndicator(self._dice.randrange(-1, 4), Qt.SortOrder.AscendingOrder)
            case _:
                self._window.document.select_all(
                    self._dice.sample(range(world.object_count), min(3, world.object_count))
                )
        return "list"

    def _range(self) -> str:
        low = self._dice.random()
        self._window.panels.display._on_range(low, low + self._dice.random())
        return "range"

    def _threshold(self) -> str:
        self._window.panels.overlays._slider.setValue(self._dice.randrange(1001))
        return "threshold"

    def _palette(self) -> str:
        from app.parts.edit import EditPart

        palette = self._window.part(EditPart).palette
        palette.open()
        palette.field.setText(self._dice.choice(["fr", "lay", "x", "co ma"]))
        if palette.names() and palette.names()[0] not in LEFT_ALONE:
            palette.run_current()
        palette.hide()
        return "palette"

    def _resize(self) -> str:
        self._window.resize(self._dice.randrange(700, 1300), self._dice.randrange(500, 800))
        return "resize"


def close_dialogs() -> None:
    """Closes every dialog, box and menu that is open."""
    popup = QApplication.activePopupWidget()
    if popup is not None:
        popup.close()
    for widget in QApplication.topLevelWidgets():
        if _is_dialog(widget) and widget.isVisible():
            widget.reject() if isinstance(widget, QDialog) else widget.close()


def _is_dialog(widget: QWidget) -> bool:
    return isinstance(widget, QDialog | QMessageBox | QMenu) and not isinstance(widget, QMainWindow)
