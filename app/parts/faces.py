"""Choosing triangles in the view, to rebake these alone."""

from __future__ import annotations

import logging
from collections import deque

import numpy as np

from app.actions import Action, ActionSpec
from app.face_group import FaceGroup
from app.face_tool import FaceTool, Outline
from app.latest_job import LatestJob, Work
from app.parts.availability import AvailabilityPart
from app.parts.rebake import RebakePart
from app.region_part import RegionsPart
from app.region_state import RegionState, Tool
from app.undo_step import Step
from app.viewport import Shapes
from app.window_parts import Part, Workbench
from bake.errors import ObscuraError
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array, UInt8Array, World
from viewer.chosen_faces import carried_choice, chosen_shapes
from viewer.picture import picture_matrix
from viewer.seen_faces import FacesInPicture

_NAME = "chosen faces"
_MOVE = "move-tool"
_KIND = 2
"""Of steps of the undo stack: choices that follow each other quickly are one."""
_RADIUS_STEP = 1.25

logger = logging.getLogger(__name__)


class FacesPart(Part):
    """The tools that choose triangles, their marks, and the rebake of what is chosen; every choice can be undone."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.group = FaceGroup()
        self.tool = FaceTool(bench.area.main, self._choose, click=self._click, ended=self._finish)
        self.chosen: BoolArray = np.zeros(0, bool)
        self._world: World | None = None
        self._kept: UInt8Array = np.zeros(0, np.uint8)  # what the last step of the undo stack left
        self._waiting: deque[tuple[Float64Array, Float64Array, int]] = deque()
        self._picture: tuple[tuple[object, ...], FacesInPicture, tuple[object, ...]] | None = None
        self._busy = self._ended = False
        self._marks = LatestJob(bench.jobs, "chosen faces", self._prepare_marks, self._show_marks, _warn)

    def actions(self) -> list[Action]:
        """The tools, letting go, and the rebake."""
        # Before anything is connected: what is needed has to be known when the actions are first greyed.
        self.bench.part(AvailabilityPart).add("faces", lambda: bool(self.chosen.any()), "choose triangles first")
        menu = "Edit/Choose triangles"
        tips = {
            Outline.BOX: "Drag a box in the view; Shift adds what is seen in it, Ctrl takes it away",
            Outline.LASSO: "Draw around them in the view; Shift adds what is seen inside, Ctrl takes it away",
            Outline.BRUSH: "Paint over them in the view; Shift adds, Ctrl takes away",
        }
        return [
            *[
                (
                    ActionSpec(
                        f"faces-{outline.value}", menu, f"By &{outline.value}", tip,
                        checkable=True, group=5, needs=("scene",),
                    ),
                    lambda on, outline=outline: self.switch(outline if on else None),
                )
                for outline, tip in tips.items()
            ],
            (
                ActionSpec(
                    "faces-wider", menu, "&Wider brush", "A brush of a larger radius", ("Alt+.",), group=6,
                ),
                lambda: self.set_radius(self.tool.radius * _RADIUS_STEP),
            ),
            (
                ActionSpec(
                    "faces-narrower", menu, "&Narrower brush", "A brush of a smaller radius", ("Alt+,",), group=6,
                ),
                lambda: self.set_radius(self.tool.radius / _RADIUS_STEP),
            ),
            (
                ActionSpec(
                    "faces-objects", menu, "All of the &selected objects", "Choose every triangle of what is selected",
                    group=7, needs=("selection",),
                ),
                self.choose_selected,
            ),
            (
                ActionSpec(
                    "faces-none", menu, "Choose n&one", "Let go of all triangles", group=7, needs=("faces",),
                ),
                self.clear,
            ),
            (
                ActionSpec(
                    "rebake-faces", "Bake", "Rebake chosen &triangles",
                    "Only values at the chosen triangles may change", group=1, needs=("result", "scene-file", "faces"),
                ),
                self.rebake,
            ),
        ]  # fmt: skip

    def connect(self) -> None:
        """Follows the world in view, and puts the tool away when another one is taken."""
        bench, document, registry, group = self.bench, self.bench.document, self.bench.registry, self.group
        group.add_tools([registry[f"faces-{one.value}"] for one in Outline], ("Box", "Lasso", "Brush"))
        names = ("rebake-faces", "faces-none")
        group.add_buttons([registry[name] for name in names], ("Rebake these", "None"))
        group.radius.setValue(round(self.tool.radius))
        group.radius_set.connect(self.tool.set_radius)
        bench.part(RebakePart).panel.add_group(group)
        document.world_changed.connect(self._on_world)
        document.opened.connect(self._on_opened)
        document.geometry_changed.connect(self._marks.request)
        registry[_MOVE].toggled.connect(lambda on: self.switch(None) if on else None)
        self._regions.tool_changed.connect(self._on_region_tool)
        self._on_world()

    def escape(self) -> bool:
        """Drops the outline that is being drawn, or puts the tool away."""
        if self.tool.is_dragging:
            self.tool.give_up()
            return True
        was_out = self.tool.outline is not None
        self.switch(None)
        return was_out

    # What the user asks for

    def switch(self, outline: Outline | None) -> None:
        """Takes a tool out, and puts others away; None puts it away."""
        registry = self.bench.registry
        if outline is not None:
            self._regions.set_tool(Tool.NONE)
            if registry[_MOVE].isChecked():
                registry[_MOVE].trigger()
        self.tool.switch(outline)
        for other in Outline:
            registry[f"faces-{other.value}"].setChecked(other is outline)

    def set_radius(self, pixels: float) -> None:
        """Gives the brush another radius."""
        self.group.radius.setValue(round(pixels))

    def choose_selected(self) -> None:
        """Chooses the triangles of the selected objects, and no others."""
        world = self.bench.document.world
        if world is not None and len(self.chosen) == world.face_count:
            picked = np.zeros(world.object_count, bool)
            picked[list(self.bench.document.selection)] = True
            self._set(picked[np.asarray(world.face_object)])
            self._keep()

    def clear(self) -> None:
        """Lets go of all triangles."""
        self._waiting.clear()
        self._set(np.zeros_like(self.chosen))
        self._keep()

    def by_object(self) -> dict[str, Int32Array]:
        """The chosen triangles, numbered within their objects, by path."""
        world = self.bench.document.world
        numbers = np.flatnonzero(self.chosen)
        if world is None or not len(numbers):
            return {}
        owners = np.asarray(world.face_object)[numbers]
        return {
            world.object_paths[owner]: (numbers[owners == owner] - world.first_face[owner]).astype(np.int32)
            for owner in np.unique(owners).tolist()
        }

    def rebake(self) -> None:
        """Rebakes the chosen triangles alone."""
        faces = self.by_object()
        if not faces:
            text = "Choose triangles first: Edit › Choose triangles."
            self.bench.banner.show_message(logging.INFO, text)
            return
        self.bench.part(RebakePart).rebake(faces=faces)

    # What the tool says

    def _choose(self, outline: Float64Array, sign: int) -> None:
        viewport = self.bench.area.main
        matrix = np.array(picture_matrix(viewport.camera, viewport.view.aspect)).reshape(4, 4)
        self._waiting.append((outline, matrix, sign))
        self._next()

    def _click(self, face: int, sign: int) -> None:
        chosen = self.chosen.copy() if sign else np.zeros_like(self.chosen)
        if 0 <= face < len(chosen):
            chosen[face] = sign >= 0
        self._set(chosen)

    def _finish(self) -> None:
        """A drag has ended: once all that it chose is found, it is a step."""
        self._ended = True
        self._next()

    def _next(self) -> None:
        document = self.bench.document
        world = document.world
        if self._busy or world is None:
            return
        if not self._waiting:
            if self._ended:
                self._ended = False
                self._keep()
            return
        strokes = [self._waiting.popleft()]
        while self._waiting and np.array_equal(self._waiting[0][1], strokes[0][1]):
            strokes.append(self._waiting.popleft())
        positions, faces, drawn = np.asarray(world.positions), np.asarray(world.faces), document.face_visible()
        front_only, hidden = self.group.front.isChecked(), self.group.hidden.isChecked()
        matrix, held = strokes[0][1], (world, document.visible, document.current)
        key = (*map(id, held), matrix.tobytes(), front_only)
        known = self._picture[1] if self._picture is not None and self._picture[0] == key else None

        def work() -> tuple[FacesInPicture, list[Int64Array]]:
            picture = known or FacesInPicture(positions, faces, drawn, matrix, front_only=front_only)
            return picture, [picture.inside(outline, hidden=hidden) for outline, _, _ in strokes]

        def take(found: tuple[FacesInPicture, list[Int64Array]]) -> None:
            self._busy = False
            self._picture = (key, found[0], held)
            if self.bench.document.world is not None and len(self.chosen) == len(faces):
                chosen = self.chosen.copy()
                for numbers, (_, _, sign) in zip(found[1], strokes, strict=True):
                    if sign == 0:
                        chosen[:] = False
                    chosen[numbers] = sign >= 0
                self._set(chosen)
            self._next()

        self._busy = True
        self.bench.jobs.run("seen faces", work, take, self._on_error)

    def _on_error(self, error: ObscuraError) -> None:
        self._busy = False
        _warn(error)

    # The choice

    def _set(self, chosen: BoolArray) -> None:
        changed = bool(chosen.any()) != bool(self.chosen.any())
        self.chosen = chosen
        self._marks.request()
        if changed:
            self.bench.part(AvailabilityPart).refresh()

    def _keep(self) -> None:
        """Makes what is chosen now a step that can be undone."""
        before, after = self._kept, np.packbits(self.chosen)
        if np.array_equal(before, after):
            return
        self._kept, count = after, len(self.chosen)
        number = int(self.chosen.sum())
        text = f"choose {number:,} triangle{'s' if number > 1 else ''}" if number else "choose no triangles"
        restore = self._restore
        self.bench.undo.push(
            Step(text, redo=lambda: restore(after, count), undo=lambda: restore(before, count), done=True, kind=_KIND)
        )

    def _restore(self, bits: UInt8Array, count: int) -> None:
        if len(self.chosen) == count:
            self._kept = bits
            self._set(np.unpackbits(bits, count=count).astype(bool))

    def _on_opened(self) -> None:
        """Another scene may have objects of the same paths."""
        self.switch(None)
        self._world = None

    def _on_world(self) -> None:
        """Keeps what is chosen of objects that are there still, with as many triangles."""
        before, self._world = self._world, self.bench.document.world
        self._waiting.clear()
        self._picture = None
        if self._world is None:
            chosen = np.zeros(0, bool)
        elif before is None or len(self.chosen) != before.face_count:
            chosen = np.zeros(self._world.face_count, bool)
        else:
            chosen = carried_choice(before, self.chosen, self._world)
        self._set(chosen)
        self._kept = np.packbits(chosen)

    def _prepare_marks(self) -> Work | None:
        world, chosen = self.bench.document.world, self.chosen
        if world is None or len(chosen) != world.face_count or not chosen.any():
            self._show_marks((None, 0, 0))
            return None
        positions, faces = np.asarray(world.positions), np.asarray(world.faces)
        owners = np.asarray(world.face_object)

        def work() -> tuple[Shapes | None, int, int]:
            return chosen_shapes(positions, faces, chosen), int(chosen.sum()), len(np.unique(owners[chosen]))

        return work

    def _show_marks(self, found: tuple[Shapes | None, int, int]) -> None:
        shapes, count, objects = found
        if shapes is not None and not self.chosen.any():
            return  # let go of in the meantime
        for viewport in self.bench.area.viewports:
            viewport.set_shapes(_NAME, shapes, opacity=0.45, in_front=False)
        self.group.show_chosen(count, objects)

    @property
    def _regions(self) -> RegionState:
        return self.bench.part(RegionsPart).state

    def _on_region_tool(self) -> None:
        if self._regions.tool is not Tool.NONE:
            self.switch(None)


def _warn(error: ObscuraError) -> None:
    logger.warning("%s", error)
