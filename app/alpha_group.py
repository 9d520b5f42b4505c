"""The smoothing of the result in view, moved live: values are solved for again from the stored samples."""

from __future__ import annotations

import math

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import QGroupBox, QHBoxLayout, QLabel, QPushButton, QSlider, QVBoxLayout, QWidget

from app.number_edit import NumberEdit

_LEAST, _MOST, _STEPS = 1e-3, 10.0, 400
_TIP = (
    "How strongly neighbouring vertices are drawn together where samples leave it open. Moving it solves for the "
    "vertices again, without tracing"
)


class AlphaGroup(QGroupBox):
    """A slider from nothing to much, and the number; asks for values, and to keep them."""

    moved = pyqtSignal(float)
    kept = pyqtSignal(float)
    dropped = pyqtSignal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("Smoothing α", parent)
        self._stored = 0.0
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setRange(0, _STEPS)
        self.slider.setToolTip(_TIP)
        self.slider.valueChanged.connect(self._on_slider)
        self.number = NumberEdit()
        self.number.setToolTip(_TIP)
        self.number.setMaximumWidth(80)
        self.number.settled.connect(self._on_number)
        self._state = QLabel()
        self._state.setWordWrap(True)
        self.keep = QPushButton("Use in bake")
        self.keep.setToolTip("Put this smoothing into the bake's settings, and store its values")
        self.keep.clicked.connect(lambda: self.kept.emit(self.value()))
        self.reset = QPushButton("Reset")
        self.reset.setToolTip("Back to the smoothing of the stored result")
        self.reset.clicked.connect(self._on_reset)
        first, buttons = QHBoxLayout(), QHBoxLayout()
        first.addWidget(self.slider, 1)
        first.addWidget(self.number)
        for button in (self.reset, self.keep):
            buttons.addWidget(button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 4, 8, 6)
        layout.addLayout(first)
        layout.addWidget(self._state)
        layout.addLayout(buttons)
        self.set_stored(None)

    def value(self) -> float:
        """The smoothing as shown; that of the result where nothing sensible is typed."""
        try:
            return max(self.number.value(), 0.0)
        except ValueError:
            return self._stored

    def set_stored(self, alpha: float | None) -> None:
        """Shows the smoothing of a result; None without one."""
        self.setEnabled(alpha is not None)
        self._stored = 0.0 if alpha is None else alpha
        self._show(self._stored)
        self.set_state("")

    def set_state(self, text: str) -> None:
        """Says what the values in view are."""
        self._state.setText(text)
        self._state.setVisible(bool(text))
        for button in (self.reset, self.keep):
            button.setEnabled(self.value() != self._stored)

    def _show(self, alpha: float) -> None:
        self.number.set_value(alpha)
        self.slider.blockSignals(True)
        self.slider.setValue(_place(alpha))
        self.slider.blockSignals(False)

    def _on_slider(self, place: int) -> None:
        self.number.set_value(_alpha(place))
        self._tell()

    def _on_number(self) -> None:
        if self.value() != _alpha(self.slider.value()):
            self._show(self.value())
            self._tell()

    def _on_reset(self) -> None:
        self._show(self._stored)
        self.set_state("")
        self.dropped.emit()

    def _tell(self) -> None:
        self.set_state("Solving …")
        self.moved.emit(self.value())


def _alpha(place: int) -> float:
    """The first place is none at all, the others are even in its logarithm."""
    if place == 0:
        return 0.0
    share = (place - 1) / (_STEPS - 1)
    return float(f"{_LEAST * (_MOST / _LEAST) ** share:.3g}")


def _place(alpha: float) -> int:
    if alpha <= 0.0:
        return 0
    share = math.log(alpha / _LEAST) / math.log(_MOST / _LEAST)
    return 1 + round(min(max(share, 0.0), 1.0) * (_STEPS - 1))
