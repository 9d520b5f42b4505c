"""How panels are laid out at first: tabbed docks, settings left, display right, tables below the view."""

from __future__ import annotations

from collections.abc import Iterable

from PyQt6.QtCore import Qt
from PyQt6.QtWidgets import QDockWidget, QFrame, QMainWindow, QScrollArea, QTabWidget, QWidget

from app.actions import ActionSpec
from app.window_parts import DockSpec, Side

SIDE_WIDTH, BOTTOM_HEIGHT = 290, 176
AREAS = {
    Side.LEFT: Qt.DockWidgetArea.LeftDockWidgetArea,
    Side.RIGHT: Qt.DockWidgetArea.RightDockWidgetArea,
    Side.BOTTOM: Qt.DockWidgetArea.BottomDockWidgetArea,
}


def build_docks(window: QMainWindow, specs: Iterable[DockSpec]) -> dict[str, QDockWidget]:
    """Puts panels into docks.

    Returns:
        The docks by title.
    """
    options = QMainWindow.DockOption
    left, right, bottom = (AREAS[side] for side in (Side.LEFT, Side.RIGHT, Side.BOTTOM))
    window.setDockOptions(options.AllowNestedDocks | options.AllowTabbedDocks | options.GroupedDragging)
    window.setCorner(Qt.Corner.BottomLeftCorner, left)
    window.setCorner(Qt.Corner.BottomRightCorner, right)
    window.setTabPosition(left | right | bottom, QTabWidget.TabPosition.North)
    docks: dict[str, QDockWidget] = {}
    first: dict[Side, QDockWidget] = {}
    for spec in specs:
        dock = QDockWidget(spec.title, window)
        dock.setObjectName(f"dock-{spec.title.lower().replace(' ', '-')}")
        widget = _scrolled(spec.widget) if spec.scrolled else spec.widget
        if spec.side is not Side.BOTTOM:
            widget.setMinimumWidth(SIDE_WIDTH)
        dock.setWidget(widget)
        _show_title(dock, dock.isFloating())
        dock.topLevelChanged.connect(lambda floating, dock=dock: _show_title(dock, floating))
        window.addDockWidget(AREAS[spec.side], dock)
        docks[spec.title] = dock
        if spec.side in first:
            window.tabifyDockWidget(first[spec.side], dock)
        first.setdefault(spec.side, dock)
        if not spec.shown:
            dock.hide()
    for dock in first.values():
        dock.raise_()
    sides = [first[side] for side in (Side.LEFT, Side.RIGHT) if side in first]
    window.resizeDocks(sides, [SIDE_WIDTH] * len(sides), Qt.Orientation.Horizontal)
    if Side.BOTTOM in first:
        window.resizeDocks([first[Side.BOTTOM]], [BOTTOM_HEIGHT], Qt.Orientation.Vertical)
    return docks


def panel_action(title: str) -> ActionSpec:
    """The action that shows and hides a panel."""
    name = f"panel-{title.lower().replace(' ', '-')}"
    return ActionSpec(name, "View/Panels", title, f"Show or hide the panel {title}", (), True, 6)


def _show_title(dock: QDockWidget, floating: bool) -> None:
    """A title bar only where there is no tab that says the same."""
    dock.setTitleBarWidget(None if floating else QWidget(dock))


def _scrolled(widget: QWidget) -> QScrollArea:
    scroll = QScrollArea()
    scroll.setWidgetResizable(True)
    scroll.setFrameShape(QFrame.Shape.NoFrame)
    scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    scroll.setWidget(widget)
    return scroll
