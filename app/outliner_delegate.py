"""How the outliner paints its rows: eyes, stale marks, and hidden objects in faint letters."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

from PyQt6.QtCore import QModelIndex, QPointF, QRectF, QSize, Qt
from PyQt6.QtGui import QColor, QPainter, QPainterPath, QPalette, QPen
from PyQt6.QtWidgets import QStyle, QStyledItemDelegate, QStyleOptionViewItem

from app.outliner_model import MARK_ROLE, SHOWN_ROLE, Column

EYE_WIDTH = 26
STALE_COLOR = QColor("#b06cf0")
"""Not that of the selection, so that both can be told apart on one object."""
_DOT = 7.0


class OutlinerDelegate(QStyledItemDelegate):
    """Draws an eye in the last column and a dot behind the names of stale objects."""

    def sizeHint(self, option: QStyleOptionViewItem, index: QModelIndex) -> QSize:
        """One line with some air, the same for all."""
        return QSize(60, option.fontMetrics.height() + 6)

    def initStyleOption(self, option: QStyleOptionViewItem | None, index: QModelIndex) -> None:
        """Hidden objects are faint."""
        super().initStyleOption(option, index)
        if option is not None and index.data(SHOWN_ROLE) == 0.0:
            faint = option.palette.color(QPalette.ColorRole.PlaceholderText)
            option.palette.setColor(QPalette.ColorRole.Text, faint)

    def paint(self, painter: QPainter | None, option: QStyleOptionViewItem, index: QModelIndex) -> None:
        """Paints one cell."""
        if painter is None:
            return
        super().paint(painter, option, index)
        if index.column() == Column.EYE:
            self._paint_eye(painter, option, float(index.data(SHOWN_ROLE)))
        elif index.column() == Column.NAME and index.data(MARK_ROLE):
            rect = QRectF(option.rect)
            text = option.fontMetrics.horizontalAdvance(str(index.data())) + 10
            x = min(rect.left() + text, rect.right() - _DOT - 2)
            painter.save()
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(STALE_COLOR)
            painter.drawEllipse(QRectF(x, rect.center().y() - _DOT / 2, _DOT, _DOT))
            painter.restore()

    def _paint_eye(self, painter: QPainter, option: QStyleOptionViewItem, shown: float) -> None:
        chosen = bool(option.state & QStyle.StateFlag.State_Selected)
        role = QPalette.ColorRole.HighlightedText if chosen else QPalette.ColorRole.Text
        color = option.palette.color(role)
        if shown == 0.0 and not chosen:
            color = option.palette.color(QPalette.ColorRole.PlaceholderText)
        centre, half = QRectF(option.rect).center(), 7.0
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(color, 1.3))
        lid = QPainterPath(QPointF(centre.x() - half, centre.y()))
        lid.quadTo(centre.x(), centre.y() + (9.0 if shown else 6.0), centre.x() + half, centre.y())
        if shown:
            lid.quadTo(centre.x(), centre.y() - 9.0, centre.x() - half, centre.y())
        painter.drawPath(lid)
        if shown:
            painter.setBrush(color if shown == 1.0 else Qt.BrushStyle.NoBrush)
            painter.drawEllipse(centre, 2.2, 2.2)
        painter.restore()
