"""The tool that moves, turns and scales what is selected by handles in the view."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from PyQt6.QtCore import QPoint, QPointF, Qt
from PyQt6.QtGui import QMouseEvent
from PyQt6.QtWidgets import QLabel

from app.viewport import Viewport
from bake.types import Float64Array
from viewer.gizmo import Gizmo, Handle, Motion

_ARROW_PIXELS, _GRAB_PIXELS, _WIDTH = 90.0, 7.0, 2.5
_NAME = "gizmo"
_FROM_CURSOR = QPoint(18, 14)


class MoveTool:
    """A tool of the view: draws the handles and takes drags of them.

    Args:
        viewport: Where it works.
        centre: Where the handles belong now, shape (3,), metres from the world's origin; None for nowhere.
        preview: Shows what a drag would do, about that centre.
        commit: Does it.
    """

    def __init__(
        self,
        viewport: Viewport,
        *,
        centre: Callable[[], Float64Array | None],
        preview: Callable[[Motion], object],
        commit: Callable[[Motion], object],
    ) -> None:
        self._viewport, self._centre, self._preview, self._commit = viewport, centre, preview, commit
        self._on = False
        self._active: Handle | None = None
        self._drag: tuple[Gizmo, Handle, tuple[Float64Array, Float64Array]] | None = None
        self._motion = Motion()
        self.label = QLabel(viewport.view)
        self.label.setStyleSheet("color: #f2f3f4; background: rgba(20, 22, 26, 190); padding: 2px 6px;")
        self.label.hide()
        viewport.navigation.gestures.insert(0, self)
        viewport.navigation.hovered.connect(self._hover)
        viewport.camera_changed.connect(lambda _camera: self.draw())

    @property
    def is_on(self) -> bool:
        """Whether the handles are out."""
        return self._on

    @property
    def is_dragging(self) -> bool:
        """Whether one of them is in the hand."""
        return self._drag is not None

    def switch(self, on: bool) -> None:
        """Takes the handles out or puts them away."""
        self._on = on
        self._active = None
        self.draw()

    def draw(self) -> None:
        """Draws the handles where they belong."""
        gizmo = self._gizmo()
        shapes = None if gizmo is None else gizmo.shapes(self._active)
        self._viewport.set_shapes(_NAME, shapes, width=_WIDTH, in_front=True)

    def press(self, event: QMouseEvent) -> bool:
        """Takes a handle."""
        gizmo = self._gizmo()
        handle = self._handle_at(event.position())
        if gizmo is None or handle is None:
            return False
        self._active, self._motion = handle, Motion()
        self._drag = (gizmo, handle, self._viewport.ray_at(event.position()))
        self.draw()
        return True

    def move(self, event: QMouseEvent) -> None:
        """The drag goes on; with Ctrl in whole steps."""
        if self._drag is None:
            return
        gizmo, handle, start = self._drag
        snap = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        self._motion = gizmo.dragged(handle, start, self._viewport.ray_at(event.position()), snap=snap)
        self._preview(self._motion)
        self.label.setText(self._motion.text)
        self.label.adjustSize()
        self.label.move(event.position().toPoint() + _FROM_CURSOR)
        self.label.show()
        self.draw()

    def release(self, event: QMouseEvent) -> None:
        """The drag ends: what it did is done."""
        if self._drag is None:
            return
        motion = self._motion
        self._end()
        if not motion.is_still:
            self._commit(motion)

    def give_up(self) -> None:
        """Takes the drag back."""
        if self._drag is not None:
            self._end()
            self._preview(Motion())

    def _end(self) -> None:
        self._drag, self._active, self._motion = None, None, Motion()
        self.label.hide()
        self.draw()

    def _hover(self, position: QPointF) -> None:
        if not self._on or self._drag is not None:
            return
        handle = self._handle_at(position)
        if handle != self._active:
            self._active = handle
            self.draw()

    def _handle_at(self, position: QPointF) -> Handle | None:
        gizmo = self._gizmo()
        if gizmo is None:
            return None
        angle = _GRAB_PIXELS * self._viewport.camera.view_angle / max(self._viewport.view.height(), 1)
        return gizmo.handle_at(*self._viewport.ray_at(position), angle)

    def _gizmo(self) -> Gizmo | None:
        centre = self._centre() if self._on else None
        if centre is None:
            return None
        if self._drag is not None:
            centre = self._drag[0].centre + np.asarray(self._motion.shift)
        camera = self._viewport.camera
        depth = float((camera.eye - centre) @ camera.backward)
        if depth <= 0.0:
            return None
        height = 2.0 * depth * math.tan(camera.view_angle / 2.0)
        return Gizmo(centre, _ARROW_PIXELS * height / max(self._viewport.view.height(), 1), camera.picture_up)
