"""What the user can ask of an open document by menu or key, as far as it needs no dialog."""

from __future__ import annotations

from app.document import Document
from app.view_area import ViewArea
from viewer.camera import robust_bounds
from viewer.fields import Quantity
from viewer.picking import Pick


class UserCommands:
    """Turns actions into changes of what is shown and of the camera.

    Args:
        document, area: What the commands act on.
    """

    def __init__(self, document: Document, area: ViewArea) -> None:
        self._document, self._area = document, area

    def frame(self) -> None:
        """Shows the selected objects, or the level without its far backdrop."""
        world = self._document.world
        bounds = self._document.bounds_of(self._document.selection)
        if bounds is None and world is not None and world.vertex_count:
            bounds = robust_bounds(world.positions)
        if bounds is not None:
            self._area.main.frame(*bounds)

    def frame_all(self) -> None:
        """Shows everything."""
        world = self._document.world
        if world is not None and world.vertex_count:
            self._area.main.frame(world.positions.min(axis=0), world.positions.max(axis=0))

    def fly_to(self, pick: Pick | None) -> None:
        """Looks at a point from nearby: a twentieth of the level's size."""
        world, viewport = self._document.world, self._area.main
        if pick is None or world is None:
            return
        low, high = robust_bounds(world.positions)
        near = min(0.05 * float((high - low).max()), viewport.camera.distance)
        viewport.navigation.fly_to(viewport.camera.aimed(pick.position, near))

    def next_distance(self) -> None:
        """Steps through the baked distances."""
        display, result = self._document.display, self._document.result
        if result is not None:
            by_distance = (Quantity.DISTANCE, Quantity.DIFFERENCE)
            quantity = display.quantity if display.quantity in by_distance else Quantity.DISTANCE
            step = 1 if quantity is display.quantity else 0
            self.show(quantity=quantity, column=(display.column + step) % len(result.settings.column_distances))

    def select_path(self, path: str) -> None:
        """Selects the object of a path."""
        select_path(self._document, path)

    def show(self, **changes: object) -> None:
        """Changes fields of the display."""
        self._document.set_display(self._document.display.replaced(**changes))


def select_path(document: Document, path: str) -> None:
    """Selects the object of a path; a path that is none, such as the file's name, selects nothing."""
    world = document.world
    if world is not None and path in world.object_paths:
        document.select(world.object_paths.index(path))
