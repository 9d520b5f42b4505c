"""The legend in a corner of the view: what the colours mean, with numbers."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

from PyQt6.QtCore import QRectF, QSize, Qt
from PyQt6.QtGui import QColor, QFont, QImage, QPainter, QPaintEvent, QPen
from PyQt6.QtWidgets import QSizePolicy, QWidget

from viewer.colormaps import INVALID_COLOR, NOT_BAKED_COLOR, ColorMap
from viewer.fields import SurfaceField

_MARGIN, _BAR_HEIGHT, _BAR_WIDTH = 9, 12, 190
_PAPER, _INK, _FAINT = QColor(24, 26, 29, 205), QColor(240, 240, 238), QColor(186, 188, 190)


class Legend(QWidget):
    """Painted, so that it looks the same over any picture and goes into screenshots."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._field: SurfaceField | None = None
        self._map: ColorMap | None = None
        self._range = (0.0, 1.0)
        self._note = ""
        self._swatches: list[tuple[tuple[int, int, int], str]] = []
        self.hide()

    def set_field(
        self, field: SurfaceField | None, color_map: ColorMap | None, value_range: tuple[float, float], note: str = ""
    ) -> None:
        """Explains a field; None hides the legend."""
        self._field, self._map, self._range, self._note = field, color_map, value_range, note
        self._swatches = []
        if field is not None:
            if field.not_baked.any():
                self._swatches.append((NOT_BAKED_COLOR, "not baked (role)"))
            if field.missing_count:
                self._swatches.append((INVALID_COLOR, "no value"))
        self.setVisible(field is not None and color_map is not None)
        self.resize(self.sizeHint())
        self.update()

    def sizeHint(self) -> QSize:
        """Room for the bar, the title and the swatches."""
        line = self.fontMetrics().height()
        lines = 2 + bool(self._note)
        height = 2 * _MARGIN + lines * line + _BAR_HEIGHT + 8 + (line + 4) * len(self._swatches)
        return QSize(_BAR_WIDTH + 2 * _MARGIN, height)

    def paintEvent(self, event: QPaintEvent | None) -> None:
        """Paints the legend."""
        painter = QPainter(self)
        self.paint(painter)
        painter.end()

    def paint(self, painter: QPainter) -> None:
        """Paints the legend with its top left corner at the painter's origin."""
        if self._field is None or self._map is None:
            return
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(_PAPER)
        painter.drawRoundedRect(QRectF(0, 0, self.width(), self.height()), 5, 5)
        line = self.fontMetrics().height()
        y = _MARGIN
        bold = QFont(self.font())
        bold.setBold(True)
        painter.setFont(bold)
        painter.setPen(_INK)
        self._text(painter, y, self._field.title, Qt.AlignmentFlag.AlignLeft)
        y += line
        painter.setFont(self.font())
        if self._note:
            painter.setPen(_FAINT)
            self._text(painter, y, self._note, Qt.AlignmentFlag.AlignLeft)
            y += line
        y += 4
        bar = QRectF(_MARGIN, y, _BAR_WIDTH, _BAR_HEIGHT)
        painter.drawImage(bar, color_bar(self._map))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(_FAINT, 1))
        painter.drawRect(bar)
        y += _BAR_HEIGHT + 2
        painter.setPen(_INK)
        low, high = self._range
        unit = f" {self._field.unit}" if self._field.unit else ""
        ends = (f"{low:.3g}{unit}", f"{(low + high) / 2:.3g}", f"{high:.3g}{unit}")
        sides = (Qt.AlignmentFlag.AlignLeft, Qt.AlignmentFlag.AlignHCenter, Qt.AlignmentFlag.AlignRight)
        for text, side in zip(ends, sides, strict=True):
            self._text(painter, y, text, side)
        y += line + 4
        for color, text in self._swatches:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(*color))
            painter.drawRect(QRectF(_MARGIN, y + 2, line - 4, line - 4))
            painter.setPen(_INK)
            painter.drawText(QRectF(_MARGIN + line + 4, y, _BAR_WIDTH, line), text)
            y += line + 4

    def _text(self, painter: QPainter, y: float, text: str, side: Qt.AlignmentFlag) -> None:
        painter.drawText(QRectF(_MARGIN, y, _BAR_WIDTH, self.fontMetrics().height()), int(side), text)


def color_bar(color_map: ColorMap) -> QImage:
    """A colour map as a picture of 256 × 1 pixels."""
    data = color_map.table().tobytes()
    return QImage(data, 256, 1, 3 * 256, QImage.Format.Format_RGB888).copy()
