"""The engine process's side of rebakes: a session that stays between jobs, the values on the way, the stored result."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Generator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from app.engine_protocol import RebakeJob, RebakeLayout, RebakeValues
from bake.settings import BakeSettings
from bake.types import BakeResult, Int64Array, Progress, Scene, World

if TYPE_CHECKING:
    from bake.rebake.session import RebakeSession
    from bake.rebake.types import Partial, RebakeOutcome, RebakeReport
    from bake.scene.load import SceneReader
    from bake.solve.update import FieldKeeper

Step = Progress | RebakeLayout | RebakeValues

PICTURE_SECONDS = 0.25
"""Shortest time between two sets of values of a rebake, but for the last."""


@dataclasses.dataclass(frozen=True, slots=True)
class Rebaked:
    """What came of a job.

    Attributes:
        report: What was done; None if the job only prepared.
        seconds: Until the values were final, and until they were stored.
    """

    report: RebakeReport | None
    seconds: tuple[float, float]


class RebakeKeeper:
    """Serves rebakes of one result at a time; what it has built up for one serves the next.

    A job may be stopped at any step but while it stores. Stopped after its values were final, it has them all the same,
    and tells them to the window at the beginning of the next job.
    """

    def __init__(self) -> None:
        self._folder = ""
        self._session: RebakeSession | None = None
        self._reader: SceneReader | None = None
        self._known: set[str] = set()  # manifests that say nothing else than what the session knows
        self._told: tuple[BakeResult, str] | None = None  # what the window knows the values of, as it is stored

    def run(self, job: RebakeJob) -> Generator[Step, None, Rebaked]:
        """Rebakes, and stores the result.

        Yields:
            Progress, how vertices are numbered, and values.

        Raises:
            ObscuraError: the result, the scene or its settings cannot be used, the device failed, or the result could
                not be stored. What was stored stays.
        """
        from bake.results import save_result
        from bake.stages import patiently

        begin, began = time.perf_counter(), time.monotonic()
        (session, scene), _ = yield from patiently("load", lambda: self._ready(job))
        moments = (began, time.monotonic())
        if job.prepare:
            yield from session.prepare()
            ready = time.perf_counter() - begin
            return Rebaked(None, (ready, ready))
        before, told = session.result, self._told
        if told is None or told[0] is not before or told[1] != _checksum(Path(job.result)):
            yield _layout(job, before.world)
            yield _all_values(job, before)
        settings = BakeSettings.from_options(job.options)
        self._told = None
        try:
            outcome = yield from self._rebaked(job, session, scene, settings, moments)
        finally:
            if session.result is before:
                self._told = told
        final = time.perf_counter() - begin
        yield Progress("store", 0, 0, final)
        # Here and not aside: stopped meanwhile, it would be stored all the same, and nobody would be told.
        save_result(outcome.result, Path(job.result))
        checksum = _checksum(Path(job.result))
        self._known.add(checksum)
        self._told = (outcome.result, checksum)
        return Rebaked(outcome.report, (final, time.perf_counter() - begin))

    def kept(self, folder: str) -> tuple[BakeResult, FieldKeeper] | None:
        """The result stored in a folder, with what follows its values, if both are at hand."""
        session, told = self._session, self._told
        if session is None or self._folder != folder or told is None or told[0] is not session.result:
            return None
        keeper = session.keeper
        return None if keeper is None or told[1] != _checksum(Path(folder)) else (session.result, keeper)

    def close(self) -> None:
        """Frees what is kept."""
        if self._session is not None:
            self._session.close()
        self._session = self._reader = self._told = None
        self._folder = ""

    def _ready(self, job: RebakeJob) -> tuple[RebakeSession, Scene]:
        from bake.devices import resolve
        from bake.rebake.session import RebakeSession
        from bake.results import load_result
        from bake.scene.load import SceneReader

        folder, scene_path = Path(job.result), Path(job.scene)
        settings = BakeSettings.from_options(job.options)
        checksum = _checksum(folder)
        if self._reader is None or self._reader.path != scene_path:
            self._reader = SceneReader(scene_path)
        if self._session is None or self._folder != job.result or checksum not in self._known:
            reader = self._reader
            self.close()
            self._reader = reader
            scene = reader.read(crease_angle=settings.crease_angle)
            result = load_result(folder, verify=False)
            self._session = RebakeSession(result, scene, resolve(settings.device), bound=job.bound)
            self._folder, self._known, self._told = job.result, {checksum}, (result, checksum)
            return self._session, scene
        return self._session, self._reader.read(crease_angle=settings.crease_angle)

    def _rebaked(
        self,
        job: RebakeJob,
        session: RebakeSession,
        scene: Scene,
        settings: BakeSettings,
        moments: tuple[float, float],
    ) -> Generator[Step, None, RebakeOutcome]:
        from bake.rebake.types import Partial

        layout = _scene_layout(job, scene, session.result.world, ground=settings.ground is not None)
        yield dataclasses.replace(layout, moments=moments)
        objects = None if job.objects is None else frozenset(job.objects)
        faces = _faces_of(job, scene)
        first = lambda: _in_view(job, session.result.world)  # noqa: E731
        steps = session.rebake(scene, settings, objects=objects, faces=faces, first=first)
        waiting: list[Partial] = []
        sent = 0.0
        try:
            while True:
                step = next(steps)
                if not isinstance(step, Partial):
                    yield step
                    continue
                waiting.append(step)
                # A picture takes its time: what comes quickly one after the other is shown together.
                if step.final or time.monotonic() - sent >= PICTURE_SECONDS:
                    yield _values(job, [step] if step.final else waiting)
                    waiting, sent = [], time.monotonic()
        except StopIteration as end:
            return end.value
        finally:
            steps.close()


def _values(job: RebakeJob, parts: Sequence[Partial]) -> RebakeValues:
    """Several partial values as one: of what comes more than once, the last."""
    last = parts[-1]
    vertices, ao = last.vertices, last.ao
    if len(parts) > 1:
        joined = np.concatenate([part.vertices for part in reversed(parts)])
        vertices, place = np.unique(joined, return_index=True)
        ao = np.concatenate([part.ao for part in reversed(parts)])[place]
    rays = last.rays_done, last.rays_total
    return RebakeValues(job.id, vertices.astype(np.int32), ao, *rays, last.final, time.monotonic())


def _all_values(job: RebakeJob, result: BakeResult) -> RebakeValues:
    count = result.world.vertex_count
    return RebakeValues(job.id, np.arange(count, dtype=np.int32), np.asarray(result.field.ao), 0, 0, final=False)


def _layout(job: RebakeJob, world: World) -> RebakeLayout:
    return RebakeLayout(job.id, world.object_paths, np.asarray(world.first_vertex))


def _scene_layout(job: RebakeJob, scene: Scene, before: World, *, ground: bool) -> RebakeLayout:
    """How the world that the scene will be flattened to numbers its vertices."""
    counts = [len(scene.meshes[item.mesh].positions) for item in scene.objects]
    paths = tuple(item.path for item in scene.objects)
    if ground:
        counts, paths = [*counts, 4], (*paths, before.object_paths[-1])
    return RebakeLayout(job.id, paths, np.concatenate(([0], np.cumsum(counts, dtype=np.int64))))


def _faces_of(job: RebakeJob, scene: Scene) -> Int64Array | None:
    """The chosen triangles as the world that the scene will be flattened to numbers them."""
    if job.faces is None:
        return None
    counts = [len(scene.meshes[item.mesh].faces) for item in scene.objects]
    begins = dict(zip((item.path for item in scene.objects), np.cumsum([0, *counts]).tolist(), strict=False))
    sizes = dict(zip((item.path for item in scene.objects), counts, strict=True))
    found = [
        begins[path] + own[own < sizes[path]].astype(np.int64) for path, own in job.faces.items() if path in begins
    ]
    return np.sort(np.concatenate([np.zeros(0, np.int64), *found]))


def _in_view(job: RebakeJob, world: World) -> Int64Array:
    """Vertices inside the picture, before the edit; they are numbered alike after it unless objects came or went."""
    if job.camera is None:
        return np.zeros(0, np.int64)
    matrix = np.asarray(job.camera).reshape(4, 4)
    clip = np.asarray(world.positions) @ matrix[:, :3].T + matrix[:, 3]
    inside = (clip[:, 3] > 0.0) & (np.abs(clip[:, :2]) <= clip[:, 3:]).all(axis=1)
    return np.flatnonzero(inside)


def _checksum(folder: Path) -> str:
    import hashlib

    from bake.results.manifest import MANIFEST_FILE

    try:
        return hashlib.sha256((folder / MANIFEST_FILE).read_bytes()).hexdigest()
    except OSError:
        return ""
