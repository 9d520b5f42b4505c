"""The OpenGL widget: PyVista's interactor with its own mouse and key handling switched off."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

from PyQt6.QtCore import QEvent, QPointF, Qt, pyqtSignal
from PyQt6.QtGui import QEnterEvent, QKeyEvent, QMouseEvent, QWheelEvent
from PyQt6.QtWidgets import QWidget
from pyvistaqt import QtInteractor
from vtkmodules.vtkRenderingCore import vtkLight

BACKGROUND = (0.302, 0.314, 0.333)
"""Neutral grey: neither open (white) nor closed (black)."""


class GLView(QtInteractor):
    """Draws a VTK scene and hands mouse events on as signals.

    VTK's interactor styles and PyVista's key bindings never see an event: the camera is ours. Repaints go through
    `QWidget.update`, which merges them; PyVista's `render` would draw every picture twice.
    """

    mouse_pressed = pyqtSignal(QMouseEvent)
    mouse_moved = pyqtSignal(QMouseEvent)
    mouse_released = pyqtSignal(QMouseEvent)
    mouse_double_clicked = pyqtSignal(QMouseEvent)
    mouse_left = pyqtSignal()
    wheel_turned = pyqtSignal(QPointF, float)  # position, notches
    key_changed = pyqtSignal(QKeyEvent, bool)  # event, pressed
    resized = pyqtSignal()
    first_painted = pyqtSignal()

    keys_grabbed = False
    """Whether keys go to the view even where they are shortcuts of the window: while flying."""
    _painted = False

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent, auto_update=False, multi_samples=0)
        self.setAcceptDrops(False)  # the window takes drops; PyVista would read the file itself
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        renderer = self.renderer
        renderer.SetBackground(*BACKGROUND)
        renderer.remove_all_lights()
        light = vtkLight()
        light.SetLightTypeToHeadlight()
        renderer.AddLight(light)

    def event(self, event: QEvent) -> bool:
        """Claims keys before the window's shortcuts do, while flying: Q descends then and does not quit."""
        if self.keys_grabbed and event.type() is QEvent.Type.ShortcutOverride:
            event.accept()
            return True
        return super().event(event)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Hands the event on."""
        self.mouse_pressed.emit(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Hands the event on."""
        self.mouse_moved.emit(event)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Hands the event on."""
        self.mouse_released.emit(event)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Hands the event on."""
        self.mouse_double_clicked.emit(event)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Hands the event on in notches of the wheel."""
        self.wheel_turned.emit(event.position(), event.angleDelta().y() / 120.0)
        event.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Hands the event on; what nobody accepts goes to the window's shortcuts."""
        event.ignore()
        self.key_changed.emit(event, True)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """Hands the event on."""
        event.ignore()
        self.key_changed.emit(event, False)

    def enterEvent(self, event: QEnterEvent) -> None:
        """VTK is not told."""
        event.accept()

    def leaveEvent(self, event: QEvent) -> None:
        """Hands the event on."""
        self.mouse_left.emit()

    def resizeGL(self, width: int, height: int) -> None:
        """Resizes VTK's picture."""
        super().resizeGL(width, height)
        self.resized.emit()

    def paintGL(self) -> None:
        """Draws the scene."""
        if not self._painted:
            self._painted = True
            super().paintGL()
            self.first_painted.emit()
            return
        super().paintGL()

    @property
    def is_software(self) -> bool:
        """Whether pictures are drawn by the CPU; known once painted."""
        text = self.ren_win.ReportCapabilities().lower()
        return any(name in text for name in ("llvmpipe", "softpipe", "swrast", "swiftshader"))

    @property
    def aspect(self) -> float:
        """Width over height."""
        return max(self.width(), 1) / max(self.height(), 1)
