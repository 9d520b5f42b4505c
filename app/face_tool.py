"""The tool that chooses triangles in the view: by a box, by a lasso, or with a brush."""

from __future__ import annotations

import enum
from collections.abc import Callable

import numpy as np
from PyQt6.QtCore import QPointF, Qt
from PyQt6.QtGui import QMouseEvent

from app.viewport import Viewport
from bake.types import Float64Array

_NAME = "face outline"
_COLOR = (255, 200, 40)
_BRUSH_PIXELS = 24.0
_STEP_PIXELS = 4.0
_CIRCLE = 20


class Outline(enum.Enum):
    """How triangles are chosen."""

    BOX = "box"
    LASSO = "lasso"
    BRUSH = "brush"


class FaceTool:
    """A tool of the view: a drag draws an outline, and what is seen in it is chosen.

    Args:
        viewport: Where it works.
        choose: Told the outline, shape (k, 2), in [-1, 1] right and up, and whether it adds to (1), takes from (-1) or
            replaces (0) what is chosen. A brush tells one for each step of its way.
    """

    def __init__(self, viewport: Viewport, choose: Callable[[Float64Array, int], object]) -> None:
        self._viewport, self._choose = viewport, choose
        self.outline: Outline | None = None
        self._way: list[QPointF] = []
        self._sign = 0
        viewport.navigation.gestures.append(self)
        viewport.navigation.hovered.connect(self._hover)

    def switch(self, outline: Outline | None) -> None:
        """Takes the tool out, or puts it away."""
        self.outline = outline
        self._viewport.set_shapes(_NAME, None)

    def press(self, event: QMouseEvent) -> bool:
        """Begins an outline: with Shift it adds, with Ctrl it takes away."""
        if self.outline is None:
            return False
        held = event.modifiers()
        adds, takes = held & Qt.KeyboardModifier.ShiftModifier, held & Qt.KeyboardModifier.ControlModifier
        self._sign = 1 if adds else -1 if takes else 0
        self._way = [event.position()]
        if self.outline is Outline.BRUSH:
            self._stroke()
        return True

    def move(self, event: QMouseEvent) -> None:
        """Draws it on."""
        step = event.position() - self._way[-1]
        if self.outline is Outline.BRUSH and np.hypot(step.x(), step.y()) >= 0.5 * _BRUSH_PIXELS:
            self._way.append(event.position())
            self._stroke()
        elif self.outline is Outline.LASSO and np.hypot(step.x(), step.y()) >= _STEP_PIXELS:
            self._way.append(event.position())
        elif self.outline is Outline.BOX:
            self._way[1:] = [event.position()]
        self._draw(self._circle(event.position()) if self.outline is Outline.BRUSH else self._corners())

    def release(self, event: QMouseEvent) -> None:
        """Ends it: what is seen in it is chosen."""
        corners = self._corners()
        self._draw([])
        if self.outline in (Outline.BOX, Outline.LASSO) and len(corners) >= 3:
            self._choose(self._in_picture(corners), self._sign)

    def _stroke(self) -> None:
        self._choose(self._in_picture(self._circle(self._way[-1])), self._sign)
        self._sign = self._sign or 1  # the first step replaces, the others add

    def _hover(self, position: QPointF) -> None:
        if self.outline is Outline.BRUSH:
            self._draw(self._circle(position))

    def _corners(self) -> list[QPointF]:
        if self.outline is Outline.LASSO:
            return self._way
        if len(self._way) < 2:
            return []
        a, b = self._way[0], self._way[1]
        return [a, QPointF(b.x(), a.y()), b, QPointF(a.x(), b.y())]

    def _circle(self, middle: QPointF) -> list[QPointF]:
        angles = np.linspace(0.0, 2.0 * np.pi, _CIRCLE, endpoint=False)
        return [middle + QPointF(_BRUSH_PIXELS * np.cos(angle), _BRUSH_PIXELS * np.sin(angle)) for angle in angles]

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
        colors = np.tile(np.array(_COLOR, np.uint8), (len(points), 1))
        self._viewport.set_shapes(_NAME, (np.array(points, np.float32), pairs, colors), width=1.5, in_front=True)
