"""A line for a number that keeps every digit, with its unit beside it."""

from __future__ import annotations

import math

from PyQt6.QtCore import pyqtSignal
from PyQt6.QtWidgets import QHBoxLayout, QLabel, QLineEdit, QWidget


class NumberEdit(QWidget):
    """Edits a float. Unlike a spin box it rounds nothing, so that what is stored comes back as it was."""

    changed = pyqtSignal()
    settled = pyqtSignal()
    """Return was pressed, or the cursor went elsewhere."""

    def __init__(self, unit: str = "", parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._line = QLineEdit()
        self._line.setMinimumWidth(44)
        self._line.textEdited.connect(self.changed)
        self._line.editingFinished.connect(self.settled)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._line, 1)
        if unit:
            layout.addWidget(QLabel(unit))
        self.setFocusProxy(self._line)

    def clear(self) -> None:
        """Shows nothing, without a signal."""
        self._line.clear()

    def set_text(self, text: str) -> None:
        """Shows a text without a signal."""
        self._line.setText(text)

    def text(self) -> str:
        """What is typed."""
        return self._line.text().strip()

    def value(self) -> float:
        """The number.

        Raises:
            ValueError: it is none.
        """
        number = float(self.text().replace(",", "."))
        if not math.isfinite(number):
            raise ValueError(self.text())
        return number

    def set_value(self, value: float) -> None:
        """Shows a number without a signal."""
        self._line.setText(plain_number(value))


def plain_number(value: float) -> str:
    """The shortest text that reads back as the same number, without a needless `.0`."""
    return repr(float(value)).removesuffix(".0")
