"""The remap curve as a small plot: drag points, add them by double click, remove them by right click."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

import numpy as np
from PyQt6.QtCore import QPointF, QRectF, QSize, Qt, pyqtSignal
from PyQt6.QtGui import QMouseEvent, QPainter, QPaintEvent, QPalette, QPen, QPolygonF
from PyQt6.QtWidgets import QSizePolicy, QWidget

from viewer.tone import RemapCurve

_MARGIN, _RADIUS = 8, 4.5
_GAP = 0.01
_MOST_POINTS = 12


class CurveWidget(QWidget):
    """Edits a `RemapCurve`; its exponent is set elsewhere and drawn here."""

    curve_changed = pyqtSignal(object)  # RemapCurve

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._curve = RemapCurve()
        self._grabbed = -1
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setToolTip(
            "Remap curve of the blended AO: baked value to the right, shown value upwards.\n"
            "Drag a point, double-click to add one, right-click to remove one."
        )

    def curve(self) -> RemapCurve:
        """The curve as edited."""
        return self._curve

    def set_curve(self, curve: RemapCurve) -> None:
        """Shows a curve without a signal."""
        self._curve = curve
        self.update()

    def sizeHint(self) -> QSize:
        """Wide and low: it is one of many controls."""
        return QSize(220, 92)

    def paintEvent(self, event: QPaintEvent | None) -> None:
        """Paints the grid, the curve and its points."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        palette, plot = self.palette(), self._plot()
        painter.fillRect(plot, palette.color(QPalette.ColorRole.Base))
        painter.setPen(QPen(palette.color(QPalette.ColorRole.Midlight), 1))
        for share in (0.25, 0.5, 0.75):
            painter.drawLine(self._to_pixel(share, 0.0), self._to_pixel(share, 1.0))
            painter.drawLine(self._to_pixel(0.0, share), self._to_pixel(1.0, share))
        painter.setPen(QPen(palette.color(QPalette.ColorRole.Mid), 1))
        painter.drawRect(plot)
        xs = np.linspace(0.0, 1.0, 128, dtype=np.float32)
        ys = self._curve(xs)
        color = palette.color(QPalette.ColorRole.Highlight)
        if not self.isEnabled():
            color = palette.color(QPalette.ColorRole.Mid)
        painter.setPen(QPen(color, 2))
        painter.drawPolyline(QPolygonF([self._to_pixel(float(x), float(y)) for x, y in zip(xs, ys, strict=True)]))
        painter.setPen(QPen(palette.color(QPalette.ColorRole.WindowText), 1))
        painter.setBrush(palette.color(QPalette.ColorRole.Base))
        for x, y in self._curve.points:
            painter.drawEllipse(self._to_pixel(x, y**self._curve.exponent), _RADIUS, _RADIUS)
        painter.end()

    def mousePressEvent(self, event: QMouseEvent | None) -> None:
        """Grabs a point, or removes one."""
        if event is None:
            return
        index = self._point_at(event.position())
        if event.button() is Qt.MouseButton.LeftButton:
            self._grabbed = index
        elif event.button() is Qt.MouseButton.RightButton and 0 < index < len(self._curve.points) - 1:
            self._apply([point for number, point in enumerate(self._curve.points) if number != index])

    def mouseMoveEvent(self, event: QMouseEvent | None) -> None:
        """Moves the grabbed point between its neighbours."""
        if event is None or self._grabbed < 0:
            return
        points = list(self._curve.points)
        x, y = self._to_value(event.position())
        last = len(points) - 1
        if self._grabbed in (0, last):
            x = points[self._grabbed][0]
        else:
            x = min(max(x, points[self._grabbed - 1][0] + _GAP), points[self._grabbed + 1][0] - _GAP)
        points[self._grabbed] = (x, y)
        self._apply(points)

    def mouseReleaseEvent(self, event: QMouseEvent | None) -> None:
        """Lets go."""
        self._grabbed = -1

    def mouseDoubleClickEvent(self, event: QMouseEvent | None) -> None:
        """Adds a point, unless there is one already."""
        if event is None or event.button() is not Qt.MouseButton.LeftButton:
            return
        x, y = self._to_value(event.position())
        xs = [point[0] for point in self._curve.points]
        if len(xs) >= _MOST_POINTS or min(abs(x - other) for other in xs) < _GAP:
            return
        self._apply(sorted([*self._curve.points, (x, y)]))

    def _apply(self, points: list[tuple[float, float]]) -> None:
        self._curve = RemapCurve(tuple(points), self._curve.exponent)
        self.update()
        self.curve_changed.emit(self._curve)

    def _plot(self) -> QRectF:
        return QRectF(_MARGIN, _MARGIN / 2, self.width() - 2 * _MARGIN, self.height() - _MARGIN)

    def _to_pixel(self, x: float, y: float) -> QPointF:
        plot = self._plot()
        return QPointF(plot.left() + x * plot.width(), plot.bottom() - y * plot.height())

    def _to_value(self, position: QPointF) -> tuple[float, float]:
        plot = self._plot()
        x = min(max((position.x() - plot.left()) / plot.width(), 0.0), 1.0)
        y = min(max((plot.bottom() - position.y()) / plot.height(), 0.0), 1.0)
        return x, y ** (1.0 / self._curve.exponent)

    def _point_at(self, position: QPointF) -> int:
        for index, (x, y) in enumerate(self._curve.points):
            offset = self._to_pixel(x, y**self._curve.exponent) - position
            if offset.x() ** 2 + offset.y() ** 2 <= (2.0 * _RADIUS) ** 2:
                return index
        return -1
