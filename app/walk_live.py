"""Keeps the walk in step with path, options and models, off the window's thread; asks the engine for what is traced."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

from PyQt6.QtCore import QObject, pyqtSignal

from app.engine import Engine
from app.engine_protocol import Job, TaskJob
from app.jobs import Jobs
from app.latest_job import LatestJob
from app.walk_state import WalkState
from app.walk_task import TracedWalk, WalkRequest
from bake.region_types import Regions
from bake.types import Float32Array, Progress
from bake.walk import Course, Variant, Walk, WalkPath, lay_out, simulate
from bake.walk.path_file import read_path
from viewer.walk_curves import largest_steps

PURPOSE = "walk"

_Made = tuple[WalkPath, Walk, Course, dict[Variant, Float32Array]]


class WalkLive(QObject):
    """Simulates walks.

    Args:
        state: What is asked for, and where it goes.
        engine: Traces tours and truths.
        jobs: Where the rest runs.
        parent: Qt parent.
    """

    tracing = pyqtSignal(bool)
    progressed = pyqtSignal(object)  # Progress
    failed = pyqtSignal(int, str)  # logging level, text

    def __init__(self, state: WalkState, engine: Engine, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._state, self._engine, self._jobs = state, engine, jobs
        self._laid_out: tuple[Regions, Course] | None = None
        self._asked: tuple[int, Path] | None = None  # the engine's job and the result that it works on
        self._job = LatestJob(
            jobs, "walk", self._prepare, self._on_made, lambda error: self.failed.emit(logging.ERROR, str(error))
        )
        for event in (
            state.path_changed, state.truth_changed, state.options_changed, state.regions.regions_changed,
        ):  # fmt: skip
            event.connect(self._job.request)
        engine.task_finished.connect(self._on_traced)
        engine.task_progressed.connect(self._on_progress)
        engine.failed.connect(lambda job, _error: self._on_ended(job))
        engine.cancelled.connect(self._on_ended)
        engine.crashed.connect(lambda _text: self._end())

    @property
    def is_tracing(self) -> bool:
        """Whether the engine traces for the walk."""
        return self._asked is not None

    @property
    def is_busy(self) -> bool:
        """Whether anything is under way."""
        return self.is_tracing or self._job.is_busy

    def trace(self, path: WalkPath | None, *, with_truth: bool) -> None:
        """Asks the engine for a tour (no path), and for the truth along the way."""
        result_path = self._state.regions.document.result_path
        if result_path is None or self._state.regions.baked is None:
            return
        number = self._engine.task(PURPOSE, result_path, WalkRequest(path, with_truth))
        self._asked = (number, result_path)
        self.tracing.emit(True)

    def cancel(self) -> None:
        """Stops the tracing."""
        self._engine.cancel_task(PURPOSE)

    def read_file(self, file: Path) -> None:
        """Takes a path from a file."""
        world = self._state.regions.document.world
        if world is not None:
            origin = world.origin
            self._jobs.run(
                "walk path",
                lambda: read_path(file, origin=origin),
                lambda path: self._state.set_path(path, file.name),
                lambda error: self.failed.emit(logging.ERROR, str(error)),
            )

    def _prepare(self) -> Callable[[], _Made] | None:
        state = self._state
        regions, path, options, truth = state.regions.regions, state.path, state.options, state.truth
        if regions is None or path is None:
            return None
        known = self._laid_out
        # Models may have changed since, but where the free space is must not have.
        course = known[1] if known is not None and known[0].points is regions.points else None

        def walk() -> _Made:
            fits = course is not None and course.path is path
            fits = (
                fits and course is not None and (course.speed, course.frame_rate) == (options.speed, options.frame_rate)
            )
            laid = course if fits and course is not None else None
            laid = laid or lay_out(regions, path, speed=options.speed, frame_rate=options.frame_rate)
            self._laid_out = (regions, laid)
            made = simulate(regions, path, options, truth=truth, course=laid)
            return path, made, laid, {variant: largest_steps(made, variant) for variant in made.ao}

        return walk

    def _on_made(self, made: _Made) -> None:
        path, walk, course, steps = made
        if self._state.path is path:
            self._state.set_walk(walk, course, steps)

    def _on_traced(self, job: object, value: object) -> None:
        if not isinstance(job, TaskJob) or self._asked is None or job.id != self._asked[0]:
            return
        at = self._asked[1]
        self._end()
        if isinstance(value, TracedWalk) and self._state.regions.document.result_path == at:
            self._state.take(value)

    def _on_progress(self, job: object, progress: Progress) -> None:
        if isinstance(job, TaskJob) and self._asked is not None and job.id == self._asked[0]:
            self.progressed.emit(progress)

    def _on_ended(self, job: Job) -> None:
        if self._asked is not None and job.id == self._asked[0]:
            self._end()

    def _end(self) -> None:
        if self._asked is not None:
            self._asked = None
            self.tracing.emit(False)
