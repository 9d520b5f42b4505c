"""Mouse and keys to camera: orbit, pan, zoom, look around and fly."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Protocol

import numpy as np
from PyQt6.QtCore import QObject, QPointF, Qt, QTimer, pyqtSignal
from PyQt6.QtGui import QKeyEvent, QMouseEvent

from app.gl_view import GLView
from app.navigation_styles import STYLES, Motion
from viewer.camera import Camera
from viewer.picking import Pick

CLICK_PIXELS = 4
FLIGHT_SECONDS = 0.3
TICK_MS = 16

_FLY_KEYS = {
    Qt.Key.Key_W: (0.0, 0.0, 1.0),
    Qt.Key.Key_S: (0.0, 0.0, -1.0),
    Qt.Key.Key_A: (-1.0, 0.0, 0.0),
    Qt.Key.Key_D: (1.0, 0.0, 0.0),
    Qt.Key.Key_Q: (0.0, -1.0, 0.0),
    Qt.Key.Key_E: (0.0, 1.0, 0.0),
}


class Gesture(Protocol):
    """A tool that takes drags of the left button over from the camera."""

    def press(self, event: QMouseEvent) -> bool:
        """Whether the drag that begins here is the tool's; it then hears of its moves and its end."""
        ...

    def move(self, event: QMouseEvent) -> None:
        """The drag goes on."""
        ...

    def release(self, event: QMouseEvent) -> None:
        """The drag ends."""
        ...


class Navigation(QObject):
    """Moves a camera by the mouse events of a view.

    What a drag does is a matter of `style`. The wheel zooms at the cursor, a double click flies to what is under it.
    While the right button is held one flies with W A S D Q E; the wheel then sets the speed.

    Args:
        view: The widget whose events it takes.
        pick: What is at a position of the widget, in its pixels; None for background.
    """

    camera_changed = pyqtSignal(object)  # Camera
    clicked = pyqtSignal(QPointF)
    hovered = pyqtSignal(QPointF)
    menu_asked = pyqtSignal(QPointF)  # a click of the right button

    def __init__(self, view: GLView, pick: Callable[[QPointF], Pick | None]) -> None:
        super().__init__(view)
        self._view, self._pick = view, pick
        self.gestures: list[Gesture] = []
        """Tools, the first of which that wants a drag of the left button gets it."""
        self._gesture: Gesture | None = None
        self.style = STYLES["obscura"]
        self.camera = Camera()
        self._press: QPointF | None = None
        self._last = QPointF()
        self._dragging = False
        self._flown = False  # with keys, while the right button is held
        self._button = Qt.MouseButton.NoButton
        self._held: set[Qt.Key] = set()
        self._speed = 0.5  # in distances to the focal point a second
        self._flight: tuple[float, Camera, Camera] | None = None
        self._ticked = 0.0
        self._timer = QTimer(self)
        self._timer.setInterval(TICK_MS)
        self._timer.timeout.connect(self._tick)
        view.mouse_pressed.connect(self._on_press)
        view.mouse_moved.connect(self._on_move)
        view.mouse_released.connect(self._on_release)
        view.mouse_double_clicked.connect(self._on_double_click)
        view.wheel_turned.connect(self._on_wheel)
        view.key_changed.connect(self._on_key)

    def set_camera(self, camera: Camera) -> None:
        """Jumps to a camera and tells about it."""
        self.camera = camera
        self.camera_changed.emit(camera)

    def fly_to(self, camera: Camera) -> None:
        """Moves to a camera in a fraction of a second."""
        self._flight = (time.monotonic(), self.camera, camera)
        self._timer.start()

    def stop(self) -> None:
        """Ends flights."""
        self._flight = None
        self._held.clear()
        self._timer.stop()

    def _on_press(self, event: QMouseEvent) -> None:
        self._flight = None
        self._press = self._last = event.position()
        self._dragging = self._flown = False
        self._button = event.button()
        self._view.keys_grabbed = self._button is Qt.MouseButton.RightButton
        if self._button is Qt.MouseButton.LeftButton:
            self._gesture = next((tool for tool in self.gestures if tool.press(event)), None)

    def _on_move(self, event: QMouseEvent) -> None:
        position = event.position()
        if self._press is None:
            self.hovered.emit(position)
            return
        if self._gesture is not None:
            self._gesture.move(event)
            return
        if not self._dragging:
            moved = position - self._press
            if math.hypot(moved.x(), moved.y()) < CLICK_PIXELS:
                return
            self._dragging = True
        delta, self._last = position - self._last, position
        height = max(self._view.height(), 1)
        right, down = delta.x() / height, delta.y() / height
        match self.style.motion(self._button, event.modifiers()):
            case Motion.PAN:
                self.set_camera(self.camera.panned(-right, down))
            case Motion.ORBIT:
                self.set_camera(self.camera.orbited(-right * math.pi, down * math.pi))
            case Motion.LOOK:
                self.set_camera(self.camera.looked(-right * self.camera.view_angle, down * self.camera.view_angle))
            case Motion.ZOOM:
                self.set_camera(self.camera.zoomed(20.0 ** (right - down), None))
            case None:
                pass

    def _on_release(self, event: QMouseEvent) -> None:
        gesture, self._gesture = self._gesture, None
        if gesture is not None:
            self._press, self._button = None, Qt.MouseButton.NoButton
            gesture.release(event)
            return
        still = self._press is not None and not self._dragging
        was_click = still and self._button is Qt.MouseButton.LeftButton
        asks = still and self._button is Qt.MouseButton.RightButton and not self._flown
        self._press = None
        self._held.clear()
        self._view.keys_grabbed = False
        self._button = Qt.MouseButton.NoButton
        if was_click:
            self.clicked.emit(event.position())
        elif asks:
            self.menu_asked.emit(event.position())

    def _on_double_click(self, event: QMouseEvent) -> None:
        found = self._pick(event.position())
        if found is not None:
            self.fly_to(self.camera.aimed(np.asarray(found.position), 0.5 * found.distance))

    def _on_wheel(self, position: QPointF, notches: float) -> None:
        if self._button is Qt.MouseButton.RightButton:
            self._flown = True
            self._speed = min(max(self._speed * 1.3**notches, 0.01), 20.0)
            return
        self._flight = None
        found = self._pick(position)
        about = None if found is None else np.asarray(found.position)
        self.set_camera(self.camera.zoomed(1.2**notches, about))

    def _on_key(self, event: QKeyEvent, pressed: bool) -> None:
        if event.key() not in _FLY_KEYS or self._button is not Qt.MouseButton.RightButton:
            return
        event.accept()
        if event.isAutoRepeat():
            return
        key = Qt.Key(event.key())
        if pressed:
            self._flown = True
            self._held.add(key)
            self._ticked = time.monotonic()
            self._timer.start()
        else:
            self._held.discard(key)

    def _tick(self) -> None:
        now = time.monotonic()
        if self._flight is not None:
            began, start, end = self._flight
            share = min((now - began) / FLIGHT_SECONDS, 1.0)
            if share >= 1.0:
                self._flight = None
            self.set_camera(start.toward(end, share))
        if self._held:
            step = self._speed * self.camera.distance * min(now - self._ticked, 0.2)
            self._ticked = now
            directions = np.array([_FLY_KEYS[key] for key in self._held])
            right, up, forward = (float(axis) for axis in step * directions.sum(axis=0))
            self.set_camera(self.camera.moved(right, up, forward))
        if self._flight is None and not self._held:
            self._timer.stop()
