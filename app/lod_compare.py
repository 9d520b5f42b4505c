"""The levels of detail of one object side by side on one camera, the finest first."""

from __future__ import annotations

from functools import partial

import numpy as np
from PyQt6.QtWidgets import QWidget

from app.document import Document
from app.jobs import Jobs
from app.side_by_side import Geometry, SideBySide
from bake.errors import ObscuraError
from bake.types import BakeResult, Float64Array, World
from viewer.camera import Camera
from viewer.display import shown_field
from viewer.fields import Quantity, distance_label
from viewer.lods import Levels, level_differences, levels_of, vertices_of

_MOST = 4
_JOB = "lod differences"
_CAPTION_TIP = (
    "How far the level's AO is from the finest level's: at each of its vertices the nearest one there that faces the "
    "same way, root of the mean square"
)


class LodCompare(SideBySide):
    """Follows the document's selection; keeps the last object while something without levels is selected.

    Args:
        document: What is shown.
        camera: From where to look at first.
        jobs: Where differences are worked out.
        parent: Qt parent.
    """

    def __init__(self, document: Document, camera: Camera, jobs: Jobs, parent: QWidget | None = None) -> None:
        tip = "The same camera for all levels: drag to orbit, wheel to zoom"
        super().__init__(camera, tip, "Close the comparison (Alt+M)", parent)
        self._document, self._jobs = document, jobs
        self._levels: Levels | None = None
        self._world: World | None = None
        self._of: BakeResult | None = None
        self._differences: list[Float64Array] | None = None
        self._events = (
            document.selection_changed, document.result_changed, document.display_changed, document.world_changed,
            document.field_changed,
        )  # fmt: skip
        for event in self._events:
            event.connect(self._follow)
        self._follow()

    def close_view(self) -> None:
        """Stops following and frees VTK's side; must precede the end of the window."""
        for event in self._events:
            event.disconnect(self._follow)
        self._jobs.drop(_JOB)
        super().close_view()

    def _follow(self) -> None:
        document, world = self._document, self._document.world
        self.set_up_axis(document.up_axis)
        if world is not self._world:
            self._world, self._levels = world, None
            self.show_surfaces(())
        levels = None if world is None else levels_of(world, document.selected)
        if levels is None and self._levels is None and world is not None:
            levels = next((found for index in range(world.object_count) if (found := levels_of(world, index))), None)
        if levels is not None and levels != self._levels:
            self._set_levels(levels)
        if document.result is not self._of:
            self._of = document.result
            self._compare()
        self._color()

    def _set_levels(self, levels: Levels) -> None:
        world = self._world
        assert world is not None
        self._levels = levels
        shown = levels.shown(_MOST)
        self.set_columns(len(shown), _CAPTION_TIP)
        self.show_surfaces([_geometry(world, objects) for objects in shown])
        self._compare()

    def _compare(self) -> None:
        """Works out how far the lower levels are from the finest, off the window's thread."""
        self._differences, result, levels = None, self._document.result, self._levels
        self._jobs.drop(_JOB)
        if result is not None and levels is not None:
            work = partial(level_differences, result.world, np.asarray(result.field.ao), levels)
            self._jobs.run(_JOB, work, self._on_differences, self._on_failed)

    def _on_differences(self, differences: list[Float64Array]) -> None:
        self._differences = differences
        self._color()

    def _on_failed(self, error: ObscuraError) -> None:
        self.title.setText(str(error))

    def _color(self) -> None:
        document, world, levels = self._document, self._world, self._levels
        result, field = document.result, document.field
        if world is None or levels is None or not self.surfaces:
            self.set_columns(1)
            self.captions[0].setText("")
            self.title.setText("This scene has no levels of detail." if world is not None else "")
            self.view.update()
            return
        title = world.object_paths[levels.finest[0]] if len(levels.finest) == 1 else levels.of
        labels = [] if result is None else [distance_label(d) for d in result.settings.column_distances]
        display, shown = document.display, None
        if result is not None and field is not None:
            if display.quantity not in (Quantity.DISTANCE, Quantity.BLEND):
                display = display.replaced(quantity=Quantity.BLEND)
            shown = shown_field(display, result, document.drawn(field))
        colors = None if shown is None else shown.colors(display.map_for(shown), *display.range_for(shown))
        for number, objects in enumerate(levels.shown(_MOST)):
            if colors is not None:
                self.surfaces[number].set_colors(colors[vertices_of(world, objects)])
            triangles = sum(int(world.first_face[i + 1] - world.first_face[i]) for i in objects)
            name = "Finest" if number == 0 else f"LOD {number}"
            self.captions[number].setText(f"<b>{name}</b>  {triangles:,} triangles<br>{self._error(number, labels)}")
        self.title.setText(title if shown is None else f"{title}   ·   {shown.title}")
        self.view.update()

    def _error(self, number: int, labels: list[str]) -> str:
        if number == 0:
            return "traced on its own surface" if labels else "not baked"
        if not labels:
            return "not baked"
        if self._differences is None:
            return "comparing …"
        errors = zip(self._differences[number - 1], labels, strict=True)
        return "off by " + "  ·  ".join(f"{error:.4f} at {label}" for error, label in errors)


def _geometry(world: World, objects: tuple[int, ...]) -> Geometry:
    """The triangles of some objects with their own vertices counted from 0."""
    positions = world.positions[vertices_of(world, objects)]
    faces, first = [], 0
    for index in objects:
        own = np.asarray(world.faces[world.first_face[index] : world.first_face[index + 1]])
        faces.append(own - np.int32(world.first_vertex[index] - first))
        first += int(world.first_vertex[index + 1] - world.first_vertex[index])
    return np.asarray(positions), np.concatenate(faces)
