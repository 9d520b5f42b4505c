"""The boxes around the objects in view, made once for a world and anew only for what moves."""

from __future__ import annotations

from bake.types import Float64Array, World
from viewer.boxes import moved_boxes, object_boxes


class KeptBoxes:
    """Those of the world asked for last; worlds are told apart by their positions, which stay as they are."""

    def __init__(self) -> None:
        self._known: tuple[Float64Array, Float64Array] | None = None

    def of(self, world: World) -> Float64Array:
        """Corners of the boxes, shape (o, 2, 3), metres from the world's origin; not finite without vertices."""
        if self._known is None or self._known[0] is not world.positions:
            self._known = (world.positions, object_boxes(world))
        return self._known[1]

    def follow(self, before: World, now: World) -> None:
        """Makes those of another world from those of the one before, where they have the same objects."""
        same = before.object_paths == now.object_paths and (before.first_vertex == now.first_vertex).all()
        if same and self._known is not None and self._known[0] is before.positions:
            self._known = (now.positions, moved_boxes(self._known[1], before, now))
