"""The readout of the clicked point, in full, to be copied into a report."""

from __future__ import annotations

import itertools

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import QApplication, QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from app.elided_label import ElidedLabel
from app.tables import Cell, RowsView
from viewer.probe import Readout

_EMPTY = "Click on the surface to keep a point here."


class ProbePanel(QWidget):
    """Label and value of everything known about the pinned point."""

    fly_requested = pyqtSignal()
    cleared = pyqtSignal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._title = ElidedLabel(_EMPTY, Qt.TextElideMode.ElideMiddle)
        self.view = RowsView(("", "", "", ""), stretch=3)
        header = self.view.horizontalHeader()
        assert header is not None
        header.hide()
        self._buttons = []
        top = QHBoxLayout()
        top.addWidget(self._title, 1)
        for text, tip, slot in (
            ("Fly there", "Look at the point from nearby", self.fly_requested.emit),
            ("Copy", "Copy all lines as text", self._copy),
            ("Clear", "Forget the point", self.cleared.emit),
        ):
            button = QPushButton(text)
            button.setToolTip(tip)
            button.clicked.connect(slot)
            self._buttons.append(button)
            top.addWidget(button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.addLayout(top)
        layout.addWidget(self.view, 1)
        self._readout: Readout | None = None
        self.set_readout(None)

    def set_readout(self, readout: Readout | None) -> None:
        """Shows a point; None empties the panel."""
        self._readout = readout
        self._title.setText(_EMPTY if readout is None else readout.object)
        for button in self._buttons:
            button.setEnabled(readout is not None)
        rows = [] if readout is None else readout.rows()
        half = 5  # where it is to the left, its values to the right
        left, right = rows[:half], rows[half:]
        blank = ("", "")
        lines = itertools.zip_longest(left, right, fillvalue=blank)
        self.view.set_rows([tuple(Cell(text) for text in (*first, *second)) for first, second in lines])

    def _copy(self) -> None:
        clipboard = QApplication.clipboard()
        if self._readout is not None and clipboard is not None:
            clipboard.setText("\n".join(f"{label}: {text}" for label, text in self._readout.rows()))
