"""Several surfaces side by side on one camera of their own, each with a caption."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QSizePolicy, QVBoxLayout, QWidget
from vtkmodules.vtkRenderingCore import vtkLight, vtkRenderer

from app.elided_label import ElidedLabel
from app.gl_view import BACKGROUND, GLView
from app.navigation import Navigation
from viewer.actors import SurfaceActor
from viewer.camera import Camera

Geometry = tuple[np.ndarray, np.ndarray]
"""Positions, shape (n, 3), and faces, shape (m, 3)."""

_GAP = 0.002


class SideBySide(QWidget):
    """Draws geometry in columns of equal width. Whoever inherits says what, and in which colours.

    Args:
        camera: From where to look at first.
        tip: What the pictures have in common.
        close_tip: How it is closed.
        parent: Qt parent.

    Attributes:
        captions: One a column, below the title.
        view: What they are drawn in.
        navigation: Moves the camera of all.
        surfaces: One a column; none while nothing is shown.
    """

    close_requested = pyqtSignal()

    def __init__(self, camera: Camera, tip: str, close_tip: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setMinimumHeight(150)
        self.title = ElidedLabel("", Qt.TextElideMode.ElideMiddle)
        close = QPushButton("Close")
        close.setToolTip(close_tip)
        close.clicked.connect(self.close_requested)
        self.captions: list[QLabel] = []
        self.surfaces: list[SurfaceActor] = []
        self._caption_tip = ""
        self._bounds = (np.zeros(3), np.ones(3))
        self.view = GLView(self)
        self.view.setToolTip(tip)
        self._renderers: list[vtkRenderer] = [self.view.renderer]
        self.navigation = Navigation(self.view, lambda _position: None)
        self.navigation.camera = camera
        self.navigation.camera_changed.connect(self._on_camera)
        self.view.resized.connect(self.frame)
        top, self._caption_row = QHBoxLayout(), QHBoxLayout()
        top.addWidget(self.title, 1)
        top.addWidget(close)
        layout = QVBoxLayout(self)
        layout.addLayout(top)
        layout.addLayout(self._caption_row)
        layout.addWidget(self.view, 1)

    def close_view(self) -> None:
        """Frees VTK's side; must precede the end of the window."""
        self.navigation.stop()
        self.show_surfaces(())
        self.set_columns(1)
        self._renderers = []
        self.view.close()

    def set_columns(self, count: int, caption_tip: str = "") -> None:
        """Divides the view into columns; what was drawn is gone if their number changes."""
        self._caption_tip = caption_tip
        while len(self.captions) < count:
            caption = QLabel()
            caption.setAlignment(Qt.AlignmentFlag.AlignHCenter)
            caption.setWordWrap(True)
            caption.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
            self._caption_row.addWidget(caption, 1)
            self.captions.append(caption)
        while len(self.captions) > max(count, 0):
            caption = self.captions.pop()
            self._caption_row.removeWidget(caption)
            caption.deleteLater()
        for caption in self.captions:
            caption.setToolTip(caption_tip)
        if count == len(self._renderers):
            return
        self.show_surfaces(())
        while len(self._renderers) > count:
            self.view.ren_win.RemoveRenderer(self._renderers.pop())
        while len(self._renderers) < count:
            self._renderers.append(self._new_renderer())
        for number, renderer in enumerate(self._renderers):
            low, high = number / count, (number + 1) / count
            renderer.SetViewport(low + _GAP * (number > 0), 0.0, high - _GAP * (number < count - 1), 1.0)

    def _new_renderer(self) -> vtkRenderer:
        renderer = vtkRenderer()
        renderer.SetBackground(*BACKGROUND)
        renderer.SetActiveCamera(self.view.renderer.GetActiveCamera())
        light = vtkLight()
        light.SetLightTypeToHeadlight()
        renderer.AddLight(light)
        self.view.ren_win.AddRenderer(renderer)
        return renderer

    def show_surfaces(self, geometry: Sequence[Geometry]) -> None:
        """Puts geometry into the columns, one each, and frames all of it; none clears them."""
        for surface, renderer in zip(self.surfaces, self._renderers, strict=False):
            renderer.RemoveActor(surface.actor)
        self.surfaces = []
        for (positions, faces), renderer in zip(geometry, self._renderers, strict=False):
            surface = SurfaceActor(positions, faces)
            surface.set_shading(0.0)
            renderer.AddActor(surface.actor)
            self.surfaces.append(surface)
        points = [positions for positions, _ in geometry if len(positions)]
        if points:
            lows, highs = [p.min(axis=0) for p in points], [p.max(axis=0) for p in points]
            self._bounds = np.min(lows, axis=0), np.max(highs, axis=0)
            self.frame()
        self.view.update()

    def set_up_axis(self, axis: int) -> None:
        """Changes which way is up."""
        if axis != self.navigation.camera.up_axis:
            self.navigation.set_camera(dataclasses.replace(self.navigation.camera, up_axis=axis))

    def frame(self) -> None:
        """Moves the camera so that all columns show all of their geometry."""
        aspect = self.view.aspect / max(len(self._renderers), 1)
        self.navigation.set_camera(self.navigation.camera.framed(*self._bounds, aspect))

    def _on_camera(self, camera: Camera) -> None:
        low, high = self._bounds
        vtk_camera = self.view.renderer.GetActiveCamera()
        vtk_camera.SetPosition(*camera.eye)
        vtk_camera.SetFocalPoint(*camera.focal)
        vtk_camera.SetViewUp(*camera.up)
        vtk_camera.SetViewAngle(math.degrees(camera.view_angle))
        centre, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
        depth = float((camera.eye - centre) @ camera.backward)
        far = max(depth + radius, 1e-2)
        vtk_camera.SetClippingRange(max(depth - radius, far * 1e-3), far)
        self.view.update()
