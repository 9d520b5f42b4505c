"""Switching grid points of the selected region on and off by dragging in the view; every stroke can be undone."""

from __future__ import annotations

import numpy as np
from PyQt6.QtCore import QPointF, Qt
from PyQt6.QtGui import QMouseEvent, QUndoCommand, QUndoStack

from app.region_state import RegionState, Tool
from app.viewport import Viewport
from bake.types import BoolArray, Int64Array
from viewer.overlays import OverlayPoints
from viewer.region_marks import highlighted
from viewer.region_values import POINTS
from viewer.volume_view import voxel_along

_TOUCHED_PIXELS = 9.0
_CLOSE_PIXELS = 7.0  # beside a point, within which the brush touches it


class SwitchPoints(QUndoCommand):
    """Points switched on or off.

    Args:
        state: Whose points.
        changed: Indices of the points.
        on: Their bits after it, shape of `changed`.
        text: For the menu.
    """

    def __init__(self, state: RegionState, changed: Int64Array, on: BoolArray, text: str) -> None:
        super().__init__(text)
        self._state = state
        self._names = () if state.baked is None else state.baked.graph.names
        self._changed, self._on = changed, on

    def redo(self) -> None:
        """Switches the points."""
        self._switch(self._on)

    def undo(self) -> None:
        """Switches them back."""
        self._switch(~self._on)

    def _switch(self, on: BoolArray) -> None:
        bits, baked = self._state.bits, self._state.baked
        if bits is None or baked is None or baked.graph.names != self._names:
            self.setObsolete(True)  # the bake in view has other regions
            return
        if not np.array_equal(bits[self._changed], on):
            bits = bits.copy()
            bits[self._changed] = on
            self._state.set_bits(bits)


def switch(state: RegionState, undo: QUndoStack, bits: BoolArray, text: str) -> None:
    """Gives all points these bits, as one step that can be undone; nothing if they have them."""
    if state.bits is None:
        return
    changed = np.flatnonzero(bits != state.bits)
    if len(changed):
        undo.push(SwitchPoints(state, changed, bits[changed], text))


class RegionBrush:
    """A tool of the view: a drag switches the points of the highlighted regions around the one under the cursor.

    Args:
        state: Whose points; it says whether the brush is out, which way it switches, and its radius.
        viewport: Where it paints.
        undo: Takes each stroke.
    """

    def __init__(self, state: RegionState, viewport: Viewport, undo: QUndoStack) -> None:
        self._state, self._viewport, self._undo = state, viewport, undo
        self._before: BoolArray | None = None
        self._on = False
        viewport.navigation.hovered.connect(self.hover)
        viewport.view.mouse_left.connect(self._hide)
        state.tool_changed.connect(self._hide)

    def hover(self, position: QPointF) -> None:
        """Marks the points that a stroke would begin with."""
        regions = self._state.regions
        if self._state.tool is not Tool.BRUSH or regions is None:
            return
        touched = self.touched(position)
        colors = np.full((len(touched), 3), 255, np.uint8)
        places = np.asarray(regions.points.position)[touched]
        points = OverlayPoints(places, colors, len(touched)) if len(touched) else None
        self._viewport.set_points("region brush", points, _TOUCHED_PIXELS, in_front=True)

    def _hide(self) -> None:
        self._viewport.set_points("region brush", None)

    def press(self, event: QMouseEvent) -> bool:
        """Begins a stroke while the brush is out; with Ctrl it switches the other way."""
        state = self._state
        if state.tool is not Tool.BRUSH or state.bits is None or state.regions is None:
            return False
        self._before = state.bits
        self._on = state.brush_on != bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        self.move(event)
        return True

    def move(self, event: QMouseEvent) -> None:
        """Switches what is under the brush."""
        state, bits = self._state, self._state.bits
        self.hover(event.position())
        touched = self.touched(event.position())
        if bits is None or not len(touched) or (bits[touched] == self._on).all():
            return
        bits = bits.copy()
        bits[touched] = self._on
        state.set_bits(bits)

    def release(self, event: QMouseEvent) -> None:
        """Ends the stroke: one step to undo."""
        before, self._before = self._before, None
        bits = self._state.bits
        if before is None or bits is None or len(before) != len(bits):
            return
        changed = np.flatnonzero(before != bits)
        if len(changed):
            word = "on" if self._on else "off"
            self._undo.push(SwitchPoints(self._state, changed, bits[changed], f"{len(changed)} points {word}"))

    def touched(self, position: QPointF) -> Int64Array:
        """Indices of the points under the brush at a position of the view."""
        regions, viewport = self._state.regions, self._viewport
        if regions is None:
            return np.zeros(0, np.int64)
        owners = highlighted(regions, self._state.view)
        own = (owners[:, None] * POINTS + np.arange(POINTS)).ravel()
        positions = np.asarray(regions.points.position)[own]
        origin, direction = viewport.ray_at(position)
        angle = _CLOSE_PIXELS * viewport.camera.view_angle / max(viewport.view.height(), 1)
        hit = viewport.pick_at(position)
        # A point just behind the surface can be reached too: those inside walls are what one wants to switch.
        limit = np.inf if hit is None or self._state.view.through_walls else hit.distance + self._state.brush_radius
        nearest = voxel_along(positions, origin, direction, angle, 0.0, float(limit))
        if nearest < 0:
            return np.zeros(0, np.int64)
        away = np.linalg.norm(positions - positions[nearest], axis=1)
        return own[away <= self._state.brush_radius]


class ProbeDrag:
    """A tool of the view: drags the probe's sphere in the plane of the picture.

    Args:
        state: Has the probe.
        viewport: Where it is dragged.
    """

    def __init__(self, state: RegionState, viewport: Viewport) -> None:
        self._state, self._viewport = state, viewport
        self._depth = 0.0
        self._offset = np.zeros(3)

    def press(self, event: QMouseEvent) -> bool:
        """Grabs the sphere if the cursor is on it and nothing is before it."""
        view = self._state.view
        if view.probe is None or self._state.regions is None:
            return False
        origin, direction = self._viewport.ray_at(event.position())
        centre = np.array(view.probe)
        along = float((centre - origin) @ direction)
        beside = float(np.linalg.norm(origin + along * direction - centre))
        hit = self._viewport.pick_at(event.position())
        if along <= 0.0 or beside > view.probe_size or (hit is not None and hit.distance < along - view.probe_size):
            return False
        self._depth = float((origin - centre) @ self._viewport.camera.backward)
        self._offset = centre - self._at(event)
        return True

    def move(self, event: QMouseEvent) -> None:
        """Moves the probe."""
        x, y, z = (float(value) for value in self._at(event) + self._offset)
        self._state.set_view(self._state.view.replaced(probe=(x, y, z)))

    def release(self, event: QMouseEvent) -> None:
        """Lets go."""

    def _at(self, event: QMouseEvent) -> np.ndarray:
        origin, direction = self._viewport.ray_at(event.position())
        facing = float(-direction @ self._viewport.camera.backward)
        return origin + direction * (self._depth / max(facing, 1e-6))
