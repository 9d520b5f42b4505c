"""Asks the engine for rebakes, shows their values as they come, and takes the result over at the end."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from PyQt6.QtCore import QObject, pyqtSignal

from app.document import Document
from app.engine import Engine
from app.engine_protocol import Job, RebakeDone, RebakeJob, RebakeLayout, RebakeValues
from bake.errors import ObscuraError
from bake.settings import BakeSettings
from bake.types import BakeResult, Int32Array, Int64Array, Progress, VertexField, VertexState, World

NOTE = "being rebaked …"
logger = logging.getLogger(__name__)


@dataclass(slots=True)
class Timing:
    """When a rebake showed what, in seconds after it was asked for; below 0 while it has not.

    Attributes:
        begun: The engine began.
        read: It had read the scene.
        sent: It had sent the first values.
        first: Its first values.
        final: Its final values.
        stored: Its stored result.
    """

    begun: float = -1.0
    read: float = -1.0
    sent: float = -1.0
    first: float = -1.0
    final: float = -1.0
    stored: float = -1.0


class Rebaker(QObject):
    """One rebake at a time; the next one takes its place at once.

    Args:
        document: What is open. Its field shows the values on the way; stopped half-way it shows again what it did.
        engine: Does the work.
        parent: Qt parent.
    """

    began = pyqtSignal()
    told = pyqtSignal(object)  # Progress
    shown = pyqtSignal(object)  # RebakeValues that are in view now
    done = pyqtSignal(object)  # RebakeDone; the result lies in its folder
    ended = pyqtSignal(bool)  # whether the result was replaced
    overtaken = pyqtSignal()  # what is stored may be a newer result than that in view

    def __init__(self, document: Document, engine: Engine, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._document, self._engine = document, engine
        self._job = self._given_up = 0
        self._prepared: BakeResult | None = None
        self._asked = 0.0
        self._place: Int64Array | None = None  # of each vertex as the values number them: that in view, or -1
        self._layout: RebakeLayout | None = None
        self._world: World | None = None
        self._field: VertexField | None = None  # what is in view, and grows better
        self.timing = Timing()
        engine.rebake_told.connect(self._on_told)
        engine.rebake_finished.connect(self._on_finished)
        engine.failed.connect(self._on_failed)
        engine.cancelled.connect(self._on_cancelled)
        engine.crashed.connect(lambda _text: self._on_crashed())

    @property
    def is_busy(self) -> bool:
        """Whether one is under way."""
        return self._job > 0

    def request(
        self,
        settings: BakeSettings,
        *,
        objects: Iterable[str] | None = None,
        faces: Mapping[str, Int32Array] | None = None,
        camera: tuple[float, ...] | None = None,
    ) -> None:
        """Rebakes what is open, in place of the rebake under way.

        Args:
            settings: As wanted now.
            objects: Paths of the objects whose values may change; None for all.
            faces: The same by triangles; see `RebakeJob`.
            camera: See `RebakeJob`.
        """
        document = self._document
        scene, folder = document.scene_path, document.result_path
        if scene is None or folder is None or document.result is None:
            return
        chosen = None if objects is None else tuple(objects)
        self._field = None  # the first values start from what is stored, not from those of a rebake that was stopped
        self._asked, self.timing = time.monotonic(), Timing()
        self._layout = self._place = None
        self._job = self._engine.rebake(scene, folder, settings, objects=chosen, faces=faces, camera=camera)
        self.began.emit()

    def prepare(self, settings: BakeSettings) -> None:
        """Lets the engine build what rebakes of the result in view need, so that the first one is fast too."""
        document = self._document
        if self._job or document.scene_path is None or document.result_path is None or document.result is None:
            return
        if self._prepared is not document.result and not self._engine.is_baking:
            self._prepared = document.result
            self._engine.rebake(document.scene_path, document.result_path, settings, prepare=True)

    def cancel(self) -> None:
        """Stops the rebake under way; what was in view before comes back."""
        if self._job:
            self._given_up = self._job
            self._engine.cancel_rebake()
            self._stop()

    # What the engine says

    def _on_told(self, job: RebakeJob, said: object) -> None:
        if job.id != self._job:
            return
        if isinstance(said, RebakeLayout):
            self._layout, self._place = said, None
            if said.moments[0] > 0.0:
                self.timing.begun, self.timing.read = (moment - self._asked for moment in said.moments)
        elif isinstance(said, RebakeValues):
            self._show(said)
        elif isinstance(said, Progress):
            self.told.emit(said)

    def _show(self, values: RebakeValues) -> None:
        document, result = self._document, self._document.result
        if result is None or document.world is None or self._layout is None:
            return
        if self._place is None or self._world is not document.world:
            self._place, self._world = _places(self._layout, document.world), document.world
        field = self._field
        if field is None or len(field.state) != len(result.field.state):
            field = VertexField(np.array(result.field.ao), np.array(result.field.state), result.field.report)
        place = self._place[values.vertices]
        known = place >= 0
        fresh = field.ao.copy()
        fresh[place[known]] = values.ao[known]
        state, own = field.state.copy(), place[known]
        has = np.isfinite(fresh[own]).all(axis=1)
        had = np.isin(state[own], (VertexState.BAKED, VertexState.FILLED))
        state[own[has & ~had]], state[own[had & ~has]] = VertexState.BAKED, VertexState.NOT_BAKED
        self._field = replace(field, ao=fresh, state=state)
        document.set_field(self._field, NOTE)
        now = time.monotonic() - self._asked
        if values.rays_total or values.final:
            if self.timing.first < 0.0:
                self.timing.first, self.timing.sent = now, values.moment - self._asked
            if values.final:
                self.timing.final = now
        self.shown.emit(values)

    def _on_finished(self, job: RebakeJob, done: RebakeDone) -> None:
        if job.id == self._job:
            self._job = 0
            self.timing.stored = time.monotonic() - self._asked
            self._field = None
            self.done.emit(done)  # its listeners take the result over, which needs no preparing
        elif done.report is not None and not self._job and job.result == str(self._document.result_path):
            self.overtaken.emit()  # it was stopped too late

    def _on_failed(self, job: Job, _error: ObscuraError) -> None:
        if isinstance(job, RebakeJob) and job.id == self._job:
            self._stop()  # the controller says why

    def _on_cancelled(self, job: Job) -> None:
        if isinstance(job, RebakeJob) and job.id == self._job:
            self._stop()

    def _on_crashed(self) -> None:
        """The process may have died after it had stored the result, and before it could say so."""
        unheard = self._job or self._given_up
        self._given_up = 0
        self._stop()
        if unheard:
            self.overtaken.emit()

    def _stop(self) -> None:
        if not self._job:
            return
        self._job = 0
        self._field = None
        result = self._document.result
        if result is not None and self._document.is_preview and self._document.field_note == NOTE:
            self._document.set_field(result.field)
        self.ended.emit(False)


def _places(layout: RebakeLayout, world: World) -> Int64Array:
    """Where the vertices of a layout are in the world in view, by their objects' paths; -1 where they are not."""
    count = int(layout.first_vertex[-1])
    if layout.paths == world.object_paths and np.array_equal(layout.first_vertex, world.first_vertex):
        return np.arange(count, dtype=np.int64)
    shown: dict[str, Any] = {path: index for index, path in enumerate(world.object_paths)}
    sizes, shown_sizes = np.diff(layout.first_vertex), np.diff(world.first_vertex)
    index = np.array([shown.get(path, -1) for path in layout.paths], np.int64)
    fits = (index >= 0) & (shown_sizes[index] == sizes)
    shift = np.where(fits, np.asarray(world.first_vertex)[index] - layout.first_vertex[:-1], 0)
    places = np.arange(count, dtype=np.int64) + np.repeat(shift, sizes)
    places[~np.repeat(fits, sizes)] = -1
    return places
