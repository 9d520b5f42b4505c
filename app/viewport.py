"""One 3D view of the document: surface, marks, camera, legend, and the point under the cursor."""

from __future__ import annotations

import math
import time

import numpy as np
from PyQt6.QtCore import QPointF, Qt, QTimer, pyqtSignal
from PyQt6.QtGui import QImage, QPainter
from PyQt6.QtWidgets import QLabel, QVBoxLayout, QWidget

from app.elided_label import ElidedLabel
from app.gl_view import GLView
from app.lazy_picker import LazyPicker
from app.legend import Legend
from app.navigation import Navigation
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, UInt8Array, World
from viewer.actors import SurfaceActor
from viewer.boxes import box_around
from viewer.camera import Camera
from viewer.display import Display
from viewer.fields import Scale, SurfaceField, relief_of
from viewer.markers import BoxActor, PointsActor
from viewer.overlays import OverlayPoints
from viewer.picking import Pick
from viewer.shapes import ShapesActor
from viewer.surface_look import draw_surface

Shapes = tuple[Float32Array, Int32Array, UInt8Array]
"""Positions, cells and colours; see `ShapesActor.set_shapes`."""

HOVER_MS = 16
_MULTI_SAMPLES = 8
_REST_MS = 250
_SMOOTH_FACES = 400_000
"""Faces above which edges stay rough where the CPU draws."""
_MARGIN = 10


