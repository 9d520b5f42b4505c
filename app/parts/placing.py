"""Moving, turning, scaling, duplicating and deleting objects; every change is a step and stands in the side file."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any

import numpy as np

from app.actions import Action, ActionSpec
from app.move_tool import MoveTool
from app.parts.scene_edits import SceneEditsPart
from app.parts.scene_watch import SceneWatchPart
from app.place_panel import PlacePanel
from app.placing_edit import copy_tables, keys_after, keys_of
from app.window_parts import DockSpec, Part, Side, Workbench
from bake.types import Float64Array, Placing, Role, SceneObject
from viewer.gizmo import Motion

PANEL = "Object"
_MOVE = "move-tool"


class PlacingPart(Part):
    """The handles in the view, the panel of the selected objects, and the actions on both."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.panel = PlacePanel()
        self.tool = MoveTool(bench.area.main, centre=self._centre, preview=self._preview, commit=self.place_by)
        self._wanted: tuple[str, ...] = ()

    def docks(self) -> Sequence[DockSpec]:
        """The panel."""
        return [DockSpec(PANEL, self.panel, Side.RIGHT, scrolled=True)]

    def actions(self) -> list[Action]:
        """What can be done with selected objects."""
        menu, both, needs = "Edit", ("object", "view"), ("selection", "scene-file")

        def spec(name: str, text: str, tip: str, keys: tuple[str, ...], *, checkable: bool = False) -> ActionSpec:
            wanted = ("scene-file",) if checkable else needs
            return ActionSpec(name, menu, text, tip, keys, checkable, 4, both, wanted)

        return [
            (
                spec(
                    _MOVE,
                    "&Move, turn, scale",
                    "Handles in the view for the selected objects; with Ctrl they go in whole steps",
                    ("W",),
                    checkable=True,
                ),
                self._switch,
            ),
            (spec("duplicate", "D&uplicate", "Copy what is selected, beside itself", ("Ctrl+D",)), self.duplicate),
            (
                spec("delete", "&Delete", "Take the selected objects out of the level; its file stays", ("Delete",)),
                self.delete,
            ),
            (
                spec("bring-back", "&Bring back", "Let deleted objects be there for the bake again", ("Shift+Delete",)),
                self.bring_back,
            ),
            (spec("reset-place", "Back to its &place", "Put objects where the file has them", ()), self.reset),
        ]

    def connect(self) -> None:
        """Follows selection and scene."""
        document, registry = self.bench.document, self.bench.registry
        names = (_MOVE, "reset-place", "duplicate", "delete")
        self.panel.add_buttons([registry[name] for name in names])
        self.panel.placed.connect(self._on_placed)
        self.panel.key_set.connect(self._on_key)
        for event in (document.selection_changed, document.current_changed, document.world_changed, document.opened):
            event.connect(self.refresh)
        document.geometry_changed.connect(self.tool.draw)
        document.selection_changed.connect(self._on_selection)
        document.world_changed.connect(self._select_wanted)
        self.bench.docks[PANEL].visibilityChanged.connect(self._on_panel)
        self.refresh()

    # What the user asks for

    def duplicate(self) -> None:
        """Copies the selected objects, beside themselves."""
        items = self._items()
        scene = self.bench.document.current.scene if self.bench.document.current is not None else None
        if not items or scene is None:
            self._wait_for_scene()
            return
        tables = copy_tables(items, [item.path for item in scene.objects], self._beside())
        if not tables:
            text = "Levels of detail are not copied by themselves."
            self.bench.banner.show_message(logging.INFO, text)
            return
        paths = [
            str(table["of"]).rpartition("/")[0] + "/" * ("/" in str(table["of"])) + table["name"] for table in tables
        ]
        self._wanted = tuple(paths)
        self.bench.part(SceneEditsPart).set_keys({}, f"duplicate {_named(items)}", copies=tables)

    def delete(self) -> None:
        """Takes the selected objects out of the level: copies go, the others are ignored from now on."""
        items = self._items()
        if not items:
            self._wait_for_scene()
            return
        copies = [item.path for item in items if item.copy_of]
        keys = {item.path: {"role": Role.IGNORE.value} for item in items if not item.copy_of}
        self.bench.part(SceneEditsPart).set_keys(keys, f"delete {_named(items)}", without=copies)

    def bring_back(self) -> None:
        """Takes back that the selected objects are ignored."""
        items = [item for item in self._items() if item.role is Role.IGNORE]
        if items:
            keys = {item.path: {"role": None} for item in items}
            self.bench.part(SceneEditsPart).set_keys(keys, f"bring back {_named(items)}")

    def reset(self) -> None:
        """Puts the selected objects where the file has them."""
        items = [item for item in self._items() if item.placing is not None and not item.placing.is_as_stored]
        if items:
            keys = {item.path: keys_of(Placing()) for item in items}
            self.bench.part(SceneEditsPart).set_keys(keys, f"back to its place: {_named(items)}")

    def refresh(self) -> None:
        """Shows the selected objects."""
        document, items = self.bench.document, self._items()
        current = document.current
        self.tool.draw()
        if not document.selection:
            self.panel.show_none()
        elif current is not None and current.complaint:
            self.panel.show_none(current.complaint)
        elif current is None or current.scene is None:
            self.panel.show_none("Reading the scene …")
            self._want_scene()
        elif not items:
            self.panel.show_none("No longer in the scene.")
        elif len(items) == 1:
            item = items[0]
            note = "changed since the bake" if item.path in current.stale else ""
            note = "not baked yet" if item.path in current.new else note
            self.panel.show_object(item.path, item.role, note, item.placing, item.keys)
        else:
            stale = sum(item.path in current.stale for item in items)
            note = f"{stale:,} changed since the bake" if stale else ""
            self.panel.show_several(len(items), note, [item.keys for item in items])

    # What happens

    def _items(self) -> list[SceneObject]:
        document = self.bench.document
        if document.current is None or document.world is None:
            return []
        paths = [document.world.object_paths[index] for index in document.selection]
        return [item for path in paths if (item := document.current.item(path)) is not None]

    def _switch(self, on: bool) -> None:
        self.tool.switch(on)
        if on:
            self._want_scene()

    def _want_scene(self) -> None:
        """Reads the scene itself as soon as somebody looks at an object's place."""
        if self.tool.is_on or self.bench.docks[PANEL].isVisible():
            self.bench.part(SceneWatchPart).want_scene()

    def _wait_for_scene(self) -> None:
        self.bench.part(SceneWatchPart).want_scene()
        self.bench.banner.show_message(logging.INFO, "The scene is being read; try again in a moment.")

    def _on_panel(self, shown: bool) -> None:
        if shown:
            self.refresh()

    def _on_selection(self) -> None:
        if self.tool.is_dragging:
            self.tool.give_up()

    def escape(self) -> bool:
        """Takes a drag back, or puts the handles away."""
        if self.tool.is_dragging:
            self.tool.give_up()
            return True
        if self.tool.is_on:
            self.bench.registry[_MOVE].setChecked(False)
            self._switch(False)
            return True
        return False

    def _centre(self) -> Float64Array | None:
        """Where the handles belong: at the one object's own origin if it lies inside its box, else in the middle."""
        document = self.bench.document
        items = self._items()
        bounds = document.bounds_of(document.selection)
        if not items or bounds is None or document.world is None:
            return None
        middle = 0.5 * (bounds[0] + bounds[1])
        if len(items) == 1 and items[0].placing is not None:
            own = np.asarray(items[0].placing.origin) - np.asarray(document.world.origin)
            margin = 1e-3 * float(np.linalg.norm(bounds[1] - bounds[0]))
            if (own >= bounds[0] - margin).all() and (own <= bounds[1] + margin).all():
                return own
        return middle

    def _preview(self, motion: Motion) -> None:
        world, centre = self.bench.document.world, self._centre()
        if world is None or centre is None:
            return
        boxes = []
        for index in self.bench.document.selection:
            first, end = int(world.first_vertex[index]), int(world.first_vertex[index + 1])
            moved = motion.moved(np.asarray(world.positions[first:end]), centre)
            for viewport in self.bench.area.viewports:
                viewport.move_vertices(first, moved)
            if len(moved):
                boxes.append((moved.min(axis=0), moved.max(axis=0)))
        for viewport in self.bench.area.viewports:
            viewport.set_boxes(np.array(boxes).reshape(-1, 2, 3))

    def place_by(self, motion: Motion) -> None:
        """Moves, turns and scales the selected objects about the handles' centre."""
        world, centre, items = self.bench.document.world, self._centre(), self._items()
        if world is None or centre is None:
            return
        self._preview(motion)  # the objects are there at once, whoever reads the edit first
        keys = keys_after(items, motion, centre + np.asarray(world.origin))
        word = "scale" if motion.factor != 1.0 else "move" if any(motion.shift) else "turn"
        self.bench.part(SceneEditsPart).set_keys(keys, f"{word} {_named(items)}")

    def _on_placed(self, row: str, axis: int, value: float) -> None:
        items = self._items()
        if len(items) != 1 or items[0].placing is None:
            return
        placing = items[0].placing
        name = "translate" if row == "origin" else row
        values = list(getattr(placing, name))
        values[axis] = value - placing.pivot[axis] if row == "origin" else value
        if row == "scale" and value <= 0.0:
            self.bench.banner.show_message(logging.WARNING, "A factor must be above 0.")
            self.refresh()
            return
        said = {name: getattr(placing, name) for name in ("translate", "rotate", "scale", "pivot")}
        word = {"origin": "move", "rotate": "turn"}.get(row, "scale")
        keys: dict[str, Any] = keys_of(Placing(**{**said, name: tuple(values)}))
        self.bench.part(SceneEditsPart).set_keys({items[0].path: keys}, f"{word} {_named(items)}")

    def _on_key(self, name: str, value: object) -> None:
        items = self._items()
        if items:
            text = f"{name} of {_named(items)}: {'as set' if value is None else value}"
            self.bench.part(SceneEditsPart).set_keys({item.path: {name: value} for item in items}, text)

    def _beside(self) -> tuple[float, float, float]:
        """A shift by the width of what is selected, to the right of the picture along the nearest axis."""
        document, right = self.bench.document, self.bench.area.main.camera.right
        bounds = document.bounds_of(document.selection)
        if bounds is None:
            return 0.0, 0.0, 0.0
        axis = int(np.argmax(np.abs(right)))
        shift = [0.0, 0.0, 0.0]
        shift[axis] = round(float(np.sign(right[axis]) * (bounds[1] - bounds[0])[axis]), 3)
        return shift[0], shift[1], shift[2]

    def _select_wanted(self) -> None:
        world = self.bench.document.world
        if self._wanted and world is not None and set(self._wanted) <= set(world.object_paths):
            place = {path: index for index, path in enumerate(world.object_paths)}
            wanted, self._wanted = self._wanted, ()
            self.bench.document.select_all(place[path] for path in wanted)


def _named(items: Sequence[SceneObject]) -> str:
    return items[0].path.rpartition("/")[2] if len(items) == 1 else f"{len(items):,} objects"
