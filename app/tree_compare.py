"""The three models of one tree side by side on one camera, each with its error (Sloan et al. 2013, figure 2)."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QSizePolicy, QVBoxLayout, QWidget
from vtkmodules.vtkRenderingCore import vtkLight, vtkRenderer

from app.document import Document
from app.elided_label import ElidedLabel
from app.gl_view import BACKGROUND, GLView
from app.navigation import Navigation
from bake.types import VertexField, VertexState
from viewer.actors import SurfaceActor
from viewer.camera import Camera
from viewer.decorated import DecoratedValues
from viewer.decorator_rows import tree_errors
from viewer.decorator_view import TreeShading
from viewer.display import shown_field
from viewer.fields import Quantity

MODELS = (
    (TreeShading.LINEAR, "Global only"),
    (TreeShading.PRODUCT, "Local × global"),
    (TreeShading.GOLD, "Gold, from the volume"),
)


class TreeCompare(QWidget):
    """Follows the document's selection; keeps the last tree while something else is selected.

    Args:
        document: What is shown.
        camera: From where to look at first.
        parent: Qt parent.
    """

    close_requested = pyqtSignal()

    def __init__(self, document: Document, camera: Camera, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._document = document
        self._tree = -1
        self._values: DecoratedValues | None = None
        self._surfaces: list[SurfaceActor] = []
        self.setMinimumHeight(150)
        self._title = ElidedLabel("", Qt.TextElideMode.ElideMiddle)
        close = QPushButton("Close")
        close.setToolTip("Close the comparison (M)")
        close.clicked.connect(self.close_requested)
        self.captions = [QLabel() for _ in MODELS]
        self.view = GLView(self)
        self.view.setToolTip("The same camera for all three: drag to orbit, wheel to zoom")
        self._renderers = self._build_renderers()
        self.navigation = Navigation(self.view, lambda _position: None)
        self.navigation.camera = camera
        self.navigation.camera_changed.connect(self._on_camera)
        self.view.resized.connect(self._frame)
        top, captions = QHBoxLayout(), QHBoxLayout()
        top.addWidget(self._title, 1)
        top.addWidget(close)
        for caption in self.captions:
            caption.setAlignment(Qt.AlignmentFlag.AlignHCenter)
            caption.setWordWrap(True)
            caption.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
            caption.setToolTip("RMSE over the tree's surface against the signal traced on it, as stored in the result")
            captions.addWidget(caption, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 0)
        layout.setSpacing(3)
        layout.addLayout(top)
        layout.addLayout(captions)
        layout.addWidget(self.view, 1)
        self._events = (
            document.selection_changed, document.result_changed, document.display_changed, document.world_changed,
        )  # fmt: skip
        for event in self._events:
            event.connect(self._follow)
        self._follow()

    def close_view(self) -> None:
        """Stops following and frees VTK's side; must precede the end of the window."""
        for event in self._events:
            event.disconnect(self._follow)
        self.navigation.stop()
        self._clear()
        for renderer in self._renderers[1:]:
            self.view.ren_win.RemoveRenderer(renderer)
        self._renderers = []
        self.view.close()

    def _build_renderers(self) -> list[vtkRenderer]:
        renderers: list[vtkRenderer] = [self.view.renderer]
        for _ in MODELS[1:]:
            renderer = vtkRenderer()
            renderer.SetBackground(*BACKGROUND)
            renderer.SetActiveCamera(renderers[0].GetActiveCamera())
            light = vtkLight()
            light.SetLightTypeToHeadlight()
            renderer.AddLight(light)
            self.view.ren_win.AddRenderer(renderer)
            renderers.append(renderer)
        gap = 0.002
        for number, renderer in enumerate(renderers):
            low, high = number / len(renderers), (number + 1) / len(renderers)
            renderer.SetViewport(low + gap * (number > 0), 0.0, high - gap * (number < len(renderers) - 1), 1.0)
        return renderers

    def _follow(self) -> None:
        document = self._document
        if document.values is not self._values:
            self._clear()
            self._values, self._tree = document.values, -1
        tree = -1 if self._values is None else self._values.tree_row(document.selected)
        if tree >= 0 and tree != self._tree:
            self._set_tree(tree)
        self._color()

    def _clear(self) -> None:
        for surface, renderer in zip(self._surfaces, self._renderers, strict=False):
            renderer.RemoveActor(surface.actor)
        self._surfaces = []

    def _set_tree(self, tree: int) -> None:
        """Puts the tree's own triangles into all three pictures and frames them."""
        assert self._values is not None and self._values.decorators.fits is not None
        world = self._document.world
        assert world is not None
        self._clear()
        self._tree = tree
        index = int(self._values.decorators.fits.object[tree])
        begin, end = int(world.first_vertex[index]), int(world.first_vertex[index + 1])
        positions = np.asarray(world.positions[begin:end])
        faces = np.asarray(world.faces[world.first_face[index] : world.first_face[index + 1]]) - np.int32(begin)
        for renderer in self._renderers:
            surface = SurfaceActor(positions, faces)
            renderer.AddActor(surface.actor)
            self._surfaces.append(surface)
        self._frame()

    def _frame(self) -> None:
        camera = dataclasses.replace(self.navigation.camera, up_axis=self._document.up_axis)
        self.navigation.set_camera(camera.framed(*self._bounds(), self.view.aspect / len(MODELS)))

    def _color(self) -> None:
        document, result, values = self._document, self._document.result, self._values
        if result is None or values is None or self._tree < 0 or values.decorators.fits is None:
            self._title.setText("Select a tree to see its models side by side.")
            for caption in self.captions:
                caption.setText("")
            self.view.update()
            return
        display = document.display
        if display.quantity in (Quantity.GEOMETRY, Quantity.DIFFERENCE, Quantity.INSPECTION):
            display = display.replaced(quantity=Quantity.BLEND)
        index = int(values.decorators.fits.object[self._tree])
        title = ""
        for (shading, name), surface, caption in zip(MODELS, self._surfaces, self.captions, strict=True):
            ao = np.clip(values.tree(self._tree, shading), 0.0, 1.0)
            state = np.full(len(ao), VertexState.BAKED, np.uint8)
            field = shown_field(display, result, VertexField(ao, state, result.field.report))
            assert field is not None
            surface.set_colors(field.colors(display.map_for(field), *display.range_for(field)))
            surface.set_shading(0.0)
            error = tree_errors(result, values, self._tree, shading)
            caption.setText(f"<b>{name}</b><br>RMSE {error}")
            title = field.title
        self._title.setText(f"{result.world.object_paths[index]}   ·   {title}")
        self.view.update()

    def _on_camera(self, camera: Camera) -> None:
        low, high = self._bounds()
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

    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        values = self._values
        if values is None or values.decorators.fits is None or self._tree < 0:
            return np.zeros(3), np.ones(3)
        bounds = self._document.object_bounds(int(values.decorators.fits.object[self._tree]))
        return bounds if bounds is not None else (np.zeros(3), np.ones(3))
