"""The three models of one tree side by side on one camera, each with its error (Sloan et al. 2013, figure 2)."""

from __future__ import annotations

import numpy as np
from PyQt6.QtWidgets import QWidget

from app.document import Document
from app.side_by_side import SideBySide
from bake.types import VertexField, VertexState
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
_CAPTION_TIP = "RMSE over the tree's surface against the signal traced on it, as stored in the result"


class TreeCompare(SideBySide):
    """Follows the document's selection; keeps the last tree while something else is selected.

    Args:
        document: What is shown.
        camera: From where to look at first.
        parent: Qt parent.
    """

    def __init__(self, document: Document, camera: Camera, parent: QWidget | None = None) -> None:
        tip = "The same camera for all three: drag to orbit, wheel to zoom"
        super().__init__(camera, tip, "Close the comparison (M)", parent)
        self._document = document
        self._tree = -1
        self._values: DecoratedValues | None = None
        self.set_columns(len(MODELS), _CAPTION_TIP)
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
        super().close_view()

    def _follow(self) -> None:
        document = self._document
        self.set_up_axis(document.up_axis)
        if document.values is not self._values:
            self.show_surfaces(())
            self._values, self._tree = document.values, -1
        tree = -1 if self._values is None else self._values.tree_row(document.selected)
        if tree >= 0 and tree != self._tree:
            self._set_tree(tree)
        self._color()

    def _set_tree(self, tree: int) -> None:
        """Puts the tree's own triangles into all three pictures and frames them."""
        assert self._values is not None and self._values.decorators.fits is not None
        world = self._document.world
        assert world is not None
        self._tree = tree
        index = int(self._values.decorators.fits.object[tree])
        begin, end = int(world.first_vertex[index]), int(world.first_vertex[index + 1])
        positions = np.asarray(world.positions[begin:end])
        faces = np.asarray(world.faces[world.first_face[index] : world.first_face[index + 1]]) - np.int32(begin)
        self.show_surfaces([(positions, faces)] * len(MODELS))

    def _color(self) -> None:
        document, result, values = self._document, self._document.result, self._values
        if result is None or values is None or self._tree < 0 or values.decorators.fits is None:
            self.title.setText("Select a tree to see its models side by side.")
            for caption in self.captions:
                caption.setText("")
            self.view.update()
            return
        display = document.display
        if display.quantity not in (Quantity.DISTANCE, Quantity.BLEND):
            display = display.replaced(quantity=Quantity.BLEND)
        index = int(values.decorators.fits.object[self._tree])
        title = ""
        for (shading, name), surface, caption in zip(MODELS, self.surfaces, self.captions, strict=True):
            ao = np.clip(values.tree(self._tree, shading), 0.0, 1.0)
            state = np.full(len(ao), VertexState.BAKED, np.uint8)
            field = shown_field(display, result, VertexField(ao, state, result.field.report))
            assert field is not None
            surface.set_colors(field.colors(display.map_for(field), *display.range_for(field)))
            error = tree_errors(result, values, self._tree, shading)
            caption.setText(f"<b>{name}</b><br>RMSE {error}")
            title = field.title
        self.title.setText(f"{result.world.object_paths[index]}   ·   {title}")
        self.view.update()
