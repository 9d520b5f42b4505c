"""How triangles are chosen, and which are: the tools, the brush's radius, and what counts as seen."""

from __future__ import annotations

from collections.abc import Sequence

from PyQt6.QtCore import pyqtSignal
from PyQt6.QtGui import QAction
from PyQt6.QtWidgets import QCheckBox, QGroupBox, QHBoxLayout, QLabel, QSizePolicy, QSpinBox, QVBoxLayout, QWidget

from app.action_buttons import action_button, fill_grid
from app.face_tool import LEAST_RADIUS, MOST_RADIUS

_NONE = "None chosen: drag over some in the view. Shift adds, Ctrl takes away."
_TIP = "A click chooses one triangle. Drags with Alt, and those of the other buttons, are the camera's as always"


class FaceGroup(QGroupBox):
    """Shows how triangles are chosen and how many are; asks for another radius of the brush."""

    radius_set = pyqtSignal(float)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("Triangles", parent)
        self._tools = QHBoxLayout()
        self._buttons = QVBoxLayout()
        self.radius = QSpinBox()
        self.radius.setRange(int(LEAST_RADIUS), int(MOST_RADIUS))
        self.radius.setSuffix(" px")
        self.radius.setToolTip("Radius of the brush in pixels of the picture")
        self.radius.valueChanged.connect(lambda pixels: self.radius_set.emit(float(pixels)))
        self.front = QCheckBox("Fronts only")
        self.front.setToolTip("Pass through triangles that turn their back to the eye, as if they were not there")
        self.front.setChecked(True)
        self.hidden = QCheckBox("Hidden too")
        self.hidden.setToolTip("Choose what lies behind other triangles as well")
        self._state = QLabel()
        self._state.setWordWrap(True)
        self._state.setToolTip(_TIP)
        ticks = QHBoxLayout()
        for box in (self.front, self.hidden):
            ticks.addWidget(box)
        ticks.addStretch(1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 4, 8, 6)
        layout.setSpacing(4)
        layout.addLayout(self._tools)
        layout.addLayout(ticks)
        layout.addWidget(self._state)
        layout.addLayout(self._buttons)
        self.show_chosen(0, 0)

    def add_tools(self, actions: Sequence[QAction], words: Sequence[str]) -> None:
        """Puts the tools in a row, and the brush's radius behind them."""
        for action, word in zip(actions, words, strict=True):
            self._tools.addWidget(action_button(action, word), 1)
        self.radius.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._tools.addWidget(self.radius)

    def add_buttons(self, actions: Sequence[QAction], words: Sequence[str]) -> None:
        """Puts actions on what is chosen below it, two a row."""
        self._buttons.addLayout(fill_grid(actions, words))

    def show_chosen(self, count: int, objects: int) -> None:
        """Says how many triangles of how many objects are chosen."""
        if count:
            of = "one object" if objects == 1 else f"{objects:,} objects"
            self._state.setText(f"<b>{count:,}</b> triangle{'s' if count > 1 else ''} of {of} chosen")
        else:
            self._state.setText(_NONE)