class Viewport(QWidget):
    """Shows what it is told; tells where the cursor is.

    Args:
        picker: Shared by the views of a window.
        parent: Qt parent.
    """

    hovered = pyqtSignal(object)  # Pick or None
    clicked = pyqtSignal(object)  # Pick or None
    ray_clicked = pyqtSignal(object, object, object)  # origin, direction, Pick or None
    camera_changed = pyqtSignal(object)  # Camera

    def __init__(self, picker: LazyPicker, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._picker = picker
        self._surface: SurfaceActor | None = None
        self._points: dict[str, PointsActor] = {}
        self._shapes: dict[str, ShapesActor] = {}
        self._scales: dict[str, Legend] = {}
        self._display = Display()
        self._relief: Float32Array | None = None
        self._bounds = np.array([[-1.0] * 3, [1.0] * 3])
        self._hover: QPointF | None = None

        self.caption = ElidedLabel(alignment=Qt.AlignmentFlag.AlignHCenter)
        self.caption.setContentsMargins(6, 2, 6, 2)
        self.caption.setAutoFillBackground(True)  # it appears where OpenGL was drawn before
        self.caption.hide()
        self.view = GLView(self)
        self.legend = Legend(self.view)
        self.hint = QLabel("Drop a scene here, or open one with Ctrl+O", self.view)
        self.hint.setStyleSheet("color: #d8d9da; background: transparent; font-size: 15px;")
        self.hint.adjustSize()
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.caption)
        layout.addWidget(self.view, 1)

        self._box = BoxActor((1.0, 0.62, 0.12))
        self.view.renderer.AddActor(self._box.actor)
        self.navigation = Navigation(self.view, self.pick_at)
        self.navigation.camera_changed.connect(self._on_camera)
        self.navigation.clicked.connect(self._on_click)
        self.navigation.hovered.connect(self._on_hover)
        self.view.mouse_left.connect(self._on_leave)
        self.view.resized.connect(self._place_children)
        self.view.first_painted.connect(self._on_first_paint)
        self._hovered_at = -1.0
        self._hover_timer = QTimer(self)
        self._hover_timer.setSingleShot(True)
        self._hover_timer.timeout.connect(self._emit_hover)
        self._software = False
        self._rest_timer = QTimer(self)
        self._rest_timer.setSingleShot(True)
        self._rest_timer.setInterval(_REST_MS)
        self._rest_timer.timeout.connect(self._on_rest)

    @property
    def camera(self) -> Camera:
        """Where the view stands."""
        return self.navigation.camera

    @property
    def surface(self) -> SurfaceActor | None:
        """The surface as drawn, for those who draw it once more; None without geometry."""
        return self._surface

    @property
    def relief(self) -> Float32Array | None:
        """Brightness of what is not baked, shape (n,); None without geometry."""
        return self._relief

    def set_caption(self, text: str) -> None:
        """A line above the picture; empty hides it."""
        self.caption.setText(text)
        self.caption.setVisible(bool(text))

    def set_world(self, world: World | None) -> None:
        """Draws geometry in plain grey; None draws nothing."""
        if self._surface is not None:
            self.view.renderer.RemoveActor(self._surface.actor)
            self._surface = None
        self._box.hide()
        for points in self._points.values():
            points.actor.VisibilityOff()
        for shapes in self._shapes.values():
            shapes.hide()
        self.hint.setVisible(world is None)
        if world is not None and world.face_count:
            positions = np.asarray(world.positions)
            self._bounds = box_around(positions)
            self._surface = SurfaceActor(positions, np.asarray(world.faces))
            self._relief = relief_of(world.normals)
            self.view.renderer.AddActor(self._surface.actor)
        self.legend.set_field(None, None, (0.0, 1.0))
        self._apply_camera()

    def move_vertices(self, first: int, positions: Float64Array) -> None:
        """Draws vertices from the `first` on elsewhere; shape (n, 3), metres from the world's origin."""
        if self._surface is not None and len(positions):
            self._surface.move_vertices(first, positions)
            ends = (positions.min(axis=0), positions.max(axis=0))
            self._bounds = np.stack((np.minimum(self._bounds[0], ends[0]), np.maximum(self._bounds[1], ends[1])))
            self._apply_camera()

    def set_field(self, field: SurfaceField | None, display: Display, note: str = "") -> None:
        """Colours the surface; None shows plain geometry."""
        self._display = display
        surface = self._surface
        if surface is None:
            self.legend.set_field(None, None, (0.0, 1.0))
            return
        draw_surface(surface, field, display, self._relief)
        if field is None:
            self.legend.set_field(None, None, (0.0, 1.0))
        else:
            self.legend.set_field(field, display.map_for(field), display.range_for(field), note)
        self._place_children()
        self.view.update()

    def set_visible_faces(self, visible: BoolArray | None) -> None:
        """Draws a subset of the faces."""
        if self._surface is not None:
            self._surface.set_visible_faces(visible)
            self.view.update()

    def set_points(self, name: str, points: OverlayPoints | None, size: float = 5.0, *, in_front: bool = False) -> None:
        """Draws marks under a name; None removes them. Whether they are before everything is that of the first time."""
        if points is None:
            if name in self._points:
                self._points[name].actor.VisibilityOff()
                self.view.update()
            return
        if name not in self._points:
            self._points[name] = PointsActor(in_front=in_front)
            self.view.renderer.AddActor(self._points[name].actor)
        self._points[name].set_size(size * self.view.devicePixelRatioF())
        self._points[name].set_points(points.positions, points.colors)
        self.view.update()

    def set_shapes(
        self,
        name: str,
        shapes: Shapes | None,
        *,
        opacity: float = 1.0,
        width: float = 1.5,
        lit: bool = False,
        in_front: bool = False,
    ) -> None:
        """Draws lines or faces under a name; None removes them. Their look is that of the first time."""
        if shapes is None:
            if name in self._shapes:
                self._shapes[name].hide()
                self.view.update()
            return
        if name not in self._shapes:
            pixels = width * self.view.devicePixelRatioF()
            self._shapes[name] = ShapesActor(opacity=opacity, width=pixels, lit=lit, in_front=in_front)
            self.view.renderer.AddActor(self._shapes[name].actor)
        self._shapes[name].set_shapes(*shapes)
        self.view.update()

    def set_scale(self, name: str, scale: Scale | None) -> None:
        """Explains the colours of marks under a name, above the surface's legend; None takes it away."""
        if name not in self._scales:
            if scale is None:
                return
            self._scales[name] = Legend(self.view)
        self._scales[name].set_scale(scale)
        self._place_children()

    def set_boxes(self, boxes: Float64Array) -> None:
        """Draws boxes around the selected objects, shape (k, 2, 3)."""
        if len(boxes):
            self._box.set_boxes(boxes)
        else:
            self._box.hide()
        self.view.update()

    def set_camera(self, camera: Camera) -> None:
        """Takes over a camera without telling about it."""
        self.navigation.camera = camera
        self._apply_camera()

    def frame(self, low: Float64Array, high: Float64Array, *, fly: bool = True) -> None:
        """Moves back or closer until a box fills the picture."""
        camera = self.camera.framed(low, high, self.view.aspect)
        if fly:
            self.navigation.fly_to(camera)
        else:
            self.navigation.set_camera(camera)

    def pick_at(self, position: QPointF) -> Pick | None:
        """What is at a position of the view, in its logical pixels."""
        return self._picker.pick(*self.ray_at(position), cull_back_faces=not self._display.back_faces)

    def ray_at(self, position: QPointF) -> tuple[Float64Array, Float64Array]:
        """The ray through a position of the view: origin and unit direction."""
        x = 2.0 * (position.x() + 0.5) / max(self.view.width(), 1) - 1.0
        y = 1.0 - 2.0 * (position.y() + 0.5) / max(self.view.height(), 1)
        return self.camera.ray(x, y, self.view.aspect)

    def picture(self) -> QImage:
        """The view as drawn, with its legend."""
        image = self.view.grabFramebuffer()
        ratio = self.view.devicePixelRatioF()
        image.setDevicePixelRatio(ratio)
        for legend in (self.legend, *self._scales.values()):
            if legend.isVisibleTo(self.view):
                painter = QPainter(image)
                painter.translate(QPointF(legend.pos()))
                legend.paint(painter)
                painter.end()
        return image

    def close_view(self) -> None:
        """Frees VTK's side; must precede the end of the window."""
        self.navigation.stop()
        self._hover_timer.stop()
        self._rest_timer.stop()
        self.view.close()
        self._surface = None
        self._points.clear()
        self._shapes.clear()

    def _on_camera(self, camera: Camera) -> None:
        self._apply_camera()
        self.camera_changed.emit(camera)

    def _apply_camera(self) -> None:
        self._on_moving()
        if self._hover is not None:
            self._start_hover()
        camera, vtk_camera = self.camera, self.view.renderer.GetActiveCamera()
        eye = camera.eye
        vtk_camera.SetPosition(*eye)
        vtk_camera.SetFocalPoint(*camera.focal)
        vtk_camera.SetViewUp(*camera.up)
        vtk_camera.SetViewAngle(math.degrees(camera.view_angle))
        corners = np.array([[self._bounds[bit >> axis & 1][axis] for axis in range(3)] for bit in range(8)])
        depths = (eye - corners) @ camera.backward
        far = max(float(depths.max()) * 1.01, camera.distance * 2.0)
        # As near as the depth buffer allows: a backdrop kilometres away must not cut off what is at hand.
        near = max(far * 1e-5, min(camera.distance * 0.02, max(float(depths.min()) * 0.99, 0.0) or math.inf))
        vtk_camera.SetClippingRange(near, far)
        self.view.update()

    def _on_click(self, position: QPointF) -> None:
        found = self.pick_at(position)
        self.clicked.emit(found)
        self.ray_clicked.emit(*self.ray_at(position), found)

    def _on_hover(self, position: QPointF) -> None:
        self._hover = position
        self._start_hover()

    def _start_hover(self) -> None:
        """At once, unless that was done a moment ago."""
        if not self._hover_timer.isActive():
            since = 1000.0 * (time.monotonic() - self._hovered_at)
            self._hover_timer.start(max(HOVER_MS - int(since), 0))

    def _emit_hover(self) -> None:
        if self._hover is not None:
            self._hovered_at = time.monotonic()
            self.hovered.emit(self.pick_at(self._hover))

    def _on_leave(self) -> None:
        self._hover = None
        self.hovered.emit(None)

    def _on_first_paint(self) -> None:
        self._software = self.view.is_software
        self._rest_timer.start()

    def _on_moving(self) -> None:
        """Without a GPU smooth edges cost too much to be drawn while the picture moves."""
        if self._software:
            self._set_multi_samples(0)
            self._rest_timer.start()

    def _on_rest(self) -> None:
        faces = 0 if self._surface is None else self._surface.face_count
        if not self._software or faces <= _SMOOTH_FACES:
            self._set_multi_samples(_MULTI_SAMPLES)

    def _set_multi_samples(self, count: int) -> None:
        window = self.view.ren_win
        if window is not None and window.GetMultiSamples() != count:
            window.SetMultiSamples(count)
            self.view.update()

    def _place_children(self) -> None:
        view = self.view
        left, widest, bottom = _MARGIN, 0, view.height() - _MARGIN
        for legend in (self.legend, *self._scales.values()):
            if legend.isVisibleTo(view):
                bottom -= legend.height()
                if bottom < 0 and widest:  # no room above the others: beside them
                    left, widest, bottom = left + widest + _MARGIN // 2, 0, view.height() - _MARGIN - legend.height()
                legend.move(left, bottom)
                widest = max(widest, legend.width())
                bottom -= _MARGIN // 2
        self.hint.move((view.width() - self.hint.width()) // 2, (view.height() - self.hint.height()) // 2)
