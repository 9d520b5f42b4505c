"""Where a walk leads: a tour, picked points or a file; and the truth traced along it."""

from __future__ import annotations

from PyQt6.QtCore import pyqtSignal
from PyQt6.QtWidgets import QCheckBox, QGroupBox, QProgressBar, QPushButton, QWidget

from app.group_parts import group_form, in_row, note
from app.region_state import Tool
from app.walk_state import WalkState
from bake.types import Progress


class WalkPathGroup(QGroupBox):
    """Asks for paths and for what has to be traced along them."""

    tour_asked = pyqtSignal()
    file_asked = pyqtSignal()
    truth_asked = pyqtSignal()
    cancel_asked = pyqtSignal()

    def __init__(self, state: WalkState, parent: QWidget | None = None) -> None:
        super().__init__("Path", parent)
        self._state = state
        self._filling = self._tracing = False
        self.tour = QPushButton("Tour")
        self.tour.setToolTip("Walk through all regions that hang together on foot, nearest first")
        self.tour.clicked.connect(self.tour_asked)
        self.pick = QPushButton("Pick points")
        self.pick.setCheckable(True)
        self.pick.setToolTip("Click on the floor to add points at walking height above it; Backspace removes the last")
        self.pick.toggled.connect(lambda on: None if self._filling else state.regions.use_tool(Tool.PATH, on))
        self.file = QPushButton("File …")
        self.file.setToolTip("A path in world metres: JSON or CSV, such as one that was exported here")
        self.file.clicked.connect(self.file_asked)
        self.clear = QPushButton("Clear")
        self.clear.setToolTip("Start over without a path")
        self.clear.clicked.connect(lambda: state.set_picked(()))
        self._what = note("Where the path comes from, and how long it is")
        self.with_truth = QCheckBox("Trace the truth with a tour")
        self.with_truth.setChecked(True)
        self.with_truth.setToolTip("Trace what the figure should look like at places along the way, to compare with")
        self.truth = QPushButton("Trace the truth")
        self.truth.setToolTip("Trace what the figure should look like at places along this path")
        self.truth.clicked.connect(self.truth_asked)
        self.cancel = QPushButton("Cancel")
        self.cancel.setToolTip("Stop tracing; the walk stays as it is")
        self.cancel.clicked.connect(self.cancel_asked)
        self._bar = QProgressBar()
        self._bar.setTextVisible(False)
        self._bar.setMaximumHeight(10)
        self._stage = note("What the engine does for the walk")
        form = group_form(self)
        form.addRow(in_row(self.tour, self.pick))
        form.addRow(in_row(self.file, self.clear))
        form.addRow(self._what)
        form.addRow(self.with_truth)
        form.addRow(in_row(self.truth, self.cancel))
        form.addRow(self._stage)
        form.addRow(self._bar)
        for event in (state.path_changed, state.truth_changed, state.regions.tool_changed, state.regions.opened):
            event.connect(self.refresh)
        self.refresh()

    def set_tracing(self, on: bool) -> None:
        """Says that the engine is at work, or no longer."""
        self._tracing = on
        self._stage.setText("Starting …" if on else "")
        self._bar.setRange(0, 0)
        self.refresh()

    def set_progress(self, progress: Progress) -> None:
        """Shows where the engine stands."""
        self._stage.setText(progress.stage.capitalize())
        self._bar.setRange(0, min(progress.total, 2**30))
        self._bar.setValue(min(progress.done, 2**30))

    def refresh(self) -> None:
        """Follows the state."""
        state = self._state
        self._filling = True
        has = state.regions.regions is not None
        for button in (self.tour, self.pick, self.file):
            button.setEnabled(has and not self._tracing)
        self.pick.setChecked(state.regions.tool is Tool.PATH)
        self.clear.setEnabled(state.path is not None or bool(state.picked))
        self.truth.setEnabled(state.path is not None and state.truth is None and not self._tracing)
        self.truth.setVisible(not self._tracing)
        for widget in (self.cancel, self._stage, self._bar):
            widget.setVisible(self._tracing)
        self._what.setText(self._text())
        self._filling = False

    def _text(self) -> str:
        state = self._state
        if state.regions.regions is None:
            return "This result has no regions to walk through."
        if state.path is None:
            if state.regions.tool is Tool.PATH:
                return f"{len(state.picked)} point{'' if len(state.picked) == 1 else 's'} so far: click on the floor."
            return "A figure walks through the regions and is lit by their models."
        what = {"tour": "Tour", "points": f"{len(state.picked)} picked points"}.get(state.source, state.source)
        if state.visited is not None:
            what += f" of {int(state.visited.sum()):,} of {len(state.visited):,} regions"
        text = f"{what}, {state.path.length:,.1f} m."
        if state.truth is None:
            return text + " No truth traced."
        lost = int((~state.truth.valid).sum())
        text += f" Truth traced at {len(state.truth.distance):,} places, {state.truth.directions:,} rays each"
        return text + (f"; {lost:,} lie inside something." if lost else ".")
