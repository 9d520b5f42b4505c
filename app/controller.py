"""What happens when: opening, baking, cancelling, re-solving. Joins document, engine and worker threads."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

from PyQt6.QtCore import QObject, pyqtSignal

from app.document import Document
from app.engine import Engine, EngineState
from app.engine_protocol import BakeDone, BakeJob, Job, SolveJob
from app.jobs import Jobs
from app.opening import (
    SAMPLE_LEVEL,
    OpenedResult,
    OpenedScene,
    copy_result,
    read_own_result,
    read_result,
    read_scene,
)
from app.scene_preview import padded_field
from app.turns import Turns
from bake.errors import ObscuraError
from bake.settings import BakeSettings
from bake.types import Progress, VertexField

THRESHOLD, OTHER_MAPPING, ALPHA = "threshold", "other mapping", "alpha"

logger = logging.getLogger(__name__)


class Controller(QObject):
    """The only one that changes the document for reasons other than a click in a panel.

    Args:
        document: What is open.
        engine: Where bakes run.
        cache: Folder for the window's own results.
        parent: Qt parent.
    """

    message = pyqtSignal(int, str)  # logging level, text for the banner
    busy = pyqtSignal(str)  # what began, empty when nothing is under way
    baking = pyqtSignal(bool)
    progressed = pyqtSignal(object, float)  # Progress, memory in MB
    cancelling = pyqtSignal()
    solving = pyqtSignal(str, bool)  # purpose, whether it is under way
    scene_opened = pyqtSignal(object)  # Path
    result_saved = pyqtSignal(object)  # Path
    about_to_bake = pyqtSignal(object)  # Path of the result that may be replaced
    bake_ended = pyqtSignal(bool)  # whether another result than before is in view

    def __init__(self, document: Document, engine: Engine, cache: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._document, self._engine, self._cache = document, engine, cache
        self._jobs, self._turns = Jobs(self), Turns(self)
        self._bake_when_open = False
        self._comparing = False
        self.up_axis = 0
        """Which way is up in files that do not say: 1 or 2, or 0 to guess."""
        self._solved_threshold: float | None = None
        self._wanted_alpha: float | None = None
        engine.progressed.connect(self._on_progress)
        engine.bake_finished.connect(self._on_baked)
        engine.solve_finished.connect(self._on_solved)
        engine.failed.connect(self._on_failed)
        engine.cancelled.connect(self._on_cancelled)
        engine.crashed.connect(self._on_crashed)
        engine.state_changed.connect(self._on_state)

    def open(self, path: Path | None) -> None:
        """Opens a scene file, a result folder, or the sample level."""
        if path is None:
            self._open_sample()
        elif path.is_dir():
            self.open_result(path)
        else:
            self.open_scene(path)

    def open_scene(self, path: Path, *, bake: bool = False) -> None:
        """Opens a scene; `bake` starts a bake if there is no current result."""
        self._bake_when_open = bake
        self.busy.emit(f"Opening {path.name}")
        self._jobs.drop("open result")
        self._jobs.run(
            "open scene", lambda: read_scene(path, self._cache, up_axis=self.up_axis), self._on_scene, self._on_error
        )

    def open_result(self, path: Path, *, verify: bool = True) -> None:
        """Opens a result folder."""
        self.busy.emit(f"Opening {path.name}")
        self._jobs.drop("open scene")
        self._jobs.run(
            "open result",
            lambda: read_result(path, verify=verify, up_axis=self.up_axis),
            self._on_result,
            self._on_error,
        )

    def save_result_as(self, target: Path) -> None:
        """Copies the result in view to a folder."""
        source = self._document.result_path
        if self._document.result is None or source is None:
            return
        self.busy.emit(f"Saving to {target.name}")
        self._jobs.run("save result", lambda: copy_result(source, target), self._on_saved, self._on_error)

    def bake(self, settings: BakeSettings) -> None:
        """Starts a bake of what is open."""
        scene, result = self._document.scene_path, self._document.result_path
        if scene is None or result is None or self._engine.is_baking:
            return
        try:
            result.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            self.message.emit(logging.ERROR, f"{result.parent}: cannot be created ({error.strerror})")
            return
        self.about_to_bake.emit(result)
        self._engine.bake(scene, result, settings)
        self.busy.emit("Starting the engine" if self._engine.state is EngineState.STARTING else "Starting")
        self.baking.emit(True)
        logger.info("baking %s", scene.name)

    def cancel(self) -> None:
        """Stops the bake; the window answers at once."""
        if self._engine.is_baking:
            self.cancelling.emit()
            self._engine.cancel()

    def solve_threshold(self) -> None:
        """Solves for the vertices with the document's threshold, without tracing."""
        document = self._document
        if document.result is None or document.field is None:
            return
        if document.threshold == document.result.settings.back_face_threshold:
            if document.is_preview:
                document.set_field(document.result.field)
            self.solving.emit(THRESHOLD, False)
        else:
            self._solve(THRESHOLD, document.result.settings.replaced(back_face_threshold=document.threshold))
        if self._comparing:
            self._solve_other()

    def solve_alpha(self, alpha: float | None) -> None:
        """Solves for the vertices with another smoothing, without tracing; None shows what is stored again."""
        document = self._document
        self._wanted_alpha = alpha
        if document.result is None:
            return
        if alpha is None or alpha == document.result.settings.alpha:
            if document.is_preview:
                document.set_field(document.result.field)
            self.solving.emit(ALPHA, False)
        else:
            self._solve(ALPHA, document.result.settings.replaced(alpha=alpha, back_face_threshold=document.threshold))

    def compare(self, on: bool) -> None:
        """Computes the values of the other mapping while they are wanted."""
        self._comparing = on
        if on and (self._document.other is None or self._document.other_name):
            self._solve_other()

    def close(self) -> None:
        """Ends all work."""
        self._turns.close()
        self._jobs.close()
        self._engine.close()

    @property
    def is_idle(self) -> bool:
        """Whether nothing is under way."""
        busy = self._jobs.is_busy or self._turns.is_busy
        return not busy and self._engine.state in (EngineState.IDLE, EngineState.DOWN)

    def _open_sample(self) -> None:
        if SAMPLE_LEVEL.exists():
            self.open_scene(SAMPLE_LEVEL, bake=True)
        else:
            text = "The sample level is missing from assets/. Open a scene with Ctrl+O or drop one here."
            self.message.emit(logging.WARNING, text)

    def _on_scene(self, opened: OpenedScene) -> None:
        self._turns.add(lambda: self._begin_scene(opened), lambda: self._show_scene(opened))

    def _begin_scene(self, opened: OpenedScene) -> None:
        document = self._document
        document.scene_settings = document.side_file_settings = opened.settings
        document.open_scene(opened.path, opened.result_path, opened.files, opened.findings, opened.up_axis)
        document.reader = opened.reader

    def _show_scene(self, opened: OpenedScene) -> None:
        self._document.set_world(opened.world)
        self.scene_opened.emit(opened.path)
        logger.info(
            "opened %s: %d objects, %d triangles", opened.path, opened.world.object_count, opened.world.face_count
        )
        path, files = opened.result_path, opened.files
        self._jobs.run("open result", lambda: read_own_result(path, opened.path, files), self._on_own, self._on_error)

    def _on_own(self, opened: OpenedResult | None) -> None:
        self.busy.emit("")
        outdated = opened is not None and dict(opened.result.files) != self._document.files
        if opened is not None and not (outdated and self._bake_when_open):
            self._show(opened)
        elif self._bake_when_open:
            self.bake(self._document.scene_settings)

    def _on_result(self, opened: OpenedResult) -> None:
        self._turns.add(
            lambda: self._begin_result(opened),
            lambda: self._document.show_geometry(opened.result.world),
            lambda: self._show_result(opened),
        )

    def _begin_result(self, opened: OpenedResult) -> None:
        document, result = self._document, opened.result
        scene_path = Path(result.scene_path)
        if document.scene_path != scene_path:
            document.scene_settings, document.side_file_settings = result.settings, None
            document.open_scene(scene_path, opened.path, dict(result.files), tuple(result.findings), opened.up_axis)

    def _show_result(self, opened: OpenedResult) -> None:
        self.busy.emit("")
        self._show(opened)
        self.scene_opened.emit(opened.path)
        logger.info("opened the result %s", opened.path)

    def _show(self, opened: OpenedResult) -> None:
        self._document.set_result(opened.result, opened.path)
        if self._comparing:
            self._solve_other()

    def _on_saved(self, target: Path) -> None:
        self.busy.emit("")
        self.result_saved.emit(target)
        logger.info("saved the result to %s", target)

    def _on_error(self, error: ObscuraError) -> None:
        self.busy.emit("")
        logger.error("%s", error)
        self.message.emit(logging.ERROR, str(error))

    def _solve(self, purpose: str, settings: BakeSettings) -> None:
        document = self._document
        if document.stored is None or document.result_path is None:
            return
        world, columns = document.stored.world, document.stored.settings.distance_count
        self._engine.solve(purpose, document.result_path, settings, world.vertex_count, columns)
        self.solving.emit(purpose, True)

    def _solve_other(self) -> None:
        document = self._document
        if document.result is not None:
            settings = document.result.settings.replaced(
                mapping=document.other_mapping(), back_face_threshold=document.threshold
            )
            self._solve(OTHER_MAPPING, settings)

    def _on_progress(self, progress: Progress, memory_mb: float) -> None:
        self.progressed.emit(progress, memory_mb)

    def _on_baked(self, done: BakeDone) -> None:
        self._end_bake()
        if done.unchanged:
            self.message.emit(logging.INFO, "Nothing had changed since the stored result: nothing was traced.")
        logger.info("baked in %.1f s%s", done.seconds, ", unchanged" if done.unchanged else "")
        path = Path(done.result)
        if self._document.result_path == path:
            self.reload_result(lambda well: self.bake_ended.emit(well and not done.unchanged))
        else:
            self.bake_ended.emit(False)
            self.message.emit(logging.INFO, f"The bake that was running is done: {path}")

    def reload_result(self, then: Callable[[bool], object]) -> None:
        """Shows the result that lies where the document's own belongs, then tells `then` whether that went well."""
        path = self._document.result_path

        def on_read(opened: OpenedResult) -> None:
            self._turns.add(lambda: self._show_own(opened), lambda: then(self._document.stored is opened.result))

        def on_error(error: ObscuraError) -> None:
            self._on_error(error)
            then(False)

        if path is not None:
            self._jobs.run("open result", lambda: read_result(path, verify=False), on_read, on_error)

    def _show_own(self, opened: OpenedResult) -> None:
        if self._document.result_path == opened.path:
            self._show(opened)

    def _on_solved(self, job: SolveJob, field: VertexField, seconds: float) -> None:
        self.solving.emit(job.purpose, False)
        document, result, stored = self._document, self._document.result, self._document.stored
        if result is None or stored is None or job.result != str(document.result_path):
            return
        if len(field.state) != stored.world.vertex_count:
            return
        field = padded_field(field, result.world.vertex_count)
        logger.info("solved for the %s in %.2f s", job.purpose, seconds)
        if job.purpose == THRESHOLD:
            if job.options.get("back-face-threshold") == document.threshold:
                document.set_field(field)
        elif job.purpose == ALPHA:
            if job.options.get("alpha") == self._wanted_alpha:
                document.set_field(field, f"smoothing α {self._wanted_alpha:g}, not stored")
        elif job.purpose == OTHER_MAPPING and self._comparing:
            document.set_other(field)

    def _on_failed(self, job: Job, error: ObscuraError) -> None:
        self._end(job)
        if isinstance(job, BakeJob):
            self.bake_ended.emit(False)
        logger.error("%s", error)
        self.message.emit(logging.ERROR, str(error))

    def _on_cancelled(self, job: Job) -> None:
        self._end(job)
        if isinstance(job, BakeJob):
            self.bake_ended.emit(False)
            logger.info("bake cancelled")
            self.message.emit(logging.INFO, "Cancelled; the stored result is as it was.")

    def _on_crashed(self, text: str) -> None:
        self._end_bake()
        self.bake_ended.emit(False)
        for purpose in (THRESHOLD, OTHER_MAPPING, ALPHA):
            self.solving.emit(purpose, False)
        logger.error("%s", text)
        self.message.emit(logging.ERROR, text)

    def _on_state(self, state: EngineState) -> None:
        logger.debug("engine %s", state.value)

    def _end(self, job: Job) -> None:
        if isinstance(job, BakeJob):
            self._end_bake()
        else:
            self.solving.emit(job.purpose, False)

    def _end_bake(self) -> None:
        self.busy.emit("")
        self.baking.emit(False)
