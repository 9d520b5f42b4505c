"""The window's side of the engine process: start it, give it jobs, hear from it, cancel, survive its death."""

from __future__ import annotations

import enum
import logging
import multiprocessing
import threading
import time
from collections.abc import Sequence
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import Any

from PyQt6.QtCore import QObject, QTimer, pyqtSignal

from app.engine_obituary import obituary
from app.engine_protocol import (
    BakeDone,
    BakeJob,
    Job,
    JobFailed,
    JobStopped,
    LogLine,
    Ready,
    RebakeDone,
    RebakeJob,
    RebakeLayout,
    RebakeValues,
    Report,
    SolveDone,
    SolveJob,
    Stop,
    TaskDone,
    TaskJob,
)
from app.engine_worker import Bake, bake_job, copied_field, field_bytes, run_worker
from bake.settings import BakeSettings

ANSWER_MS = 400
"""A cancelled job counts as stopped after this time, whatever the engine is busy with."""
PATIENCE_MS = 2000
"""After this time the engine is terminated and started anew: the only way out of a hanging device."""
QUICK_DEATHS = 3
"""Deaths within a minute after which the engine stays down until the user starts it again."""

Ended = BakeDone | SolveDone | TaskDone | RebakeDone | JobFailed | JobStopped

logger = logging.getLogger(__name__)


class EngineState(enum.Enum):
    """What the engine is doing."""

    STARTING = "starting"
    IDLE = "idle"
    BUSY = "busy"
    CANCELLING = "cancelling"
    DOWN = "down"


