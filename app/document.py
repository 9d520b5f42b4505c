"""What is open: scene, world, result, and what of it is shown. Knows no Qt; tells its observers by events."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from app.events import Event
from app.kept_boxes import KeptBoxes
from app.scene_state import SceneState
from bake.settings import BakeSettings, MappingKind
from bake.types import BakeResult, BoolArray, Finding, Float64Array, Role, VertexField, World
from viewer.decorated import DecoratedValues
from viewer.decorator_view import DecoratorView, TreeShading
from viewer.display import Display, shown_field
from viewer.fields import Quantity, SurfaceField
from viewer.probe import Readout

if TYPE_CHECKING:
    from bake.scene.load import SceneReader


class Document:
    """State of one window. Setters emit the event of what they changed, after the change.

    Attributes:
        scene_path: The scene's file; None while nothing is open.
        result_path: Folder that the shown result lies in, or that a bake goes to.
        scene_name: For titles.
        files: Hashes of the scene's files, to tell whether a result is up to date.
        up_axis: 1 for +Y up, 2 for +Z up.
        scene_settings: What the form starts from when the scene is opened.
        side_file_settings: What the scene is baked with when nothing is said; None if its side file was not read.
        findings: Of the scene, or of its result once there is one.
        reader: Has read the scene's file, if somebody has.
        world: Geometry in view.
        result: The bake in view, with a place for what the scene has more by now.
        stored: The same as it is stored.
        field: Vertex values in view: the result's own, or those of a changed threshold (then `is_preview`).
        field_note: What those values are, where it is no changed threshold.
        other: What those are compared with, once it is there: the values of the other mapping, or of another result.
        other_name: Which result that is; empty for the other mapping.
        threshold: Back-face threshold in view.
        display: How it is shown.
        decorators: What is shown of trees, shrubs and small decorators.
        values: Values of the result's decorators; None without a result.
        visible: Objects that are drawn, shape (o,), bool.
        selected: Index of the object selected last, -1 for none.
        selection: Indices of all selected objects, ascending; holds `selected`, unless that is -1.
        current: What the scene's files say now, where that is known; see `app.scene_state`.
        pinned: The point that was clicked.
        inspection: What the surface is looked at by besides AO, once it is made; see `app.parts.inspections`.
    """

    def __init__(self) -> None:
        self.scene_path: Path | None = None
        self.result_path: Path | None = None
        self.files: dict[str, str] = {}
        self.up_axis = 1
        self.findings: tuple[Finding, ...] = ()
        self.scene_settings = BakeSettings()
        self.side_file_settings: BakeSettings | None = None
        self.reader: SceneReader | None = None
        self.world: World | None = None
        self.result: BakeResult | None = None
        self.stored: BakeResult | None = None
        self.field: VertexField | None = None
        self.other: VertexField | None = None
        self.other_name = ""
        self.field_note = ""
        self.threshold = 0.25
        self.display = Display()
        self.decorators = DecoratorView()
        self.values: DecoratedValues | None = None
        self.visible: BoolArray = np.zeros(0, bool)
        self.selected = -1
        self.selection: tuple[int, ...] = ()
        self.current: SceneState | None = None
        self.pinned: Readout | None = None
        self.inspection: SurfaceField | None = None
        self._shown: tuple[tuple[object, ...], SurfaceField | None] = ((), None)
        self._boxes = KeptBoxes()
        self._drawn: list[tuple[VertexField, DecoratorView, VertexField]] = []

        self.opened: Event[[]] = Event()
        self.world_changed: Event[[]] = Event()
        self.result_changed: Event[[]] = Event()
        self.field_changed: Event[[]] = Event()
        self.threshold_changed: Event[[]] = Event()
        self.display_changed: Event[[]] = Event()
        self.decorators_changed: Event[[]] = Event()
        self.visibility_changed: Event[[]] = Event()
        self.selection_changed: Event[[]] = Event()
        self.pinned_changed: Event[[]] = Event()
        self.current_changed: Event[[]] = Event()
        self.geometry_changed: Event[[]] = Event()

    def events(self) -> tuple[Event[[]], ...]:
        """All events."""
        return (
            self.opened, self.world_changed, self.result_changed, self.field_changed, self.threshold_changed,
            self.display_changed, self.decorators_changed, self.visibility_changed, self.selection_changed,
            self.pinned_changed, self.current_changed, self.geometry_changed,
        )  # fmt: skip

    @property
    def scene_name(self) -> str:
        """Name of what is open, for titles; empty if nothing is."""
        return self.scene_path.name if self.scene_path is not None else ""

    @property
    def is_preview(self) -> bool:
        """Whether the values in view are not the stored ones."""
        return self.result is not None and self.field is not self.result.field

    def open_scene(
        self, path: Path, result_path: Path, files: dict[str, str], findings: tuple[Finding, ...], up_axis: int
    ) -> None:
        """Starts over with a scene; its geometry follows by `set_world`."""
        self.scene_path, self.result_path, self.files = path, result_path, files
        self.findings, self.up_axis, self.reader = findings, up_axis, None
        self.world = self.result = self.stored = self.field = self.other = self.pinned = self.values = self.current = (
            None
        )
        self._drawn = []
        self.selected, self.selection = -1, ()
        self.visible = np.zeros(0, bool)
        self.opened.emit()

    def set_world(self, world: World) -> None:
        """Shows geometry, without values. What is selected and hidden stays so, as far as it is there by its path."""
        before, visible = self.world, self.visible
        chosen, last = self.selection, self.selected
        self.world = world
        self.visible = self.visible_at_first()
        self.selected, self.selection, self.pinned = -1, (), None
        if before is not None and len(visible) == before.object_count:
            kept = {path: index for index, path in enumerate(before.object_paths)}
            for index, (path, role) in enumerate(zip(world.object_paths, world.object_roles, strict=True)):
                if path in kept and before.object_roles[kept[path]] is role:
                    self.visible[index] = visible[kept[path]]
            place = {path: index for index, path in enumerate(world.object_paths)}
            paths = [before.object_paths[index] for index in chosen]
            self.selection = tuple(sorted(place[path] for path in paths if path in place))
            wanted = place.get(before.object_paths[last], -1) if last >= 0 else -1
            self.selected = wanted if wanted in self.selection else next(iter(self.selection), -1)
        self.result = self.stored = self.field = self.other = self.values = self.inspection = None
        self._drawn = []
        self.world_changed.emit()
        self.result_changed.emit()
        self.field_changed.emit()

    def show_geometry(self, world: World) -> None:
        """Shows a world without values, unless the one in view has the same geometry: then all stays as it is."""
        if self.world is None or not _same_geometry(self.world, world):
            self.set_world(world)

    def set_result(self, result: BakeResult, path: Path) -> None:
        """Shows a result: its world, if it differs from the one in view, and its values."""
        self.show_geometry(result.world)
        if self.world is not None:
            self._boxes.follow(self.world, result.world)
        self.world = result.world
        self.result, self.stored, self.result_path = result, result, path
        self.field, self.field_note, self.other = result.field, "", None
        self.values, self._drawn = DecoratedValues(result), []
        self.findings = tuple(result.findings)
        self.threshold = result.settings.back_face_threshold
        look, columns = self.display, len(result.settings.column_distances)
        if self.display.column >= columns:
            self.display = self.display.replaced(column=columns - 1)
        self.decorators = self.decorators.replaced(voxel=-1, column=min(self.decorators.column, columns - 1))
        if self.values.has(TreeShading.PRODUCT) and not self.values.has(self.decorators.trees):
            self.decorators = self.decorators.replaced(trees=TreeShading.PRODUCT)
        if self.display.quantity in (Quantity.GEOMETRY, Quantity.DIFFERENCE, Quantity.INSPECTION):
            self.display = self.display.replaced(quantity=Quantity.BLEND)
        if self.display != look:  # else all that is drawn would be drawn twice
            self.display_changed.emit()
        self.result_changed.emit()
        self.threshold_changed.emit()
        self.field_changed.emit()

    def move_world(self, world: World) -> None:
        """Shows the same objects in other places; values stay with their vertices."""
        if self.world is not None:
            self._boxes.follow(self.world, world)
        self.world = world
        self.geometry_changed.emit()

    def extend_world(self, world: World, result: BakeResult | None) -> None:
        """Shows a world with further objects behind those it had, or fewer of these.

        Args:
            world: The geometry.
            result: The result in view, with a place for the values of every vertex; None without one.
        """
        stored = self.stored
        self.set_world(world)
        if result is not None:
            self.result, self.stored, self.field, self.field_note = result, stored, result.field, ""
            self.values = DecoratedValues(result)
            self.result_changed.emit()
            self.field_changed.emit()

    def drop_result(self) -> None:
        """Shows the geometry without values, as before the first bake."""
        self.result = self.stored = self.field = self.other = self.values = self.inspection = None
        self._drawn = []
        self.result_changed.emit()
        self.field_changed.emit()

    def set_field(self, field: VertexField, note: str = "") -> None:
        """Shows other values on the same result, e.g. those of a changed threshold; the note says what they are."""
        self.field, self.field_note = field, note
        self.field_changed.emit()

    def set_other(self, other: VertexField | None, name: str = "") -> None:
        """Takes the values of the other mapping, or those of another result of that name, with its decorators'."""
        self.other, self.other_name = other, name
        self.field_changed.emit()

    def set_inspection(self, inspection: SurfaceField | None) -> None:
        """Takes what the display asked for besides AO; None while it is being made."""
        if inspection is not self.inspection:
            self.inspection = inspection
            self.field_changed.emit()

    def set_threshold(self, threshold: float) -> None:
        """Moves the back-face threshold in view; values follow by `set_field`."""
        if threshold != self.threshold:
            self.threshold = threshold
            self.threshold_changed.emit()

    def set_display(self, display: Display) -> None:
        """Changes how things are shown."""
        if display != self.display:
            self.display = display
            self.display_changed.emit()

    def set_decorators(self, view: DecoratorView) -> None:
        """Changes what is shown of decorators."""
        if view != self.decorators:
            self.decorators = view
            self.decorators_changed.emit()

    def set_up_axis(self, axis: int) -> None:
        """Changes which way is up."""
        if axis != self.up_axis:
            self.up_axis = axis
            self.display_changed.emit()

    def set_visible(self, visible: BoolArray) -> None:
        """Shows and hides objects."""
        if not np.array_equal(visible, self.visible):
            self.visible = visible
            self.visibility_changed.emit()

    def visible_at_first(self) -> BoolArray:
        """Objects that are drawn until the user says otherwise, shape (o,), bool.

        Lower LODs lie in the same place as what they stand for.
        """
        roles = self.world.object_roles if self.world is not None else ()
        return np.array([role not in (Role.LOD, Role.IGNORE) for role in roles], bool)

    def select(self, index: int) -> None:
        """Selects an object; -1 for none."""
        self.select_all((index,) if index >= 0 else ())

    def select_all(self, indices: Iterable[int], last: int | None = None) -> None:
        """Selects several objects.

        Args:
            indices: The objects.
            last: The one among them that was added last; the first of them by default.
        """
        selection = tuple(sorted({int(index) for index in indices}))
        selected = last if last in selection else next(iter(selection), -1)
        if (selection, selected) != (self.selection, self.selected):
            self.selection, self.selected = selection, selected
            self.selection_changed.emit()

    def set_current(self, current: SceneState | None) -> None:
        """Takes what the scene's files say now."""
        self.current = current
        self.current_changed.emit()

    def pin(self, readout: Readout | None) -> None:
        """Keeps a point's readout in view."""
        self.pinned = readout
        self.pinned_changed.emit()

    @property
    def tree_shading(self) -> TreeShading:
        """The model that colours the trees now: the one chosen, or the stored one until the values of that are made."""
        wanted = self.decorators.trees
        return wanted if self.values is None or self.values.ready(wanted) else TreeShading.PRODUCT

    def drawn(self, field: VertexField) -> VertexField:
        """A field of surfaces with the values of decorators as they are shown; kept until something changes."""
        if self.values is None or (self.other_name and field is self.other):
            return field
        if self.display.quantity is Quantity.DIFFERENCE and not self.other_name:
            return field
        coloring = DecoratorView(trees=self.tree_shading, scalars=self.decorators.scalars)
        for known, known_coloring, decorated in self._drawn:
            if known is field and known_coloring == coloring:
                return decorated
        decorated = self.values.decorate(field, coloring)
        self._drawn = [*self._drawn[-1:], (field, coloring, decorated)]
        return decorated

    def shown(self) -> SurfaceField | None:
        """The numbers that the display asks for; None for plain geometry."""
        if self.result is None or self.field is None:
            return None
        look = self.display
        if look.quantity is Quantity.INSPECTION:
            return self.inspection
        field = self.drawn(self.field)
        key = (self.result, field, self.other, look.quantity, look.column, look.short_share, look.curve)
        known = self._shown[0]
        # By identity: comparing results by value would compare their arrays.
        if (
            len(known) != len(key)
            or any(a is not b and a != b for a, b in zip(known[3:], key[3:], strict=True))
            or any(a is not b for a, b in zip(known[:3], key[:3], strict=True))
        ):
            self._shown = (key, shown_field(look, self.result, field, self.other))
        return self._shown[1]

    def other_mapping(self) -> MappingKind:
        """The mapping that the result was not baked with."""
        own = self.result.settings.mapping if self.result is not None else MappingKind.LEAST_SQUARES
        return MappingKind.AVERAGE if own is MappingKind.LEAST_SQUARES else MappingKind.LEAST_SQUARES

    def face_visible(self) -> BoolArray | None:
        """Faces of visible objects, shape (m,), bool; None if all are."""
        if self.world is None:
            return None
        drawn = self.visible & ~self.absent()
        return None if drawn.all() else drawn[np.asarray(self.world.face_object)]

    def absent(self) -> BoolArray:
        """Objects in view that the scene no longer has, or has for nothing, shape (o,), bool."""
        world, current = self.world, self.current
        if world is None or current is None or current.scene is None:
            return np.zeros(len(self.visible), bool)
        rows = zip(world.object_paths, world.object_roles, strict=True)
        return np.array([path in current.gone or _left_out(current, path, role) for path, role in rows], bool)

    def object_bounds(self, index: int) -> tuple[Float64Array, Float64Array] | None:
        """Corners of an object's box, metres from the world's origin; None if it has no vertices."""
        return self.bounds_of((index,))

    def bounds_of(self, indices: Iterable[int]) -> tuple[Float64Array, Float64Array] | None:
        """Corners of the box around some objects, metres from the world's origin; None if they have no vertices."""
        boxes = self.object_boxes(indices)
        return (boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)) if len(boxes) else None

    def object_boxes(self, indices: Iterable[int]) -> Float64Array:
        """Corners of the boxes of some objects, shape (k, 2, 3), metres from the world's origin.

        Objects without vertices, and indices that are none, are left out.
        """
        world = self.world
        if world is None:
            return np.zeros((0, 2, 3))
        chosen = [index for index in indices if 0 <= index < world.object_count]
        boxes = self._boxes.of(world)[chosen]
        return boxes[np.isfinite(boxes[:, 0, 0])]


def default_result_folder(scene: Path, cache: Path) -> Path:
    """Where the window bakes a scene to, unless told otherwise: one folder a scene under the user's cache."""
    key = hashlib.sha256(str(scene.resolve()).encode()).hexdigest()[:12]
    return cache / "results" / f"{scene.stem}-{key}"


def _left_out(current: SceneState, path: str, baked: Role) -> bool:
    return baked is not Role.IGNORE and current.role_of(path, baked) is Role.IGNORE


def _same_geometry(a: World, b: World) -> bool:
    return a is b or (
        a.object_hash == b.object_hash
        and a.object_paths == b.object_paths
        and a.positions.shape == b.positions.shape
        and a.faces.shape == b.faces.shape
        and np.array_equal(a.positions, b.positions)
        and np.array_equal(a.faces, b.faces)
    )
