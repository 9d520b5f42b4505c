"""What the user can ask of an open document by menu or key, as far as it needs no dialog."""

from __future__ import annotations

from collections.abc import Callable

from PyQt6.QtWidgets import QWidget

from app import dialogs
from app.controller import Controller
from app.docks import Panels
from app.document import Document
from app.view_area import ViewArea
from viewer.camera import robust_bounds
from viewer.fields import Quantity
from viewer.picking import Pick


class UserCommands:
    """Turns actions into changes of the document, the camera or the bake.

    Args:
        window: Parent of message boxes.
        document, controller, area, panels: What the commands act on.
    """

    def __init__(
        self, window: QWidget, document: Document, controller: Controller, area: ViewArea, panels: Panels
    ) -> None:
        self._window, self._document, self._controller = window, document, controller
        self._area, self._panels = area, panels

    def slots(self) -> dict[str, Callable[..., object]]:
        """What to call, by action id."""
        return {
            "open-sample": lambda: self._controller.open(None),
            "frame": self.frame,
            "frame-all": self.frame_all,
            "edges": lambda on: self._show(edges=on),
            "shading": lambda on: self._show(shading=on),
            "back-faces": lambda on: self._show(back_faces=not on),
            "game": lambda on: self._show(game=on),
            "blend": lambda: self._show(quantity=Quantity.BLEND),
            "next-distance": self.next_distance,
            "geometry": lambda: self._show(quantity=Quantity.GEOMETRY),
            "invalid": self._panels.overlays.set_invalid,
            "bake": self._panels.bake.request_bake,
            "copy-command": self._panels.bake.copy_command,
            "keys": lambda: dialogs.show_keys(self._window),
            "about": lambda: dialogs.show_about(self._window),
        }

    def frame(self) -> None:
        """Shows the selected object, or the level without its far backdrop."""
        world = self._document.world
        bounds = self._document.object_bounds(self._document.selected)
        if bounds is None and world is not None:
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
            self._show(quantity=quantity, column=(display.column + step) % len(result.settings.column_distances))

    def select_path(self, path: str) -> None:
        """Selects the object of a path; a path that is none, such as the file's name, selects nothing."""
        world = self._document.world
        if world is not None and path in world.object_paths:
            self._document.select(world.object_paths.index(path))

    def _show(self, **changes: object) -> None:
        self._document.set_display(self._document.display.replaced(**changes))
