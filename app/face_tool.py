"""The tool that chooses triangles in the view: by a box, by a lasso, or with a brush."""

from __future__ import annotations

import enum
from collections.abc import Callable

import numpy as np
from PyQt6.QtCore import QPoint, QPointF, Qt
from PyQt6.QtGui import QMouseEvent
from PyQt6.QtWidgets import QLabel

from app.navigation import CLICK_PIXELS
from app.viewport import Viewport
from bake.types import Float64Array

_NAME = "face outline"
_COLORS = {0: (255, 200, 40), 1: (110, 225, 110), -1: (255, 105, 95)}
_HINTS = {0: "Choose", 1: "Add", -1: "Take away"}
_STEP_PIXELS = 4.0
_CIRCLE = 28
_FROM_CURSOR = QPoint(18, 14)
LEAST_RADIUS, MOST_RADIUS = 4.0, 400.0
"""Of the brush, in pixels."""


class Outline(enum.Enum):
    """How triangles are chosen."""

    BOX = "box"
    LASSO = "lasso"
    BRUSH = "brush"


class FaceTool:
    """A tool of the view: a drag draws an outline, and what is seen in it is chosen; a click chooses one triangle.

    With Shift held when it begins a drag adds, with Ctrl it takes away; the outline's colour and a word at the cursor
    say which. With Alt drags are the camera's.

    Args:
        viewport: Where it works.
        choose: Told the outline, shape (k, 2), in [-1, 1] right and up, and whether it adds to (1), takes from (-1) or
            replaces (0) what is chosen. A brush tells one for each step of its way.
        click: Told a triangle, -1 for background, and the same number.
        ended: Told when a drag has ended.
    """

    def __init__(
        self,
        viewport: Viewport,
        choose: Callable[[Float64Array, int], object],
        *,
        click: Callable[[int, int], object],
        ended: Callable[[], object],
    ) -> None:
        self._viewport, self._choose, self._click, self._ended = viewport, choose, click, ended
        self.outline: Outline | None = None
        self.radius = 24.0
        self._way: list[QPointF] = []
        self._cursor: QPointF | None = None
        self._sign = 0
        self._strokes = 0
        self.label = QLabel(viewport.view)
        self.label.setStyleSheet("color: #f2f3f4; background: rgba(20, 22, 26, 190); padding: 2px 6px;")
        self.label.hide()
        viewport.navigation.gestures.append(self)
        viewport.navigation.hovered.connect(self._hover)
        viewport.view.mouse_left.connect(self._leave)

    @property
    def is_dragging(self) -> bool:
        """Whether an outline is being drawn."""
        return bool(self._way)

    def switch(self, outline: Outline | None) -> None:
        """Takes the tool out, or puts it away."""
        self.outline = outline
        self._end()
        view = self._viewport.view
        if outline is None:
            view.unsetCursor()
        else:
            view.setCursor(Qt.CursorShape.CrossCursor)

    def set_radius(self, pixels: float) -> None:
        """Gives the brush another radius."""
        self.radius = min(max(pixels, LEAST_RADIUS), MOST_RADIUS)
        if self.outline is Outline.BRUSH and self._cursor is not None:
            self._draw(self._circle(self._cursor))

    def press(self, event: QMouseEvent) -> bool:
        """Begins an outline."""
        if self.outline is None or event.modifiers() & Qt.KeyboardModifier.AltModifier:
            return False
        self._sign, self._strokes = _sign_of(event), 0
        self._way = [event.position()]
        if self.outline is Outline.BRUSH:
            self._stroke()
        self._tell(event.position())
        return True

    def move(self, event: QMouseEvent) -> None:
        """Draws it on."""
        if not self._way:
            return
        place = event.position()
        step = place - self._way[-1]
        far = float(np.hypot(step.x(), step.y()))
        if self.outline is Outline.BRUSH and far >= 0.5 * self.radius:
            for share in np.linspace(0.0, 1.0, int(np.ceil(far / self.radius)) + 1)[1:]:
                self._way.append(self._way[-1] + (place - self._way[-1]) * float(share))
                self._stroke()
        elif self.outline is Outline.LASSO and far >= _STEP_PIXELS:
            self._way.append(place)
        elif self.outline is Outline.BOX:
            self._way[1:] = [place]
        self._draw(self._circle(place) if self.outline is Outline.BRUSH else self._corners())
        self._tell(place)

    def release(self, event: QMouseEvent) -> None:
        """Ends it: what is seen in it is chosen."""
        if not self._way:
            return
        corners, sign, place = self._corners(), self._sign, event.position()
        far = max(float(np.hypot(p.x() - self._way[0].x(), p.y() - self._way[0].y())) for p in (*self._way, place))
        self._end()
        if self.outline is Outline.BRUSH:
            self._draw(self._circle(place))
        elif far < CLICK_PIXELS:
            pick = self._viewport.pick_at(place)
            self._click(-1 if pick is None else pick.face, sign)
        elif len(corners) >= 3:
            self._choose(self._in_picture(corners), sign)
        self._ended()

    def give_up(self) -> None:
        """Drops the outline that is being drawn; what a brush has painted stays."""
        if self._way:
            self._end()
            self._ended()

    def _end(self) -> None:
        self._way = []
        self.label.hide()
        self._draw([])

    def _stroke(self) -> None:
        sign = self._sign if self._sign or not self._strokes else 1  # the first step replaces, the others add
        self._strokes += 1
        self._choose(self._in_picture(self._circle(self._way[-1])), sign)

    def _hover(self, position: QPointF) -> None:
        self._cursor = position
        if self.outline is Outline.BRUSH:
            self._draw(self._circle(position))

    def _leave(self) -> None:
        self._cursor = None
        if self.outline is Outline.BRUSH and not self._way:
            self._draw([])

    def _tell(self, place: QPointF) -> None:
        self.label.setText(_HINTS[self._sign])
        self.label.adjustSize()
        self.label.move(place.toPoint() + _FROM_CURSOR)
        self.label.show()

    def _corners(self) -> list[QPointF]:
        if self.outline is Outline.LASSO:
            return self._way
        if len(self._way) < 2:
            return []
        a, b = self._way[0], self._way[1]
        return [a, QPointF(b.x(), a.y()), b, QPointF(a.x(), b.y())]

    def _circle(self, middle: QPointF) -> list[QPointF]:
        angles = np.linspace(0.0, 2.0 * np.pi, _CIRCLE, endpoint=False)
        return [middle + QPointF(self.radius * np.cos(angle), self.radius * np.sin(angle)) for angle in angles]

    def _in_picture(self, corners: list[QPointF]) -> Float64Array:
        view = self._viewport.view
        places = [
            (2.0 * (p.x() + 0.5) / view.width() - 1.0, 1.0 - 2.0 * (p.y() + 0.5) / view.height()) for p in corners
        ]
        return np.clip(np.array(places), -1.0, 1.0)

    def _draw(self, corners: list[QPointF]) -> None:
        """A closed line through points of the picture, drawn just before the eye."""
        if len(corners) < 2:
            self._viewport.set_shapes(_NAME, None)
            return
        camera = self._viewport.camera
        points = []
        for corner in corners:
            origin, direction = self._viewport.ray_at(corner)
            points.append(origin + direction * camera.distance / max(float(-direction @ camera.backward), 1e-6))
        numbers = np.arange(len(points), dtype=np.int32)
        pairs = np.stack((numbers, np.roll(numbers, -1)), axis=1)
        color = _COLORS[self._sign if self._way else 0]
        colors = np.tile(np.array(color, np.uint8), (len(points), 1))
        self._viewport.set_shapes(_NAME, (np.array(points, np.float32), pairs, colors), width=2.0, in_front=True)


def _sign_of(event: QMouseEvent) -> int:
    held = event.modifiers()
    if held & Qt.KeyboardModifier.ShiftModifier:
        return 1
    return -1 if held & Qt.KeyboardModifier.ControlModifier else 0
