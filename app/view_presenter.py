"""Draws the document: follows its events and tells the viewports what to show."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from app.decorator_presenter import DecoratorPresenter
from app.document import Document
from app.viewport import Viewport
from bake.types import VertexField, VertexState, World
from viewer.decorator_view import TREE_WORDS, TreeShading
from viewer.display import shown_field
from viewer.fields import Quantity, distance_label
from viewer.overlays import OverlayPoints, all_sample_points, invalid_sample_points, vertices_in_state
from viewer.tone import GAME_BITS


@dataclass(frozen=True, slots=True)
class Overlays:
    """Which marks are drawn, and how large in pixels."""

    invalid: bool = False
    filled: bool = False
    unreferenced: bool = False
    samples: bool = False
    size: int = 5


class ViewPresenter:
    """Keeps viewports in step with a document.

    Args:
        document: What is shown.
        viewports: The first shows the document's field, the second, if there is one, that of the other mapping.
    """

    def __init__(self, document: Document, viewports: Sequence[Viewport]) -> None:
        self._document = document
        self._viewports = list(viewports)
        self._overlays = Overlays()
        self.decorators = DecoratorPresenter(document, self._viewports)
        self._absent = document.absent()
        self._placed = document.world
        self._coloring = (document.decorators.trees, document.tree_shading, document.decorators.scalars)
        self.caption_of: Callable[[int], str] | None = None
        """Says what each viewport shows, for those who compare other things than mappings."""
        self.drawn_note = ""
        """What was left out of the marks; empty if nothing."""
        document.world_changed.connect(self._on_world)
        document.field_changed.connect(self._on_field)
        document.display_changed.connect(self._on_display)
        document.decorators_changed.connect(self._on_decorators)
        document.threshold_changed.connect(self._draw_overlays)
        document.visibility_changed.connect(self._on_visibility)
        document.current_changed.connect(self._on_current)
        document.geometry_changed.connect(self._on_geometry)
        document.selection_changed.connect(self._on_selection)

    def set_overlays(self, overlays: Overlays) -> None:
        """Changes which marks are drawn."""
        self._overlays = overlays
        self._draw_overlays()

    def add_viewport(self, viewport: Viewport) -> None:
        """Shows the document in one more viewport."""
        self._viewports.append(viewport)
        viewport.set_world(self._document.world)
        viewport.set_visible_faces(self._document.face_visible())
        self._draw()
        self._draw_overlays()
        self._on_selection()
        self.decorators.draw()

    def remove_viewport(self, viewport: Viewport) -> None:
        """Leaves a viewport alone from now on."""
        self._viewports.remove(viewport)
        self._draw()

    def close(self) -> None:
        """Stops following the document."""
        document = self._document
        document.world_changed.disconnect(self._on_world)
        document.field_changed.disconnect(self._on_field)
        document.display_changed.disconnect(self._on_display)
        document.decorators_changed.disconnect(self._on_decorators)
        self.decorators.close()
        document.threshold_changed.disconnect(self._draw_overlays)
        document.visibility_changed.disconnect(self._on_visibility)
        document.current_changed.disconnect(self._on_current)
        document.geometry_changed.disconnect(self._on_geometry)
        document.selection_changed.disconnect(self._on_selection)

    def _on_world(self) -> None:
        self._placed = self._document.world
        self._absent = self._document.absent()
        visible = self._document.face_visible()
        for viewport in self._viewports:
            viewport.set_world(self._document.world)
            viewport.set_visible_faces(visible)
        self.decorators.draw()

    def _on_field(self) -> None:
        self._draw()
        self._draw_overlays()

    def _on_display(self) -> None:
        self._draw()
        if self._overlays.samples:
            self._draw_overlays()

    def _on_decorators(self) -> None:
        view = self._document.decorators
        coloring = (view.trees, self._document.tree_shading, view.scalars)
        if coloring != self._coloring:
            self._coloring = coloring
            self._draw()

    def _on_visibility(self) -> None:
        visible = self._document.face_visible()
        for viewport in self._viewports:
            viewport.set_visible_faces(visible)

    def _on_current(self) -> None:
        absent = self._document.absent()
        if not np.array_equal(absent, self._absent):
            self._absent = absent
            self._on_visibility()

    def _on_geometry(self) -> None:
        world, before = self._document.world, self._placed
        self._placed = world
        if world is not None:
            for own in _moved(before, world):
                for viewport in self._viewports:
                    viewport.move_vertices(own.start, np.asarray(world.positions[own]))
        self._draw_overlays()
        self._on_selection()

    def _on_selection(self) -> None:
        boxes = self._document.object_boxes(self._document.selection)
        for viewport in self._viewports:
            viewport.set_boxes(boxes)

    def _draw(self) -> None:
        document = self._document
        comparing = len(self._viewports) > 1
        for number, viewport in enumerate(self._viewports):
            field = document.field if number == 0 else document.other
            display = document.display
            if number == 1 and display.quantity is Quantity.DIFFERENCE:
                display = display.replaced(quantity=Quantity.DISTANCE)
            shown = None
            if number == 0:
                shown = document.shown()  # made once, for the legend and the histogram too
            elif display.quantity is not Quantity.INSPECTION and document.result is not None and field is not None:
                shown = shown_field(display, document.result, document.drawn(field), document.other)
            viewport.set_field(shown, display, self._note(display.quantity))
            if self.caption_of is not None:
                viewport.set_caption(self.caption_of(number))
            else:
                viewport.set_caption(self._caption(number, field) if comparing else "")

    def _note(self, quantity: Quantity) -> str:
        document = self._document
        parts: list[str] = []
        if quantity is Quantity.INSPECTION:
            return f"threshold {document.threshold:.1%}, not stored" if document.is_preview else ""
        trees = document.decorators.trees
        if document.values is not None and document.values.has(TreeShading.PRODUCT) and trees is not TreeShading.NONE:
            busy = "" if document.tree_shading is trees else " (being made …)"
            parts.append(f"trees: {TREE_WORDS[trees]}{busy}")
        if quantity is Quantity.DIFFERENCE and document.other_name:
            parts.insert(0, f"this − {document.other_name}")
        elif quantity is Quantity.DIFFERENCE and document.result is not None:
            names = (document.result.settings.mapping, document.other_mapping())
            parts.append(" − ".join(kind.value.replace("-", " ") for kind in names))
        elif document.display.game:
            parts.append(f"{GAME_BITS} bits, dithered")
        if document.is_preview:
            parts.append(document.field_note or f"threshold {document.threshold:.1%}, not stored")
        return ", ".join(parts)

    def _caption(self, number: int, field: VertexField | None) -> str:
        document = self._document
        if document.result is None:
            return ""
        kind = document.result.settings.mapping if number == 0 else document.other_mapping()
        name = kind.value.replace("-", " ").replace("average", "weighted average").capitalize()
        if field is None:
            return f"{name}: solving …"
        labels = map(distance_label, document.result.settings.column_distances)
        errors = ", ".join(f"{error:.4f} ({label})" for error, label in zip(field.report.rmse, labels, strict=True))
        return f"{name}  ·  RMS to samples {errors}"

    def _draw_overlays(self) -> None:
        document, wanted = self._document, self._overlays
        result, field, world = document.result, document.field, document.world
        points: dict[str, OverlayPoints | None] = dict.fromkeys(("samples", "invalid", "filled", "unreferenced"))
        if result is not None and field is not None and world is not None:
            if wanted.samples:
                points["samples"] = all_sample_points(world, result.samples, result.tally, self._column())
            if wanted.invalid:
                points["invalid"] = invalid_sample_points(world, result.samples, result.tally, document.threshold)
            if wanted.filled:
                points["filled"] = vertices_in_state(world, field, VertexState.FILLED)
            if wanted.unreferenced:
                points["unreferenced"] = vertices_in_state(world, field, VertexState.UNREFERENCED)
        self.drawn_note = "\n".join(
            f"{len(drawn.positions):,} of {drawn.total:,} {name} marks are drawn"
            for name, drawn in points.items()
            if drawn is not None and len(drawn.positions) < drawn.total
        )
        for viewport in self._viewports:
            for name, drawn in points.items():
                viewport.set_points(name, drawn, wanted.size if name != "samples" else max(wanted.size - 2, 1))

    def _column(self) -> int:
        display, result = self._document.display, self._document.result
        if display.quantity is Quantity.DISTANCE or result is None:
            return display.column
        distances = result.settings.column_distances
        return distances.index(max(distances))


def _moved(before: World | None, now: World) -> list[slice]:
    """Spans of vertices that lie elsewhere than before; all of them if the objects are others."""
    if before is None or before.object_paths != now.object_paths:
        return [slice(0, now.vertex_count)]
    pairs = zip(before.object_hash, now.object_hash, strict=True)
    moved = [number for number, (then, digest) in enumerate(pairs) if then != digest]
    return [slice(int(now.first_vertex[number]), int(now.first_vertex[number + 1])) for number in moved]
