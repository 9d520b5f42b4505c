"""The panels around the view, and how they are laid out at first."""

from __future__ import annotations

from dataclasses import dataclass

from PyQt6.QtCore import Qt
from PyQt6.QtWidgets import QDockWidget, QFrame, QMainWindow, QScrollArea, QTabWidget, QWidget

from app.bake_panel import BakePanel
from app.decorator_panel import DecoratorPanel
from app.display_panel import DisplayPanel
from app.document import Document
from app.findings_table import FindingsTable
from app.instance_table import InstanceTable
from app.log_panel import LogPanel
from app.outliner import Outliner
from app.overlay_panel import OverlayPanel
from app.probe_panel import ProbePanel
from app.stage_table import StageTable

SIDE_WIDTH, BOTTOM_HEIGHT = 290, 176


@dataclass(frozen=True, slots=True)
class Panels:
    """One of each panel."""

    bake: BakePanel
    outliner: Outliner
    display: DisplayPanel
    overlays: OverlayPanel
    decorators: DecoratorPanel
    probe: ProbePanel
    stages: StageTable
    findings: FindingsTable
    instances: InstanceTable
    log: LogPanel


def build_panels(document: Document) -> Panels:
    """Makes the panels of a window over its document."""
    return Panels(
        bake=BakePanel(document),
        outliner=Outliner(document),
        display=DisplayPanel(document),
        overlays=OverlayPanel(document),
        decorators=DecoratorPanel(document),
        probe=ProbePanel(),
        stages=StageTable(),
        findings=FindingsTable(),
        instances=InstanceTable(document),
        log=LogPanel(),
    )


def build_docks(window: QMainWindow, panels: Panels) -> dict[str, QDockWidget]:
    """Puts the panels into tabbed docks: settings left, display right, tables below the view.

    Returns:
        The docks by title.
    """
    left, right, bottom = (
        Qt.DockWidgetArea.LeftDockWidgetArea,
        Qt.DockWidgetArea.RightDockWidgetArea,
        Qt.DockWidgetArea.BottomDockWidgetArea,
    )
    options = QMainWindow.DockOption
    window.setDockOptions(options.AllowNestedDocks | options.AllowTabbedDocks | options.GroupedDragging)
    window.setCorner(Qt.Corner.BottomLeftCorner, left)
    window.setCorner(Qt.Corner.BottomRightCorner, right)
    window.setTabPosition(left | right | bottom, QTabWidget.TabPosition.North)
    groups: tuple[tuple[Qt.DockWidgetArea, dict[str, QWidget]], ...] = (
        (left, {"Bake": panels.bake, "Objects": panels.outliner}),
        (
            right,
            {
                "Display": _scrolled(panels.display),
                "Marks": _scrolled(panels.overlays),
                "Decorators": _scrolled(panels.decorators),
            },
        ),
        (
            bottom,
            {
                "Probe": panels.probe,
                "Stages": panels.stages,
                "Findings": panels.findings,
                "Instances": panels.instances,
                "Log": panels.log,
            },
        ),
    )
    docks: dict[str, QDockWidget] = {}
    for area, group in groups:
        first: QDockWidget | None = None
        for title, widget in group.items():
            dock = QDockWidget(title, window)
            dock.setObjectName(f"dock-{title.lower()}")
            if area is not bottom:
                widget.setMinimumWidth(SIDE_WIDTH)
            dock.setWidget(widget)
            _show_title(dock, dock.isFloating())
            dock.topLevelChanged.connect(lambda floating, dock=dock: _show_title(dock, floating))
            window.addDockWidget(area, dock)
            docks[title] = dock
            if first is None:
                first = dock
            else:
                window.tabifyDockWidget(first, dock)
        if first is not None:
            first.raise_()
    window.resizeDocks([docks["Bake"], docks["Display"]], [SIDE_WIDTH, SIDE_WIDTH], Qt.Orientation.Horizontal)
    window.resizeDocks([docks["Probe"]], [BOTTOM_HEIGHT], Qt.Orientation.Vertical)
    return docks


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
