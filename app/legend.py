"""The legend in a corner of the view: what the colours mean, with numbers."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

from PyQt6.QtCore import QRectF, QSize, Qt
from PyQt6.QtGui import QColor, QFont, QImage, QPainter, QPaintEvent, QPen
from PyQt6.QtWidgets import QSizePolicy, QWidget

from viewer.colormaps import INVALID_COLOR, NOT_BAKED_COLOR, ColorMap
from viewer.fields import Scale, SurfaceField

_MARGIN, _BAR_HEIGHT, _BAR_WIDTH = 9, 12, 190
_PAPER, _INK, _FAINT = QColor(24, 26, 29, 205), QColor(240, 240, 238), QColor(186, 188, 190)


class Legend(QWidget):
    """Painted, so that it looks the same over any picture and goes into screenshots."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._scale: Scale | None = None
        self.hide()

    @property
    def scale(self) -> Scale | None:
        """What is explained."""
        return self._scale

    def set_field(
        self, field: SurfaceField | None, color_map: ColorMap | None, value_range: tuple[float, float], note: str = ""
    ) -> None:
        """Explains a field; None hides the legend."""
        if field is None or color_map is None:
            self.set_scale(None)
            return
        swatches: list[tuple[tuple[int, int, int], str]] = list(field.swatches)
        if field.not_baked.any():
            swatches.append((NOT_BAKED_COLOR, "not baked (role)"))
        if field.missing_count:
            swatches.append((INVALID_COLOR, "no value"))
        shown = color_map if field.rgb is None else None
        self.set_scale(Scale(field.title, shown, *value_range, field.unit, note, tuple(swatches)))

    def set_scale(self, scale: Scale | None) -> None:
        """Explains colours; None hides the legend."""
        self._scale = scale
        self.setVisible(scale is not None)
        self.resize(self.sizeHint())
        self.update()

    def sizeHint(self) -> QSize:
        """Room for the bar, the title and the swatches."""
        line, scale = self.fontMetrics().height(), self._scale
        if scale is None:
            return QSize(0, 0)
        height = 2 * _MARGIN + line * (1 + bool(scale.note)) + (line + 4) * len(scale.swatches) + 4
        if scale.color_map is not None:
            height += line + _BAR_HEIGHT + 4
        return QSize(_BAR_WIDTH + 2 * _MARGIN, height)

    def paintEvent(self, event: QPaintEvent | None) -> None:
        """Paints the legend."""
        painter = QPainter(self)
        self.paint(painter)
        painter.end()

    def paint(self, painter: QPainter) -> None:
        """Paints the legend with its top left corner at the painter's origin."""
        scale = self._scale
        if scale is None:
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
        self._text(painter, y, scale.title, Qt.AlignmentFlag.AlignLeft)
        y += line
        painter.setFont(self.font())
        if scale.note:
            painter.setPen(_FAINT)
            self._text(painter, y, scale.note, Qt.AlignmentFlag.AlignLeft)
            y += line
        y += 4
        if scale.color_map is not None:
            y = self._paint_bar(painter, y, scale, scale.color_map)
        for color, text in scale.swatches:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(*color))
            painter.drawRect(QRectF(_MARGIN, y + 2, line - 4, line - 4))
            painter.setPen(_INK)
            painter.drawText(QRectF(_MARGIN + line + 4, y, _BAR_WIDTH, line), text)
            y += line + 4

    def _paint_bar(self, painter: QPainter, y: float, scale: Scale, color_map: ColorMap) -> float:
        """Paints the bar and the numbers below it; returns where it ends."""
        bar = QRectF(_MARGIN, y, _BAR_WIDTH, _BAR_HEIGHT)
        painter.drawImage(bar, color_bar(color_map))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(_FAINT, 1))
        painter.drawRect(bar)
        y += _BAR_HEIGHT + 2
        painter.setPen(_INK)
        low, high = scale.low, scale.high
        unit = f" {scale.unit}" if scale.unit else ""
        ends = (f"{low:.3g}{unit}", f"{(low + high) / 2:.3g}", f"{high:.3g}{unit}")
        sides = (Qt.AlignmentFlag.AlignLeft, Qt.AlignmentFlag.AlignHCenter, Qt.AlignmentFlag.AlignRight)
        for text, side in zip(ends, sides, strict=True):
            self._text(painter, y, text, side)
        return y + self.fontMetrics().height() + 4

    def _text(self, painter: QPainter, y: float, text: str, side: Qt.AlignmentFlag) -> None:
        painter.drawText(QRectF(_MARGIN, y, _BAR_WIDTH, self.fontMetrics().height()), int(side), text)


def color_bar(color_map: ColorMap) -> QImage:
    """A colour map as a picture of 256 × 1 pixels."""
    data = color_map.table().tobytes()
    return QImage(data, 256, 1, 3 * 256, QImage.Format.Format_RGB888).copy()
