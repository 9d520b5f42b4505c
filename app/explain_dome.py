"""The hemisphere over the explained spot as a small lit disc: a dot a ray, named under the cursor."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from PyQt6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, pyqtSignal
from PyQt6.QtGui import (
    QColor,
    QFont,
    QLinearGradient,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPalette,
    QPen,
    QPixmap,
    QPolygonF,
    QResizeEvent,
)
from PyQt6.QtWidgets import QSizePolicy, QWidget

from bake.explain.types import Explanation, ShareKind
from bake.types import Float64Array
from viewer.colormaps import CIVIDIS
from viewer.explain_dome import Dome, belongs, dome_of, horizon_of
from viewer.fields import distance_label

_MARGIN, _GAP = 12, 14
_LEVELS = 24
_GROUND = QColor("#e3e6ea")
"""No colour of the map; what is lost and what is open both stand out from it."""
_INK, _HALO = QColor("#202224"), QColor("#ffffff")
_FADED = 0.12
_REACH = 7.0
"""Pixels within which a dot is meant."""
_TURN = math.radians(1.0)
_TIP = (
    "Directions over the spot, seen from above it and turned with the view: the normal is the cross in the middle,\n"
    "the rim lies in the surface, the dashed line is level. Equal areas count the same.\n"
    "Point at a dot to see what stops the ray; click to choose that occluder."
)


class ExplainDome(QWidget):
    """Shows the rays of an explanation's heaviest samples by direction."""

    occluder_clicked = pyqtSignal(int)
    """Object, -1 for none."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._explanation: Explanation | None = None
        self._paths: Sequence[str] = ()
        self._dome: Dome | None = None
        self._column, self._owner, self._ray = 0, -1, -1
        self._up: Float64Array | None = None
        self._angle = 0.0
        self._picture: QPixmap | None = None
        self.setMouseTracking(True)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setToolTip(_TIP)

    @property
    def dome(self) -> Dome | None:
        """What is shown."""
        return self._dome

    @property
    def owner_under_cursor(self) -> int:
        """The object that stops the ray under the cursor; -1 for none."""
        return int(self._dome.object[self._ray]) if self._dome is not None and self._ray >= 0 else -1

    def set_explanation(self, explanation: Explanation | None, paths: Sequence[str] = (), column: int = 0) -> None:
        """Shows an explanation at one distance; None shows nothing.

        Args:
            explanation: With rays.
            paths: `World.object_paths`.
            column: Which distance.
        """
        self._explanation, self._paths, self._column = explanation, paths, column
        self._ray, self._owner = -1, -1
        self._dome = None if explanation is None else dome_of(explanation, column)
        self._turn()
        self._forget()

    def set_column(self, column: int) -> None:
        """Looks at another distance."""
        owner = self._owner
        self.set_explanation(self._explanation, self._paths, column)
        self.set_occluder(owner)

    def set_occluder(self, owner: int) -> None:
        """Lets the rays of one object stand out; -1 for all alike."""
        if owner != self._owner:
            self._owner = owner
            self._forget()

    def set_up(self, up: Float64Array) -> None:
        """What is up in the view, shape (3,): the disc turns with it."""
        self._up = up
        before = self._angle
        self._turn()
        if abs(self._angle - before) > _TURN:
            self._forget()
        else:
            self._angle = before

    def sizeHint(self) -> QSize:
        """As high as the disc is wide."""
        return QSize(300, 184)

    def position_of(self, ray: int) -> QPointF:
        """Where in the widget a ray is drawn."""
        assert self._dome is not None
        return self._to_pixel(self._dome.position[ray : ray + 1].astype(np.float64))[0]

    def paintEvent(self, event: QPaintEvent | None) -> None:
        """Paints the disc, and what is known of the ray under the cursor."""
        if self._dome is None or self._explanation is None:
            return
        if self._picture is None:
            self._picture = self._painted(self._dome)
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.drawPixmap(0, 0, self._picture)
        if self._ray >= 0:
            painter.setPen(QPen(self.palette().color(QPalette.ColorRole.Highlight), 2))
            painter.drawEllipse(self.position_of(self._ray), 5.0, 5.0)
        self._paint_words(painter, self._dome, self._explanation)
        painter.end()

    def mouseMoveEvent(self, event: QMouseEvent | None) -> None:
        """Looks for the ray under the cursor."""
        if event is not None:
            self._point_at(event.position())

    def leaveEvent(self, event: QEvent | None) -> None:
        """Points at nothing."""
        self._show_ray(-1)

    def mousePressEvent(self, event: QMouseEvent | None) -> None:
        """Chooses the occluder under the cursor, or none."""
        if event is not None and event.button() is Qt.MouseButton.LeftButton and self._dome is not None:
            self._point_at(event.position())
            self.occluder_clicked.emit(self.owner_under_cursor)

    def resizeEvent(self, event: QResizeEvent | None) -> None:
        """Paints anew."""
        self._forget()

    def changeEvent(self, event: QEvent | None) -> None:
        """Follows the palette."""
        super().changeEvent(event)
        if event is not None and event.type() in (QEvent.Type.PaletteChange, QEvent.Type.FontChange):
            self._forget()

    # Where things are

    @property
    def _radius(self) -> float:
        return max(min(self.height() / 2 - _MARGIN, self.width() * 0.29), 10.0)

    @property
    def _middle(self) -> QPointF:
        return QPointF(_MARGIN + self._radius, self.height() / 2)

    def _to_pixel(self, disc: Float64Array) -> list[QPointF]:
        """Points of the disc, shape (n, 2), in the widget."""
        middle, radius = self._middle, self._radius
        c, s = math.cos(self._angle), math.sin(self._angle)
        x = middle.x() + radius * (c * disc[:, 0] - s * disc[:, 1])
        y = middle.y() - radius * (s * disc[:, 0] + c * disc[:, 1])
        return [QPointF(*pair) for pair in zip(x.tolist(), y.tolist(), strict=True)]

    def _turn(self) -> None:
        angle = None if self._dome is None or self._up is None else self._dome.angle_of(self._up)
        self._angle = 0.0 if angle is None else math.pi / 2 - angle

    def _point_at(self, position: QPointF) -> None:
        if self._dome is None:
            return
        offset, radius = position - self._middle, self._radius
        x, y = offset.x() / radius, -offset.y() / radius
        c, s = math.cos(self._angle), math.sin(self._angle)
        self._show_ray(self._dome.nearest(c * x + s * y, c * y - s * x, _REACH / radius))

    def _show_ray(self, ray: int) -> None:
        if ray != self._ray:
            self._ray = ray
            self.update()

    def _forget(self) -> None:
        self._picture = None
        self.update()

    # Painting

    def _painted(self, dome: Dome) -> QPixmap:
        ratio = self.devicePixelRatioF()
        picture = QPixmap(math.ceil(self.width() * ratio), math.ceil(self.height() * ratio))
        picture.setDevicePixelRatio(ratio)
        picture.fill(Qt.GlobalColor.transparent)
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        middle, radius = self._middle, self._radius
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(_GROUND)
        painter.drawEllipse(middle, radius, radius)
        self._paint_dots(painter, dome)
        self._paint_marks(painter, dome)
        painter.end()
        return picture

    def _paint_dots(self, painter: QPainter, dome: Dome) -> None:
        size = min(max(1.25 * self._radius * math.sqrt(math.pi / max(len(dome), 1)), 1.8), 12.0)
        level = np.clip(dome.counts * _LEVELS, 0, _LEVELS - 1).astype(np.int64)
        own = belongs(dome, self._owner)
        points = self._to_pixel(dome.position.astype(np.float64))
        shades = CIVIDIS.colors(np.arange(_LEVELS, dtype=np.float32), -0.5, _LEVELS - 0.5).tolist()
        for part, alpha in ((~own, _FADED), (own, 1.0)):
            for number, shade in enumerate(shades):
                rows = np.flatnonzero(part & (level == number)).tolist()
                if rows:
                    color = QColor(*shade)
                    color.setAlphaF(alpha)
                    painter.setPen(QPen(color, size, cap=Qt.PenCapStyle.RoundCap))
                    painter.drawPoints(QPolygonF([points[row] for row in rows]))

    def _paint_marks(self, painter: QPainter, dome: Dome) -> None:
        """The rim, the normal, and what is level."""
        middle, radius, palette = self._middle, self._radius, self.palette()
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(palette.color(QPalette.ColorRole.Mid), 1.5))
        painter.drawEllipse(middle, radius + 1, radius + 1)
        for color, width in ((_HALO, 3.4), (_INK, 1.4)):
            painter.setPen(QPen(color, width))
            painter.drawLine(middle - QPointF(5, 0), middle + QPointF(5, 0))
            painter.drawLine(middle - QPointF(0, 5), middle + QPointF(0, 5))
        assert self._explanation is not None
        level = horizon_of(dome, self._explanation.spot.normal)
        if len(level):
            line = QPolygonF(self._to_pixel(level))
            for color, width, style in (
                (_HALO, 2.8, Qt.PenStyle.SolidLine),
                (_INK, 1.2, Qt.PenStyle.DashLine),
            ):
                painter.setPen(QPen(color, width, style))
                painter.drawPolyline(line)

    def _paint_words(self, painter: QPainter, dome: Dome, explanation: Explanation) -> None:
        left = self._middle.x() + self._radius + _GAP
        room = QRectF(left, _MARGIN, self.width() - left - 4, self.height() - 2 * _MARGIN)
        palette, metrics = self.palette(), self.fontMetrics()
        lines = self._lines(dome, explanation)
        y = room.top()
        for number, text in enumerate(lines):
            font = QFont(self.font())
            font.setBold(number == 0)
            painter.setFont(font)
            role = (
                QPalette.ColorRole.WindowText if number == 0 or self._ray >= 0 else QPalette.ColorRole.PlaceholderText
            )
            painter.setPen(palette.color(role))
            box = QRectF(room.left(), y, room.width(), room.bottom() - y)
            flags = Qt.AlignmentFlag.AlignLeft | Qt.TextFlag.TextWordWrap
            if number == 0:
                text = metrics.elidedText(text, Qt.TextElideMode.ElideMiddle, int(room.width() * 0.92))
            painter.drawText(box, int(flags), text)
            y += painter.boundingRect(box, int(flags), text).height() + 3
        self._paint_scale(painter, room)

    def _paint_scale(self, painter: QPainter, room: QRectF) -> None:
        height = self.fontMetrics().height()
        bar = QRectF(room.left(), room.bottom() - height - 10, min(room.width(), 130.0), 8)
        blend = QLinearGradient(bar.topLeft(), bar.topRight())
        for stop in np.linspace(0.0, 1.0, 9):
            shade = CIVIDIS.colors(np.array([stop], np.float32), 0.0, 1.0)[0].tolist()
            blend.setColorAt(float(stop), QColor(*shade))
        painter.fillRect(bar, blend)
        painter.setFont(self.font())
        painter.setPen(self.palette().color(QPalette.ColorRole.WindowText))
        words = QRectF(bar.left(), bar.bottom() + 1, bar.width(), height)
        painter.drawText(words, Qt.AlignmentFlag.AlignLeft, "lost")
        painter.drawText(words, Qt.AlignmentFlag.AlignRight, "open")

    def _lines(self, dome: Dome, explanation: Explanation) -> list[str]:
        label = distance_label(explanation.distances[self._column])
        if self._ray < 0:
            few = dome.samples < len(explanation.samples)
            of = f"the {dome.samples:,} heaviest samples" if few else f"all {dome.samples:,} samples"
            return [f"At {label}", f"{len(dome):,} rays of {'its sample' if dome.samples == 1 else of}"]
        owner, metres = self.owner_under_cursor, float(dome.distance[self._ray])
        counts = f"counts {float(dome.counts[self._ray]):.2f} at {label}"
        if owner < 0:
            return ["Open", counts]
        share = sum(
            float(item.share[self._column])
            for item in explanation.shares
            if item.kind is ShareKind.OBJECT and item.object == owner
        )
        where = "passed, dimmed" if math.isinf(metres) else f"stopped at {metres:.2f} m"
        return [self._paths[owner].rpartition("/")[2], where, counts, f"takes {share:+.3f} in all"]
