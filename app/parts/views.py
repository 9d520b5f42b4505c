"""What is shown in the view and how: camera, quantity, look, comparisons."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PyQt6.QtCore import QPointF

from app.actions import Action, ActionSpec
from app.user_commands import UserCommands
from app.viewport import Viewport
from app.window_parts import Part, Workbench
from viewer.camera import Camera, robust_bounds
from viewer.fields import Quantity


class ViewsPart(Part):
    """The View menu, as far as it is about the picture."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.commands = UserCommands(bench.document, bench.area)
        self._absent = bench.document.absent()
        self._framed: Path | None = None  # whose camera is set already; read again, as after a remedy, it keeps it

    def actions(self) -> list[Action]:
        """Camera, look, quantity, comparisons, up axis."""
        do, menu, view = self.commands, "View", ("view",)
        both = ("view", "object")
        return [
            (
                ActionSpec(
                    "frame",
                    menu,
                    "&Frame",
                    "Show the selected object, or the level without its far backdrop",
                    ("F",),
                    context=both,
                    needs=("scene",),
                ),
                do.frame,
            ),
            (
                ActionSpec(
                    "frame-all",
                    menu,
                    "Frame &everything",
                    "Show everything, backdrop included",
                    ("Shift+F", "Home"),
                    context=view,
                    needs=("scene",),
                ),
                do.frame_all,
            ),
            (
                ActionSpec("edges", menu, "&Edges", "Draw the edges of the triangles", ("E",), True, 1, view),
                lambda on: do.show(edges=on),
            ),
            (
                ActionSpec("shading", menu, "&Light", "Shape the surface by a light at the camera", ("L",), True, 1),
                lambda on: do.show(shading=on),
            ),
            (
                ActionSpec(
                    "back-faces", menu, "Hide &back faces", "Look into closed rooms from outside", ("B",), True, 1, view
                ),
                lambda on: do.show(back_faces=not on),
            ),
            (
                ActionSpec("game", menu, "As the &game stores it", "5 bits a pixel, dithered", ("G",), True, 1),
                lambda on: do.show(game=on),
            ),
            (
                ActionSpec(
                    "blend", menu, "B&lended", "Longest and shortest distance mixed", ("0",), group=2, needs=("result",)
                ),
                lambda: do.show(quantity=Quantity.BLEND),
            ),
            (
                ActionSpec(
                    "next-distance",
                    menu,
                    "&Next distance",
                    "Step through the baked distances",
                    ("N",),
                    group=2,
                    needs=("result",),
                ),
                do.next_distance,
            ),
            (
                ActionSpec(
                    "geometry", menu, "Geome&try", "The surface without values", ("T",), group=2, needs=("scene",)
                ),
                lambda: do.show(quantity=Quantity.GEOMETRY),
            ),
            (
                ActionSpec(
                    "invalid",
                    menu,
                    "&Invalid samples",
                    "Mark samples that see too many back faces",
                    ("I",),
                    True,
                    3,
                    view,
                    needs=("result",),
                ),
                self.bench.panels.overlays.set_invalid,
            ),
            (
                ActionSpec(
                    "compare",
                    menu,
                    "&Compare mappings",
                    "Average and least squares side by side on one camera",
                    ("C",),
                    True,
                    3,
                    needs=("result",),
                ),
                self.compare,
            ),
            (
                ActionSpec("up-y", menu, "Up is +&Y", "Orbit about the Y axis", (), True, 4),
                lambda _on: self._set_up_axis(1),
            ),
            (
                ActionSpec("up-z", menu, "Up is +&Z", "Orbit about the Z axis", (), True, 4),
                lambda _on: self._set_up_axis(2),
            ),
        ]

    def connect(self) -> None:
        """Follows the document."""
        bench, document, panels = self.bench, self.bench.document, self.bench.panels
        panels.probe.fly_requested.connect(lambda: self.commands.fly_to(bench.readouts.pinned))
        document.world_changed.connect(self._on_world)
        document.geometry_changed.connect(self._on_geometry)
        document.current_changed.connect(self._on_current)
        self._give_menu(bench.area.main)
        document.visibility_changed.connect(lambda: bench.picker.set_world(document.world, document.face_visible()))
        document.display_changed.connect(self._on_display)
        self._on_display()

    def compare(self, on: bool) -> None:
        """Shows the other mapping beside the result's own, on one camera."""
        self.bench.registry["compare"].setChecked(on)
        self.split(on)
        self.bench.controller.compare(on)

    def split(self, on: bool) -> None:
        """Opens or closes the second viewport, on one camera with the first."""
        bench = self.bench
        if on and bench.area.other is None:
            viewport = bench.area.split()
            bench.readouts.follow(viewport)
            self._give_menu(viewport)
            bench.presenter.add_viewport(viewport)
        elif not on and bench.area.other is not None:
            bench.presenter.remove_viewport(bench.area.other)
            bench.area.unsplit()

    def _give_menu(self, viewport: Viewport) -> None:
        """A right click selects what is under it, unless it is selected, and asks what to do with it."""
        bench, document = self.bench, self.bench.document

        def show(position: QPointF) -> None:
            found = viewport.pick_at(position)
            if found is not None and document.world is not None:
                index = int(document.world.face_object[found.face])
                if index not in document.selection:
                    document.select(index)
            menu = bench.registry.context_menu("view", bench.window)
            menu.aboutToHide.connect(menu.deleteLater)
            menu.popup(viewport.view.mapToGlobal(position.toPoint()))

        viewport.navigation.menu_asked.connect(show)

    def reset_camera(self) -> None:
        """Shows the level, without its far backdrop, from the usual side."""
        document, viewport = self.bench.document, self.bench.area.main
        world = document.world
        if world is not None and world.vertex_count:
            viewport.set_camera(Camera(up_axis=document.up_axis))
            viewport.frame(*robust_bounds(world.positions), fly=False)

    def _set_up_axis(self, axis: int) -> None:
        self.bench.document.set_up_axis(axis)
        self.reset_camera()
        self._on_display()  # the tick of the axis that was chosen again

    def _on_geometry(self) -> None:
        document = self.bench.document
        if document.world is not None:
            self.bench.picker.move_world(document.world, document.face_visible())

    def _on_current(self) -> None:
        """What is no longer there can no longer be clicked."""
        document, absent = self.bench.document, self.bench.document.absent()
        if not np.array_equal(absent, self._absent):
            self._absent = absent
            self.bench.picker.set_world(document.world, document.face_visible())

    def _on_world(self) -> None:
        document = self.bench.document
        self.bench.picker.set_world(document.world, document.face_visible())
        if document.world is not None and self._framed != document.scene_path:
            self._framed = document.scene_path
            self.reset_camera()

    def _on_display(self) -> None:
        document = self.bench.document
        display = document.display
        states = {
            "edges": display.edges,
            "shading": display.shading,
            "back-faces": not display.back_faces,
            "game": display.game,
            "up-y": document.up_axis == 1,
            "up-z": document.up_axis == 2,
        }
        for name, on in states.items():
            self.bench.registry[name].setChecked(on)
