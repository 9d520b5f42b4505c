"""The point under the cursor in one line: object to the left, numbers to the right of it."""

from __future__ import annotations

from PyQt6.QtCore import Qt
from PyQt6.QtGui import QPainter, QPaintEvent, QPalette
from PyQt6.QtWidgets import QSizePolicy, QWidget

from viewer.probe import Readout


class ProbeStrip(QWidget):
    """Painted in one go, so that sixty updates a second cost nothing."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._object, self._role, self._numbers = "", "", ""
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFixedHeight(2 * self.fontMetrics().height() + 6)
        self.setToolTip(
            "Under the cursor: object and role; triangle, barycentric weights, interpolated AO per distance, "
            "nearest vertex with its values and state, samples of the triangle, rays"
        )

    def text(self) -> str:
        """What is shown."""
        return f"{self._object}  {self._role}  {self._numbers}".strip()

    def set_readout(self, readout: Readout | None) -> None:
        """Shows a point; None says how to get one."""
        if readout is None:
            self._object, self._role, self._numbers = "", "", ""
        else:
            self._object, self._role, self._numbers = readout.object, readout.role, readout.line()
        self.update()

    def paintEvent(self, event: QPaintEvent | None) -> None:
        """Paints both lines."""
        painter = QPainter(self)
        palette, metrics = self.palette(), self.fontMetrics()
        line = metrics.height() + 1
        rect = self.rect().adjusted(8, 2, -8, -2)
        if not self._object:
            painter.setPen(palette.color(QPalette.ColorRole.PlaceholderText))
            painter.drawText(
                rect,
                int(Qt.AlignmentFlag.AlignVCenter),
                "Move over the surface to read its values; click to keep them.",
            )
            painter.end()
            return
        role = f"   {self._role}"
        name = metrics.elidedText(
            self._object, Qt.TextElideMode.ElideMiddle, rect.width() - metrics.horizontalAdvance(role) - 4
        )
        painter.setPen(palette.color(QPalette.ColorRole.WindowText))
        painter.drawText(rect.left(), rect.top() + metrics.ascent(), name)
        painter.setPen(palette.color(QPalette.ColorRole.PlaceholderText))
        painter.drawText(rect.left() + metrics.horizontalAdvance(name), rect.top() + metrics.ascent(), role)
        painter.setPen(palette.color(QPalette.ColorRole.WindowText))
        numbers = metrics.elidedText(self._numbers, Qt.TextElideMode.ElideRight, rect.width())
        painter.drawText(rect.left(), rect.top() + line + metrics.ascent(), numbers)
        painter.end()
