"""A seeded monkey that uses a window: any action of its registry, the mouse in the view, lists and sliders."""

from __future__ import annotations

import random
from collections.abc import Callable

from PyQt6.QtCore import QPoint, QPointF, Qt, QTimer
from PyQt6.QtTest import QTest
from PyQt6.QtWidgets import QApplication, QDialog, QMainWindow, QMenu, QMessageBox, QWidget

from app.window import Window

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
