"""A second result over the first in one view: to the right of a line that can be dragged, or all over it."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

from PyQt6.QtCore import QPointF, QRectF, Qt, pyqtSignal
from PyQt6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen
from PyQt6.QtWidgets import QWidget

from app.viewport import Viewport
from viewer.actors import SurfaceActor
from viewer.display import Display
from viewer.fields import SurfaceField
from viewer.surface_look import draw_surface

_WIDTH, _GRIP = 13, 22
_INK, _EDGE = QColor(255, 255, 255, 235), QColor(0, 0, 0, 150)
_KEPT = 0.02
"""The line stays where it can be grabbed, this share away from the sides."""


class WipeLine(QWidget):
    """The line between two results: dragged, or moved by the arrow keys."""

    moved = pyqtSignal(float)  # share of the view's width

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setCursor(Qt.CursorShape.SplitHCursor)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setToolTip("Drag: this result to the left, the other one to the right")
        self.hide()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Takes hold."""
        event.accept()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Follows the mouse."""
        parent = self.parentWidget()
        if parent is not None and event.buttons() & Qt.MouseButton.LeftButton:
            x = self.mapToParent(event.position().toPoint()).x()
            self.moved.emit(x / max(parent.width(), 1))
        event.accept()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Lets go."""
        event.accept()

    def paintEvent(self, event: QPaintEvent | None) -> None:
        """Paints the line and a grip in its middle."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        x, y = self.width() / 2.0, self.height() / 2.0
        for color, width in ((_EDGE, 3.0), (_INK, 1.4)):
            painter.setPen(QPen(color, width))
            painter.drawLine(QPointF(x, 0.0), QPointF(x, float(self.height())))
        painter.setPen(QPen(_EDGE, 1.0))
        painter.setBrush(_INK)
        painter.drawRoundedRect(QRectF(x - 5.0, y - _GRIP / 2.0, 10.0, _GRIP), 4.0, 4.0)
        painter.setPen(QPen(_EDGE, 1.2))
        for side in (-1.5, 1.5):
            painter.drawLine(QPointF(x + side, y - 5.0), QPointF(x + side, y + 5.0))
        painter.end()


class WipeLayer:
    """Draws other values over a viewport's surface, from the line to its right side.

    Args:
        viewport: Where.
    """

    def __init__(self, viewport: Viewport) -> None:
        self._viewport = viewport
        self._base: SurfaceActor | None = None
        self._twin: SurfaceActor | None = None
        self._share, self._has_line, self._shown = 0.5, False, False
        self.line = WipeLine(viewport.view)
        self.line.moved.connect(self.move_to)
        viewport.view.resized.connect(self._place)

    @property
    def share(self) -> float:
        """Where the line stands, as a share of the view's width."""
        return self._share

    @property
    def is_shown(self) -> bool:
        """Whether the other values are in sight."""
        return self._shown

    def draw(self, field: SurfaceField | None, display: Display) -> None:
        """Colours the surface of the other values; makes it first if the geometry is new."""
        base = self._viewport.surface
        if base is not self._base:
            self._drop_twin()
            self._base = base
        if base is None:
            return
        if self._twin is None:
            self._twin = base.twin()
            self._viewport.view.renderer.AddActor(self._twin.actor)
        draw_surface(self._twin, field, display, self._viewport.relief)
        self._place()

    def show_faces(self) -> None:
        """Shows the same faces as the viewport does."""
        if self._twin is not None and self._base is not None:
            self._twin.show_faces_of(self._base)

    def show(self, *, line: bool) -> None:
        """Shows the other values: right of the line, or everywhere."""
        self._shown, self._has_line = True, line
        self._place()

    def hide(self) -> None:
        """Shows the viewport's own values only."""
        self._shown = False
        self._place()

    def move_to(self, share: float) -> None:
        """Moves the line."""
        self._share = min(max(share, _KEPT), 1.0 - _KEPT)
        self._place()

    def close(self) -> None:
        """Takes everything away."""
        self._shown = False
        self._place()
        self._drop_twin()
        self._base = None
        self._viewport.view.resized.disconnect(self._place)
        self.line.moved.disconnect(self.move_to)
        self.line.setParent(None)
        self.line.deleteLater()

    def _drop_twin(self) -> None:
        if self._twin is not None:
            self._viewport.view.renderer.RemoveActor(self._twin.actor)
            self._twin = None

    def _place(self) -> None:
        view = self._viewport.view
        has_twin = self._twin is not None and self._base is self._viewport.surface
        wiping = self._shown and self._has_line and has_twin
        x = round(self._share * view.width())
        self.line.setVisible(wiping)
        if wiping:
            self.line.setGeometry(x - _WIDTH // 2, 0, _WIDTH, view.height())
            self.line.raise_()
        if self._base is not None and has_twin and self._twin is not None:
            edge, far = x * view.devicePixelRatioF(), 1e9
            self._base.set_span((0.0, edge) if wiping else None)
            self._twin.set_span((edge, far) if wiping else None)
            self._twin.actor.SetVisibility(self._shown)
            self._base.actor.SetVisibility(wiping or not self._shown)
        view.update()
