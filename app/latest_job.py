"""Work that is only worth its latest outcome: one run at a time, and one more if it was asked for meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from app.jobs import Jobs
from bake.errors import ObscuraError

Work = Callable[[], Any]


class LatestJob:
    """Runs what `prepare` gives; a slider that asks a hundred times a second never queues up work.

    Args:
        jobs: Where it runs.
        name: Of the job.
        prepare: Called on the window's thread when a run begins: the work, with all that it needs; None for none.
        done: Takes what the work returned.
        failed: Takes its error.
    """

    def __init__(
        self,
        jobs: Jobs,
        name: str,
        prepare: Callable[[], Work | None],
        done: Callable[[Any], object],
        failed: Callable[[ObscuraError], object],
    ) -> None:
        self._jobs, self._name, self._prepare, self._done, self._failed = jobs, name, prepare, done, failed
        self._running = self._wanted = False

    @property
    def is_busy(self) -> bool:
        """Whether it runs."""
        return self._running

    def request(self) -> None:
        """Runs, or runs once more when the run under way is over."""
        if self._running:
            self._wanted = True
            return
        self._wanted = False
        work = self._prepare()
        if work is not None:
            self._running = True
            self._jobs.run(self._name, work, self._on_done, self._on_failed)

    def _on_done(self, value: Any) -> None:
        self._running = False
        self._done(value)
        self._go_on()

    def _on_failed(self, error: ObscuraError) -> None:
        self._running = False
        self._failed(error)
        self._go_on()

    def _go_on(self) -> None:
        if self._wanted and not self._running:
            self.request()
