"""The picker of a window: built in the idle moments after geometry or visibility changed."""

from __future__ import annotations

import numpy as np
from PyQt6.QtCore import QObject, QTimer

from bake.types import BoolArray, Float64Array, World
from viewer.picking import Pick, SurfacePicker


class LazyPicker(QObject):
    """A `SurfacePicker` that never holds the window up: one chunk of faces an event loop turn."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._picker: SurfacePicker | None = None
        self._timer = QTimer(self)
        self._timer.setInterval(0)
        self._timer.timeout.connect(self._build_some)

    @property
    def is_busy(self) -> bool:
        """Whether faces are still to be made hittable."""
        return self._timer.isActive()

    def set_world(self, world: World | None, visible: BoolArray | None = None) -> None:
        """Starts over with the faces that are visible, shape (m,), bool, or None for all of them."""
        self._timer.stop()
        if world is None:
            self._picker = None
            return
        subset = None if visible is None else np.flatnonzero(visible)
        self._picker = SurfacePicker(np.asarray(world.positions), np.asarray(world.faces), subset)
        self._timer.start()

    def move_world(self, world: World, visible: BoolArray | None = None) -> None:
        """Takes the same faces in other places; those that stayed can be hit all the time."""
        picker = self._picker
        if picker is None or not picker.has_faces(np.asarray(world.faces), visible):
            self.set_world(world, visible)
            return
        self._picker = picker.moved(np.asarray(world.positions))
        self._timer.start()

    def finish(self) -> None:
        """Builds what is left now."""
        if self._picker is not None:
            self._picker.build()

    def stop(self) -> None:
        """Builds no further."""
        self._timer.stop()

    def pick(self, origin: Float64Array, direction: Float64Array, *, cull_back_faces: bool) -> Pick | None:
        """The nearest face along a ray among those built so far."""
        if self._picker is None:
            return None
        return self._picker.pick(origin, direction, cull_back_faces=cull_back_faces)

    def _build_some(self) -> None:
        if self._picker is None or not self._picker.build_next():
            self._timer.stop()
