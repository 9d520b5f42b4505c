"""The point under the cursor in two lines: where it is, and its numbers."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

from PyQt6.QtCore import Qt
from PyQt6.QtGui import QPainter, QPaintEvent, QPalette
from PyQt6.QtWidgets import QSizePolicy, QWidget

from viewer.probe import Readout

_HINT = "Move over the surface to read its values; click to keep them."


class ProbeStrip(QWidget):
    """Painted in one go, so that sixty updates a second cost nothing."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._readout: Readout | None = None
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFixedHeight(2 * self.fontMetrics().height() + 6)
        self.setToolTip(
            "Under the cursor: object and role, triangle and barycentric weights; interpolated AO per distance, "
            "nearest vertex with its values and state, samples of the triangle, rays"
        )

    def text(self) -> str:
        """What is shown."""
        shown = self._readout
        return "" if shown is None else f"{shown.object}  {shown.role}  {shown.place()}  {shown.line()}"

    def set_readout(self, readout: Readout | None) -> None:
        """Shows a point; None says how to get one."""
        self._readout = readout
        self.update()

    def paintEvent(self, event: QPaintEvent | None) -> None:
        """Paints both lines."""
        painter = QPainter(self)
        palette, metrics, shown = self.palette(), self.fontMetrics(), self._readout
        ink, faint = palette.color(QPalette.ColorRole.WindowText), palette.color(QPalette.ColorRole.PlaceholderText)
        rect = self.rect().adjusted(8, 2, -8, -2)
        if shown is None:
            painter.setPen(faint)
            painter.drawText(rect, int(Qt.AlignmentFlag.AlignVCenter), _HINT)
            painter.end()
            return
        first, second = rect.top() + metrics.ascent(), rect.top() + metrics.height() + 1 + metrics.ascent()
        role, place = f"   {shown.role}", shown.place()
        room = rect.width() - metrics.horizontalAdvance(role) - metrics.horizontalAdvance(place) - 24
        name = metrics.elidedText(shown.object, Qt.TextElideMode.ElideMiddle, max(room, 40))
        painter.setPen(ink)
        painter.drawText(rect.left(), first, name)
        painter.drawText(
            rect.left(), second, metrics.elidedText(shown.line(), Qt.TextElideMode.ElideRight, rect.width())
        )
        painter.setPen(faint)
        painter.drawText(rect.left() + metrics.horizontalAdvance(name), first, role)
        painter.drawText(rect.right() - metrics.horizontalAdvance(place), first, place)
        painter.end()
