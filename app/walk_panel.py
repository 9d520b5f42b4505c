"""The walk's panel: path, playing, and how every variant did."""

from __future__ import annotations

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import QGroupBox, QPushButton, QVBoxLayout, QWidget

from app.group_parts import group_form, in_row, note, small_table
from app.walk_path_group import WalkPathGroup
from app.walk_play_group import WalkPlayGroup
from app.walk_state import WalkState
from viewer.walk_rows import FIGURES, figure_rows

_SHORT = {
    "Regularised": "Regul.",
    "Blended in time": "Time",
    "Blended in space": "Space",
    "In space and time": "Both",
}


class WalkPanel(QWidget):
    """Groups over one `WalkState`."""

    csv_asked = pyqtSignal()
    plot_asked = pyqtSignal()

    def __init__(self, state: WalkState, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._state = state
        self.path = WalkPathGroup(state)
        self.play = WalkPlayGroup(state)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(6, 6, 6, 6)
        layout.setSpacing(6)
        for widget in (self.path, self.play, self._build_figures()):
            layout.addWidget(widget)
        layout.addStretch(1)
        state.walk_changed.connect(self.refresh)
        self.refresh()

    def _build_figures(self) -> QWidget:
        box = QGroupBox("Figures")
        tip = "\n".join(f"{name}: {meaning}" for name, meaning in FIGURES)
        self._figures = note(tip)
        self._figures.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._csv = QPushButton("Export CSV …")
        self._csv.setToolTip("A row a frame: time, place, region, and the AO of all variants facing the chosen way")
        self._csv.clicked.connect(self.csv_asked)
        self._plot = QPushButton("Plot and pops")
        self._plot.setToolTip("Bring the plot of the walk to the front")
        self._plot.clicked.connect(self.plot_asked)
        form = group_form(box)
        form.addRow(self._figures)
        form.addRow(in_row(self._plot, self._csv))
        return box

    def refresh(self) -> None:
        """Follows the state."""
        walk = self._state.walk
        self._csv.setEnabled(walk is not None)
        if walk is None:
            self._figures.setText("No walk yet.")
            return
        rows = [[_SHORT.get(name, name), *cells] for name, *cells in figure_rows(walk)]
        headings = ["", *(name for name, _ in FIGURES)]
        self._figures.setText(small_table(headings, rows).replace("<table>", '<table cellspacing="0">'))
