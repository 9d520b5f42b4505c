"""Histogram with a colour bar under it and two handles that set the range of the colours."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

import numpy as np
from PyQt6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, pyqtSignal
from PyQt6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPalette, QPen, QPolygonF
from PyQt6.QtWidgets import QSizePolicy, QWidget

from app.legend import color_bar
from viewer.colormaps import GREY, ColorMap
from viewer.histogram import Histogram

_MARGIN, _BAR_HEIGHT, _HANDLE = 10, 14, 6
_SMALLEST = 1e-3
_LEAST_SHARE = 1e-5


class RangeWidget(QWidget):
    """Lets the user pick the values at the two ends of the colour map.

    Drag a handle, or drag between the handles to move both. A double click asks for the full range.
    """

    range_changed = pyqtSignal(float, float)
    reset_requested = pyqtSignal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._histogram: Histogram | None = None
        self._map = GREY
        self._low, self._high = 0.0, 1.0
        self._clipped = (0.0, 0.0)
        self._grabbed = ""
        self._grab_value = 0.0
        self.setMouseTracking(True)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setToolTip(
            "Vertices by value, on a logarithmic scale. Drag the handles to set which values get the two ends of "
            "the colours, drag between them to move both, double-click for the full range."
        )

    def set_histogram(self, histogram: Histogram | None, color_map: ColorMap) -> None:
        """Shows a distribution; its ends are the ends of the widget."""
        self._histogram, self._map = histogram, color_map
        self.update()

    def set_range(self, low: float, high: float, clipped: tuple[float, float] = (0.0, 0.0)) -> None:
        """Moves the handles without a signal; `clipped` are the shares of the area below and above them."""
        self._low, self._high, self._clipped = low, high, clipped
        self.update()

    def value_range(self) -> tuple[float, float]:
        """The values under the handles."""
        return self._low, self._high

    def sizeHint(self) -> QSize:
        """Compact, but tall enough to read the histogram."""
        return QSize(220, 104 + self.fontMetrics().height())

    def paintEvent(self, event: QPaintEvent | None) -> None:
        """Paints histogram, bar, handles and numbers."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        palette = self.palette()
        plot, bar = self._plot(), self._bar()
        painter.fillRect(plot, palette.color(QPalette.ColorRole.Base))
        self._paint_bins(painter, plot, palette)
        self._paint_bar(painter, bar)
        for value in (self._low, self._high):
            self._paint_handle(painter, self._x(value), plot, bar, palette)
        painter.setPen(QPen(palette.color(QPalette.ColorRole.Mid), 1))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(plot)
        self._paint_text(painter, bar, palette)
        painter.end()

    def mousePressEvent(self, event: QMouseEvent | None) -> None:
        """Grabs a handle, or the stretch between them."""
        if event is None or event.button() is not Qt.MouseButton.LeftButton:
            return
        x = event.position().x()
        self._grabbed = self._handle_at(x)
        self._grab_value = self._value(x)

    def mouseMoveEvent(self, event: QMouseEvent | None) -> None:
        """Moves what is grabbed."""
        if event is None:
            return
        x = event.position().x()
        if not self._grabbed:
            over = self._handle_at(x)
            shape = Qt.CursorShape.SizeHorCursor if over in ("low", "high") else Qt.CursorShape.OpenHandCursor
            self.setCursor(shape if over else Qt.CursorShape.ArrowCursor)
            return
        least, most = self._ends()
        value = min(max(self._value(x), least), most)
        low, high = self._low, self._high
        if self._grabbed == "low":
            low = min(value, high - _SMALLEST)
        elif self._grabbed == "high":
            high = max(value, low + _SMALLEST)
        else:
            step = min(max(self._value(x) - self._grab_value, least - low), most - high)
            self._grab_value += step
            low, high = low + step, high + step
        if (low, high) != (self._low, self._high):
            self.set_range(low, high, self._clipped)
            self.range_changed.emit(low, high)

    def mouseReleaseEvent(self, event: QMouseEvent | None) -> None:
        """Lets go."""
        self._grabbed = ""

    def mouseDoubleClickEvent(self, event: QMouseEvent | None) -> None:
        """Asks for the full range."""
        self._grabbed = ""
        self.reset_requested.emit()

    def changeEvent(self, event: QEvent | None) -> None:
        """Follows the palette."""
        self.update()
        super().changeEvent(event)

    def _ends(self) -> tuple[float, float]:
        return (self._histogram.low, self._histogram.high) if self._histogram is not None else (0.0, 1.0)

    def _plot(self) -> QRectF:
        height = self.height() - _BAR_HEIGHT - _HANDLE - self.fontMetrics().height() - 4
        return QRectF(_MARGIN, 1, self.width() - 2 * _MARGIN, height)

    def _bar(self) -> QRectF:
        plot = self._plot()
        return QRectF(plot.left(), plot.bottom() + 1, plot.width(), _BAR_HEIGHT)

    def _x(self, value: float) -> float:
        least, most = self._ends()
        plot = self._plot()
        share = (value - least) / max(most - least, 1e-12)
        return plot.left() + min(max(share, 0.0), 1.0) * plot.width()

    def _value(self, x: float) -> float:
        least, most = self._ends()
        plot = self._plot()
        return least + (x - plot.left()) / max(plot.width(), 1.0) * (most - least)

    def _handle_at(self, x: float) -> str:
        to_low, to_high = abs(x - self._x(self._low)), abs(x - self._x(self._high))
        if min(to_low, to_high) <= _HANDLE + 3:
            return "low" if to_low <= to_high else "high"
        return "both" if self._x(self._low) < x < self._x(self._high) else ""

    def _paint_bins(self, painter: QPainter, plot: QRectF, palette: QPalette) -> None:
        if self._histogram is None or self._histogram.is_empty:
            painter.setPen(palette.color(QPalette.ColorRole.PlaceholderText))
            painter.drawText(plot, int(Qt.AlignmentFlag.AlignCenter), "no values yet")
            return
        # Logarithmic, so that a few dark vertices stay visible beside thousands of open ones.
        heights = 1.0 + np.log10(np.maximum(self._histogram.shares, _LEAST_SHARE)) / -np.log10(_LEAST_SHARE)
        heights = heights / max(float(heights.max()), 1e-12) * (plot.height() - 4)
        width = plot.width() / len(heights)
        points = [QPointF(plot.left(), plot.bottom())]
        for index, height in enumerate(heights):
            y = plot.bottom() - float(height)
            points += [QPointF(plot.left() + index * width, y), QPointF(plot.left() + (index + 1) * width, y)]
        points.append(QPointF(plot.right(), plot.bottom()))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(palette.color(QPalette.ColorRole.Highlight))
        painter.drawPolygon(QPolygonF(points))
        shade = QColor(palette.color(QPalette.ColorRole.Window))
        shade.setAlpha(170)
        painter.fillRect(QRectF(plot.left(), plot.top(), self._x(self._low) - plot.left(), plot.height()), shade)
        painter.fillRect(
            QRectF(self._x(self._high), plot.top(), plot.right() - self._x(self._high), plot.height()), shade
        )

    def _paint_bar(self, painter: QPainter, bar: QRectF) -> None:
        table = self._map.table()
        left, right = self._x(self._low), self._x(self._high)
        painter.fillRect(QRectF(bar.left(), bar.top(), left - bar.left(), bar.height()), QColor(*map(int, table[0])))
        painter.fillRect(QRectF(right, bar.top(), bar.right() - right, bar.height()), QColor(*map(int, table[-1])))
        painter.drawImage(QRectF(left, bar.top(), max(right - left, 1.0), bar.height()), color_bar(self._map))

    def _paint_handle(self, painter: QPainter, x: float, plot: QRectF, bar: QRectF, palette: QPalette) -> None:
        ink = palette.color(QPalette.ColorRole.WindowText)
        painter.setPen(QPen(ink, 1.4))
        painter.drawLine(QPointF(x, plot.top()), QPointF(x, bar.bottom()))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(ink)
        tip = bar.bottom() - 2
        painter.drawPolygon(
            QPolygonF(
                [QPointF(x, tip), QPointF(x - _HANDLE, tip + _HANDLE + 3), QPointF(x + _HANDLE, tip + _HANDLE + 3)]
            )
        )

    def _paint_text(self, painter: QPainter, bar: QRectF, palette: QPalette) -> None:
        line = QRectF(
            bar.left() - _MARGIN + 1, bar.bottom() + _HANDLE + 2, self.width() - 2, self.fontMetrics().height()
        )
        painter.setPen(palette.color(QPalette.ColorRole.WindowText))
        below, above = self._clipped
        low = f"{self._low:.3f}" + (f" ({below:.1%} below)" if below >= 0.0005 else "")
        high = (f"({above:.1%} above) " if above >= 0.0005 else "") + f"{self._high:.3f}"
        painter.drawText(line, int(Qt.AlignmentFlag.AlignLeft), low)
        painter.drawText(line, int(Qt.AlignmentFlag.AlignRight), high)
