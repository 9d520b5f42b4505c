"""The plot of a walk: scrub by dragging, go to pops by a click, zoom by the wheel."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

from PyQt6.QtCore import QEvent, QPointF, QSize, Qt, pyqtSignal
from PyQt6.QtGui import (
    QHelpEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPalette,
    QPen,
    QPixmap,
    QResizeEvent,
    QWheelEvent,
)
from PyQt6.QtWidgets import QSizePolicy, QToolTip, QWidget

from app.walk_painting import BOTTOM, LEFT, RIGHT, TOP, PlotLayout, WalkPainter
from app.walk_state import WalkState
from bake.walk import Pop
from viewer.walk_curves import TITLES, frame_at
from viewer.walk_rows import facing

_CLOSE = 7.0
_SHORTEST = 0.25
_TIP = (
    "AO over time; below it the largest step of AO from frame to frame, the dashed line is one 8-bit code at white.\n"
    "Drag to go to a moment, click a triangle to go to a pop, wheel to zoom, double-click for all of it."
)
_NO_WALK = "No walk yet: make a tour, pick points in the view, or open a path."
_NO_REGIONS = "A walk leads through regions: bake with regions first."


class WalkPlot(QWidget):
    """AO of all variants on one axis of time, with regions, pops and the moment in view.

    Curves are painted once into a picture; the moment moves over it.
    """

    pop_chosen = pyqtSignal(object)  # Pop

    def __init__(self, state: WalkState, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._state = state
        self._span = (0.0, 1.0)
        self._length = 0.0  # of the walk that the span belongs to
        self._picture: QPixmap | None = None
        self._painter: WalkPainter | None = None
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumSize(200, 90)
        self.setMouseTracking(True)
        state.walk_changed.connect(self._on_walk)
        state.view_changed.connect(self._forget)
        state.frame_changed.connect(self.update)

    def sizeHint(self) -> QSize:
        """Wide and low."""
        return QSize(520, 150)

    @property
    def layout_now(self) -> PlotLayout:
        """Where things are."""
        return PlotLayout(self.width(), self.height(), *self._span)

    def zoom(self, factor: float, about: float) -> None:
        """Shows a shorter span (factor above 1) or a longer one, keeping a time where it is."""
        if self._state.walk is None:
            return
        begin, end = self._span
        length = min(max((end - begin) / factor, min(_SHORTEST, self._length)), self._length)
        first = about - (about - begin) * length / (end - begin)
        first = min(max(first, 0.0), self._length - length)
        self._span = (first, first + length)
        self._forget()

    def show_all(self) -> None:
        """Shows the whole walk."""
        walk = self._state.walk
        self._length = max(float(walk.time[-1]), 1e-3) if walk is not None else 1.0
        self._span = (0.0, self._length)
        self._forget()

    def pop_at(self, position: QPointF) -> Pop | None:
        """The worst pop whose mark is under a position."""
        if self._state.walk is None or position.y() > TOP + 2:
            return None
        layout = self.layout_now
        return next((pop for pop in self._state.pops if abs(layout.x(pop.time) - position.x()) <= _CLOSE), None)

    def paintEvent(self, event: QPaintEvent | None) -> None:
        """Paints the curves and the moment in view."""
        painter = QPainter(self)
        if self._state.walk is None or self._painter is None:
            painter.setPen(self.palette().color(QPalette.ColorRole.PlaceholderText))
            text = _NO_REGIONS if self._state.regions.regions is None else _NO_WALK
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap, text)
            painter.end()
            return
        if self._picture is None:
            self._picture = self._painted(self._painter)
        painter.drawPixmap(0, 0, self._picture)
        x = self.layout_now.x(self._state.time)
        if LEFT <= x <= self.width() - RIGHT:
            painter.setPen(QPen(self.palette().color(QPalette.ColorRole.Highlight), 2))
            painter.drawLine(QPointF(x, TOP), QPointF(x, self.height() - BOTTOM + 4))
        painter.end()

    def _painted(self, walk_painter: WalkPainter) -> QPixmap:
        ratio = self.devicePixelRatioF()
        picture = QPixmap(self.size() * ratio)
        picture.setDevicePixelRatio(ratio)
        picture.fill(Qt.GlobalColor.transparent)
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        walk_painter.paint(painter, self.layout_now, self._state.view, self._state.pops, self.palette())
        painter.end()
        return picture

    # Mouse

    def mousePressEvent(self, event: QMouseEvent | None) -> None:
        """Goes to a pop or to a moment."""
        if event is None or event.button() is not Qt.MouseButton.LeftButton:
            return
        pop = self.pop_at(event.position())
        if pop is not None:
            self.pop_chosen.emit(pop)
        else:
            self._scrub(event.position())

    def mouseMoveEvent(self, event: QMouseEvent | None) -> None:
        """Scrubs while the button is held."""
        if event is None:
            return
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._scrub(event.position())
        over = self.pop_at(event.position()) is not None
        self.setCursor(Qt.CursorShape.PointingHandCursor if over else Qt.CursorShape.ArrowCursor)

    def mouseDoubleClickEvent(self, event: QMouseEvent | None) -> None:
        """Shows the whole walk."""
        self.show_all()

    def wheelEvent(self, event: QWheelEvent | None) -> None:
        """Zooms about the cursor."""
        if event is not None:
            self.zoom(1.25 ** (event.angleDelta().y() / 120.0), self.layout_now.time(event.position().x()))
            event.accept()

    def event(self, event: QEvent | None) -> bool:
        """Says what a pop's mark stands for."""
        if isinstance(event, QHelpEvent) and event.type() is QEvent.Type.ToolTip:
            pop = self.pop_at(QPointF(event.pos()))
            QToolTip.showText(event.globalPos(), _TIP if pop is None else self._tip(pop), self)
            return True
        return super().event(event)

    def resizeEvent(self, event: QResizeEvent | None) -> None:
        """Paints anew."""
        self._forget()

    def changeEvent(self, event: QEvent | None) -> None:
        """Paints anew in other colours."""
        super().changeEvent(event)
        if event is not None and event.type() is QEvent.Type.PaletteChange:
            self._forget()

    def _tip(self, pop: Pop) -> str:
        regions = self._state.regions.regions
        if regions is None:
            return _TIP
        names = regions.graph.names
        where = names[pop.before] if pop.before == pop.after else f"{names[pop.before]} → {names[pop.after]}"
        return f"{where}\n{TITLES[pop.variant]}: {pop.codes:.1f} codes, AO {pop.step:+.4f}, facing {facing(pop.normal)}"

    def _scrub(self, position: QPointF) -> None:
        walk = self._state.walk
        if walk is not None:
            self._state.set_frame(frame_at(walk, self.layout_now.time(position.x())))

    def _on_walk(self) -> None:
        walk = self._state.walk
        self._painter = None if walk is None else WalkPainter(walk, self._state.steps)
        if walk is None or max(float(walk.time[-1]), 1e-3) != self._length:
            self.show_all()
        self._forget()

    def _forget(self) -> None:
        self._picture = None
        self.update()