class Engine(QObject):
    """One persistent engine process.

    Jobs run one at a time, in order; a re-solve that waits is replaced by the next one. All signals are emitted in the
    thread that owns this object.

    Args:
        bake: Runs a bake job inside the process.
        parent: Qt parent.
    """

    state_changed = pyqtSignal(object)  # EngineState
    progressed = pyqtSignal(object, float)  # Progress, memory in MB
    bake_finished = pyqtSignal(object)  # BakeDone
    solve_finished = pyqtSignal(object, object, float)  # SolveJob, VertexField, seconds
    task_finished = pyqtSignal(object, object)  # TaskJob, what it returned
    task_progressed = pyqtSignal(object, object)  # TaskJob, Progress
    rebake_told = pyqtSignal(object, object)  # RebakeJob, Progress, RebakeLayout or RebakeValues
    rebake_finished = pyqtSignal(object, object)  # RebakeJob, RebakeDone
    failed = pyqtSignal(object, object)  # Job, ObscuraError
    cancelled = pyqtSignal(object)  # Job
    crashed = pyqtSignal(str)  # what happened, for people
    logged = pyqtSignal(int, str, str)  # level, logger, text
    _received = pyqtSignal(int, object)  # generation, Reply or None when the process is gone

    def __init__(self, bake: Bake = bake_job, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._bake = bake
        self._context = multiprocessing.get_context("spawn")
        self._cancelled_id: Any = self._context.RawValue("q", 0)
        self._process: BaseProcess | None = None
        self._connection: Connection | None = None
        self._reader: threading.Thread | None = None
        self._generation = 0
        self._state = EngineState.DOWN
        self._last_id = 0
        self._active: Job | None = None
        self._answered = False  # the active job was reported as cancelled already
        self._pending: list[Job] = []
        self._memories: dict[int, SharedMemory] = {}
        self._deaths: list[float] = []
        self._closed = False
        self._anew = False
        self._answer_timer = self._single_shot(self._stop_waiting)
        self._patience_timer = self._single_shot(self._lose_patience)
        self._received.connect(self._on_received)

    @property
    def state(self) -> EngineState:
        """What the engine is doing."""
        return self._state

    @property
    def pid(self) -> int | None:
        """Process id of the engine; None while it is down."""
        return self._process.pid if self._process is not None else None

    @property
    def is_baking(self) -> bool:
        """Whether a bake runs or waits."""
        return any(isinstance(job, BakeJob) for job in (self._active, *self._pending)) and not self._answered

    def start(self) -> None:
        """Starts the process if it is down; jobs may be given at once."""
        if self._process is not None or self._closed:
            return
        self._generation += 1
        ours, theirs = self._context.Pipe()
        process = self._context.Process(
            target=run_worker, args=(theirs, self._cancelled_id, self._bake), name="obscura-engine", daemon=True
        )
        process.start()
        theirs.close()
        self._process, self._connection = process, ours
        self._reader = threading.Thread(
            target=self._read, args=(self._generation, ours, process), name="engine-reader", daemon=True
        )
        self._reader.start()
        self._set_state(EngineState.STARTING)

    def bake(self, scene: Path, result: Path, settings: BakeSettings) -> int:
        """Queues a bake; returns its number."""
        self._last_id += 1
        self._submit(BakeJob(self._last_id, str(scene), str(result), settings.to_json()))
        return self._last_id

    def solve(self, purpose: str, result: Path, settings: BakeSettings, vertices: int, columns: int) -> int:
        """Queues a re-solve of stored samples, instead of one of the same purpose that waits; returns its number."""
        self._drop_waiting(purpose)
        self._last_id += 1
        memory = SharedMemory(create=True, size=field_bytes(vertices, columns))
        self._memories[self._last_id] = memory
        options = settings.to_json()
        self._submit(SolveJob(self._last_id, purpose, str(result), options, memory.name, vertices, columns))
        return self._last_id

    def task(self, purpose: str, result: Path, arguments: Any) -> int:
        """Queues one of `app.engine_tasks.TASKS`, instead of one of the same purpose that waits; returns its number."""
        self._drop_waiting(purpose)
        self._last_id += 1
        self._submit(TaskJob(self._last_id, purpose, str(result), arguments))
        return self._last_id

    def rebake(self, scene: Path, result: Path, settings: BakeSettings, **wanted: Any) -> int:
        """Queues a rebake with further attributes of its job, instead of the one that runs; returns its number."""
        self.cancel_rebake()
        self._last_id += 1
        self._submit(RebakeJob(self._last_id, str(scene), str(result), settings.to_json(), **wanted))
        return self._last_id

    def cancel_rebake(self) -> None:
        """Stops the rebake that waits or runs, and no other job."""
        self._drop_waiting("rebake")
        if isinstance(self._active, RebakeJob) and not self._active.prepare and not self._answered:
            self._stop_active()

    def cancel_task(self, purpose: str) -> None:
        """Stops the task of that purpose, running or waiting, and no other job."""
        for job in self._drop_waiting(purpose):
            self.cancelled.emit(job)
        if isinstance(self._active, TaskJob) and self._active.purpose == purpose:
            self._stop_active()

    def cancel(self) -> None:
        """Stops the running job and drops those that wait; answers within 0.5 s."""
        for job in self._pending:
            self._release(job)
        dropped, self._pending = self._pending, []
        for job in dropped:
            self.cancelled.emit(job)
        self._stop_active()

    @property
    def _cancels(self) -> bool:
        return self._answered or self._state is EngineState.CANCELLING

    def _stop_active(self) -> None:
        if self._active is None or self._state is EngineState.CANCELLING:
            return
        self._cancelled_id.value = self._active.id
        self._set_state(EngineState.CANCELLING)
        self._answer_timer.start(ANSWER_MS)
        self._patience_timer.start(PATIENCE_MS)

    def start_anew(self) -> None:
        """Starts the process again, so that it takes over what has changed around it; after its jobs, if it has any."""
        if self._active is not None or self._pending:
            self._anew = True
            return
        self._anew = False
        if self._process is not None and not self._closed:
            self._end_process(patience=0.0)
            self.start()

    def close(self) -> None:
        """Ends the process and the thread that listens to it, for good; jobs given later are dropped."""
        self._closed = True
        self._answer_timer.stop()
        self._patience_timer.stop()
        self._end_process(patience=0.3)
        self._drop_jobs()
        self._set_state(EngineState.DOWN)

    def _single_shot(self, slot: Any) -> QTimer:
        timer = QTimer(self)
        timer.setSingleShot(True)
        timer.timeout.connect(slot)
        return timer

    def _set_state(self, state: EngineState) -> None:
        if state is not self._state:
            self._state = state
            self.state_changed.emit(state)

    def _submit(self, job: Job) -> None:
        if self._closed:
            self._release(job)
            return
        self._pending.append(job)
        self.start()
        self._send_next()

    def _send_next(self) -> None:
        if self._active is not None or not self._pending or self._connection is None:
            return
        self._active, self._answered = self._pending.pop(0), False
        try:
            self._connection.send(self._active)
        except OSError:
            return  # the process just died; its reader says so next, and the job is reported then
        self._set_state(EngineState.BUSY)

    def _read(self, generation: int, connection: Connection, process: BaseProcess) -> None:
        """Runs in a thread of its own: blocks on the pipe and on the end of the process."""
        while True:
            ready = wait([connection, process.sentinel])
            if connection in ready:
                try:
                    self._received.emit(generation, connection.recv())
                    continue
                except (EOFError, OSError):
                    pass
            self._received.emit(generation, None)
            return

    def _on_received(self, generation: int, reply: object) -> None:
        if generation != self._generation:
            return  # the last words of a process that was given up
        if reply is None:
            self._on_death()
        elif isinstance(reply, LogLine):
            self.logged.emit(reply.level, reply.logger, reply.text)
        elif isinstance(reply, Ready):
            self._set_state(EngineState.IDLE if self._active is None else EngineState.BUSY)
            self._send_next()
        elif isinstance(reply, Report):
            job = self._active
            if job is None or reply.id != job.id or self._answered:
                return
            if isinstance(job, RebakeJob):
                self.rebake_told.emit(job, reply.progress)
            elif isinstance(job, TaskJob):
                self.task_progressed.emit(job, reply.progress)
            else:
                self.progressed.emit(reply.progress, reply.memory_mb)
        elif isinstance(reply, RebakeLayout | RebakeValues):
            job = self._active
            if isinstance(job, RebakeJob) and reply.id == job.id and not self._cancels:
                self.rebake_told.emit(job, reply)
        elif isinstance(reply, Ended):
            self._on_end(reply)

    def _on_end(self, reply: Ended) -> None:
        job = self._active
        if job is None or job.id != reply.id:
            return
        self._answer_timer.stop()
        self._patience_timer.stop()
        self._active = None
        self._set_state(EngineState.IDLE)
        if isinstance(reply, BakeDone):
            self.bake_finished.emit(reply)  # even if it was to be cancelled: the result is committed
        elif isinstance(reply, SolveDone) and isinstance(job, SolveJob) and not self._answered:
            self.solve_finished.emit(job, copied_field(self._memories[job.id], job, reply), reply.seconds)
        elif isinstance(reply, RebakeDone):
            self.rebake_finished.emit(job, reply)  # as for bakes
        elif isinstance(reply, TaskDone) and not self._answered:
            self.task_finished.emit(job, reply.value)
        elif isinstance(reply, JobFailed) and not self._answered:
            self.failed.emit(job, reply.error)
        elif isinstance(reply, JobStopped) and not self._answered:
            self.cancelled.emit(job)
        self._release(job)
        if self._anew:
            self.start_anew()
        self._send_next()

    def _stop_waiting(self) -> None:
        if self._active is not None and not self._answered:
            self._answered = True
            self.cancelled.emit(self._active)

    def _lose_patience(self) -> None:
        if self._active is None:
            return
        logger.warning("the engine did not stop within %.0f s and is started anew", PATIENCE_MS / 1000)
        self._release(self._active)
        self._active = None
        self._end_process(patience=0.0)
        self.start()
        self._send_next()

    def _on_death(self) -> None:
        code = self._process.exitcode if self._process is not None else None
        if code is None and self._process is not None:
            self._process.join(1.0)
            code = self._process.exitcode
        job, self._active = self._active, None
        self._answer_timer.stop()
        self._patience_timer.stop()
        self._end_process(patience=0.0)
        if job is not None:
            self._release(job)
        now = time.monotonic()
        self._deaths = [moment for moment in self._deaths if now - moment < 60.0] + [now]
        again = len(self._deaths) < QUICK_DEATHS
        if not again:
            self._drop_jobs()
        self._set_state(EngineState.DOWN)
        self.crashed.emit(obituary(code, busy=job is not None, again=again))
        if again:
            self.start()
            self._send_next()

    def _end_process(self, patience: float) -> None:
        self._generation += 1  # nothing more is heard from this one
        process, connection, reader = self._process, self._connection, self._reader
        self._process = self._connection = self._reader = None
        if process is None or connection is None or reader is None:
            return
        if patience > 0.0:
            try:
                connection.send(Stop())
            except OSError:
                patience = 0.0
            process.join(patience)
        if process.is_alive():
            process.terminate()
            process.join(1.0)
        if process.is_alive():
            process.kill()
            process.join()
        reader.join()
        connection.close()
        process.close()

    def _drop_waiting(self, purpose: str) -> Sequence[Job]:
        waiting = [job for job in self._pending if not isinstance(job, BakeJob) and job.purpose == purpose]
        for job in waiting:
            self._pending.remove(job)
            self._release(job)
        return waiting

    def _release(self, job: Job) -> None:
        memory = self._memories.pop(job.id, None)
        if memory is not None:
            memory.close()
            memory.unlink()

    def _drop_jobs(self) -> None:
        for job in (*self._pending, *([self._active] if self._active else [])):
            self._release(job)
        self._pending, self._active = [], None
