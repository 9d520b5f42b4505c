"""Choosing triangles in the view, to rebake these alone."""

from __future__ import annotations

import logging
from collections import deque

import numpy as np

from app.actions import Action, ActionSpec
from app.face_tool import FaceTool, Outline
from app.parts.rebake import RebakePart
from app.window_parts import Part, Workbench
from bake.errors import ObscuraError
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array
from viewer.picture import picture_matrix

_NAME = "chosen faces"
_COLOR = (255, 176, 32)

logger = logging.getLogger(__name__)


class FacesPart(Part):
    """The tools that choose triangles, their marks, and the rebake of what is chosen."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.tool = FaceTool(bench.area.main, self._choose)
        self.chosen: BoolArray = np.zeros(0, bool)
        self._waiting: deque[tuple[Float64Array, Float64Array, int]] = deque()
        self._busy = False

    def actions(self) -> list[Action]:
        """The tools, letting go, and the rebake."""
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
            (ActionSpec("faces-none", menu, "Choose &none", "Let go of all triangles", group=5), self.clear),
            (
                ActionSpec(
                    "rebake-faces", "Bake", "Rebake chosen &triangles",
                    "Only values at the chosen triangles may change", group=1, needs=("result", "scene-file"),
                ),
                self.rebake,
            ),
        ]  # fmt: skip

    def connect(self) -> None:
        """Follows the world in view."""
        document = self.bench.document
        document.world_changed.connect(self.clear)
        document.geometry_changed.connect(self._draw)

    def escape(self) -> bool:
        """Puts the tool away."""
        was_out = self.tool.outline is not None
        self.switch(None)
        return was_out

    def switch(self, outline: Outline | None) -> None:
        """Takes a tool out; None puts it away."""
        self.tool.switch(outline)
        for other in Outline:
            self.bench.registry[f"faces-{other.value}"].setChecked(other is outline)

    def clear(self) -> None:
        """Lets go of all triangles."""
        world = self.bench.document.world
        self.chosen = np.zeros(0 if world is None else world.face_count, bool)
        self._waiting.clear()
        self._draw()

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

    def _choose(self, outline: Float64Array, sign: int) -> None:
        viewport = self.bench.area.main
        matrix = np.array(picture_matrix(viewport.camera, viewport.view.aspect)).reshape(4, 4)
        self._waiting.append((outline, matrix, sign))
        self._next()

    def _next(self) -> None:
        document = self.bench.document
        world = document.world
        if self._busy or not self._waiting or world is None:
            return
        outline, matrix, sign = self._waiting.popleft()
        positions, faces, drawn = np.asarray(world.positions), np.asarray(world.faces), document.face_visible()
        front_only = not document.display.back_faces

        def work() -> Int64Array:
            from viewer.seen_faces import seen_faces

            return seen_faces(positions, faces, drawn, matrix, outline, front_only=front_only)

        self._busy = True
        self.bench.jobs.run("seen faces", work, lambda found: self._take(found, sign, len(faces)), self._on_error)

    def _take(self, found: Int64Array, sign: int, count: int) -> None:
        self._busy = False
        if len(self.chosen) == count:
            if sign == 0:
                self.chosen[:] = False
            self.chosen[found] = sign >= 0
            self._draw()
        self._next()

    def _on_error(self, error: ObscuraError) -> None:
        self._busy = False
        logger.warning("%s", error)
        self._next()

    def _draw(self) -> None:
        world = self.bench.document.world
        shapes = None
        if world is not None and len(self.chosen) == world.face_count and self.chosen.any():
            used, corners = np.unique(np.asarray(world.faces)[self.chosen], return_inverse=True)
            positions = np.asarray(world.positions)[used].astype(np.float32)
            colors = np.tile(np.array(_COLOR, np.uint8), (len(used), 1))
            shapes = (positions, corners.reshape(-1, 3).astype(np.int32), colors)
        for viewport in self.bench.area.viewports:
            viewport.set_shapes(_NAME, shapes, opacity=0.45)
