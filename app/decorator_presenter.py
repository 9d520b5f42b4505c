"""Draws the document's decorators as marks: fog boxes, bricks, voxels, slices and the harmonics of a voxel."""

from __future__ import annotations

import math

import numpy as np

from app.document import Document
from app.viewport import Shapes, Viewport
from bake.decorator_types import FogBoxes, TreeVolume
from bake.types import Float64Array
from viewer.colormaps import CIVIDIS
from viewer.decorator_view import ALL_LAYERS, DecoratorView, VoxelColor
from viewer.fields import Scale, distance_label
from viewer.fog_view import box_corners, box_edges, box_sides, fog_colors, fog_scale
from viewer.overlays import FILLED_COLOR, OverlayPoints
from viewer.picking import Pick
from viewer.volume_view import (
    DIRECTIONS,
    VALID_COLOR,
    Voxels,
    brick_boxes,
    drawn_voxels,
    glyph,
    nearest_voxel,
    slice_quads,
    voxel_along,
)

BRICK_COLOR = (236, 160, 60)
VOXEL_PIXELS = 5
_CLICK_PIXELS = 7.0
_NEAR_CELLS = 0.45  # of a voxel's own cell, within which a click means it


class DecoratorPresenter:
    """Keeps the marks of viewports in step with a document's decorators.

    Args:
        document: What is shown.
        viewports: Where; a list that its owner changes.
    """

    def __init__(self, document: Document, viewports: list[Viewport]) -> None:
        self._document, self._viewports = document, viewports
        self._voxels: Voxels | None = None
        document.result_changed.connect(self.draw)
        document.decorators_changed.connect(self.draw)
        document.display_changed.connect(self._on_display)
        self._up_axis = document.up_axis
        viewports[0].ray_clicked.connect(self._on_click)

    def close(self) -> None:
        """Stops following the document."""
        for event in (self._document.result_changed, self._document.decorators_changed):
            event.disconnect(self.draw)
        self._document.display_changed.disconnect(self._on_display)

    def draw(self) -> None:
        """Draws everything anew."""
        values, view = self._document.values, self._document.decorators
        decorators = None if values is None else values.decorators
        self._draw_fog(None if decorators is None else decorators.fog, view)
        self._draw_volume(None if decorators is None else decorators.volume, view)

    def _on_display(self) -> None:
        if self._document.up_axis != self._up_axis:
            self._up_axis = self._document.up_axis
            self.draw()

    def _draw_fog(self, fog: FogBoxes | None, view: DecoratorView) -> None:
        edges: Shapes | None = None
        sides: Shapes | None = None
        scale: Scale | None = None
        if fog is not None and len(fog) and view.fog is not None:
            corners = box_corners(fog.minimum, fog.maximum)
            colors = np.repeat(fog_colors(fog, view.fog), 8, axis=0)
            edges = (corners, box_edges(len(fog)), colors)
            sides = (corners, box_sides(len(fog)), colors)
            scale = fog_scale(fog, view.fog)
        for viewport in self._viewports:
            viewport.set_shapes("fog edges", edges, width=1.5)
            viewport.set_shapes("fog sides", sides, opacity=0.22)
            viewport.set_scale("fog", scale)

    def _draw_volume(self, volume: TreeVolume | None, view: DecoratorView) -> None:
        bricks: Shapes | None = None
        if volume is not None and view.bricks:
            low, high = brick_boxes(volume)
            colors = np.empty((8 * len(low), 3), np.uint8)
            colors[:] = BRICK_COLOR
            bricks = (box_corners(low, high), box_edges(len(low)), colors)
        voxels = self._voxels = (
            drawn_voxels(volume, view, self._document.up_axis)
            if volume is not None and view.voxels is not None
            else None
        )
        points: OverlayPoints | None = None
        quads: Shapes | None = None
        if voxels is not None and volume is not None:
            if view.layer == ALL_LAYERS:
                points = OverlayPoints(voxels.positions, voxels.colors, voxels.total)
            else:
                quads = slice_quads(voxels, volume.spacing, self._document.up_axis)
        shape: Shapes | None = None
        if volume is not None and 0 <= view.voxel < len(volume.voxel):
            shape = glyph(volume, view.voxel, view.column)
        for viewport in self._viewports:
            viewport.set_shapes("bricks", bricks, width=1.0)
            viewport.set_points("voxels", points, VOXEL_PIXELS)
            viewport.set_shapes("slice", quads)
            viewport.set_shapes("glyph", shape, lit=True)
            viewport.set_scale("voxels", self._scale(voxels, view, shape is not None))

    def _scale(self, voxels: Voxels | None, view: DecoratorView, has_glyph: bool) -> Scale | None:
        result = self._document.result
        if result is None or (voxels is None and not has_glyph):
            return None
        label = distance_label(result.settings.column_distances[view.column])
        if voxels is not None and view.voxels is VoxelColor.VALIDITY:
            swatches = ((VALID_COLOR, "valid, as traced"), (FILLED_COLOR, "filled from neighbours"))
            return Scale("Voxels", swatches=swatches, note=_thinned(voxels))
        if voxels is None:
            return Scale("Voxel's AO by direction", CIVIDIS, note=f"at {label}")
        way = DIRECTIONS[view.direction][0]
        note = _thinned(voxels) or f"at {label}, direction {way}"
        return Scale("AO of voxels", CIVIDIS, note=note)

    def _on_click(self, origin: Float64Array, direction: Float64Array, pick: Pick | None) -> None:
        """Picks the voxel clicked, or the one nearest to the surface point clicked, while the volume is drawn."""
        document, view = self._document, self._document.decorators
        volume = None if document.values is None else document.values.decorators.volume
        if volume is None or (view.voxels is None and not view.bricks):
            return
        found = -1
        if self._voxels is not None:
            viewport = self._viewports[0]
            angle = _CLICK_PIXELS * viewport.camera.view_angle / max(viewport.view.height(), 1)
            limit = math.inf if pick is None else pick.distance
            near = 0.0 if view.layer == ALL_LAYERS else _NEAR_CELLS * volume.spacing
            row = voxel_along(self._voxels.positions, origin, direction, angle, near, limit)
            found = int(self._voxels.number[row]) if row >= 0 else -1
        if found < 0 and pick is not None:
            found = nearest_voxel(volume, np.array(pick.position))
        document.set_decorators(view.replaced(voxel=found))


def _thinned(voxels: Voxels) -> str:
    count = len(voxels.number)
    return "" if count == voxels.total else f"{count:,} of {voxels.total:,} drawn"
