"""How panels are laid out at first: tabbed docks, settings left, display right, tables below the view."""

from __future__ import annotations

from collections.abc import Iterable

from PyQt6.QtCore import QObject, Qt, QTimer
from PyQt6.QtWidgets import QDockWidget, QFrame, QMainWindow, QScrollArea, QTabBar, QTabWidget, QWidget

from app.actions import ActionSpec
from app.window_parts import DockSpec, Side

SIDE_WIDTH, BOTTOM_HEIGHT = 304, 176
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
    for spec in sorted(specs, key=lambda spec: spec.seldom):
        dock = QDockWidget(spec.title, window)
        dock.setObjectName(f"dock-{spec.title.lower().replace(' ', '-')}")
        widget = _scrolled(spec.widget) if spec.scrolled else spec.widget
        if spec.side is not Side.BOTTOM:
            widget.setMinimumWidth(SIDE_WIDTH)
        dock.setWidget(widget)
        window.addDockWidget(AREAS[spec.side], dock)
        docks[spec.title] = dock
        if spec.side in first:
            window.tabifyDockWidget(first[spec.side], dock)
        first.setdefault(spec.side, dock)
        if not spec.shown:
            dock.hide()
    for dock in first.values():
        dock.raise_()
    _Titles(window, list(docks.values()))
    sides = [first[side] for side in (Side.LEFT, Side.RIGHT) if side in first]
    window.resizeDocks(sides, [SIDE_WIDTH] * len(sides), Qt.Orientation.Horizontal)
    if Side.BOTTOM in first:
        window.resizeDocks([first[Side.BOTTOM]], [BOTTOM_HEIGHT], Qt.Orientation.Vertical)
    return docks


def panel_action(title: str) -> ActionSpec:
    """The action that shows and hides a panel."""
    name = f"panel-{title.lower().replace(' ', '-')}"
    return ActionSpec(name, "View/Panels", title, f"Show or hide the panel {title}", (), True, 6)


class _Titles(QObject):
    """Gives a title bar to those docks only that have no tab which says the same."""

    def __init__(self, window: QMainWindow, docks: list[QDockWidget]) -> None:
        super().__init__(window)
        self._window, self._docks = window, docks
        self._later = QTimer(self)
        self._later.setSingleShot(True)
        self._later.timeout.connect(self._refresh)
        for dock in docks:
            for signal in (dock.topLevelChanged, dock.dockLocationChanged, dock.visibilityChanged):
                signal.connect(self._start)
        self._refresh()

    def _start(self) -> None:
        self._later.start(0)

    def _refresh(self) -> None:
        for dock in self._docks:
            tabbed = any(not other.isHidden() for other in self._window.tabifiedDockWidgets(dock))
            bare = tabbed and not dock.isFloating()
            if bare != (dock.titleBarWidget() is not None):
                former = dock.titleBarWidget()
                dock.setTitleBarWidget(QWidget(dock) if bare else None)
                if former is not None:
                    former.deleteLater()
                layout = dock.layout()
                if layout is not None:  # Qt gives the bar its room at the next resize only
                    layout.invalidate()
                    layout.setGeometry(dock.rect())
        for bar in self._window.findChildren(QTabBar, options=Qt.FindChildOption.FindDirectChildrenOnly):
            bar.setElideMode(Qt.TextElideMode.ElideNone)  # rather scrolled than read as "D…"
        _hide_stale_tabs(self._window, self._docks)
        self._window.update()  # tabs that went away leave their pixels behind


def _hide_stale_tabs(window: QMainWindow, docks: list[QDockWidget]) -> None:
    """Qt leaves tab bars of former arrangements visible below the new ones; of equal ones the last is in use."""
    seen: set[frozenset[str]] = set()
    groups = {
        frozenset(d.windowTitle() for d in (dock, *window.tabifiedDockWidgets(dock)) if not d.isHidden())
        for dock in docks
        if not dock.isHidden() and not dock.isFloating()
    }
    for bar in reversed(window.findChildren(QTabBar, options=Qt.FindChildOption.FindDirectChildrenOnly)):
        titles = frozenset(bar.tabText(number) for number in range(bar.count()))
        if titles not in groups or titles in seen:
            bar.hide()
        seen.add(titles)


def _scrolled(widget: QWidget) -> QScrollArea:
    scroll = QScrollArea()
    scroll.setWidgetResizable(True)
    scroll.setFrameShape(QFrame.Shape.NoFrame)
    scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    scroll.setWidget(widget)
    return scroll
