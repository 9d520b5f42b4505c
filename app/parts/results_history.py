"""A bake as one step that can be undone: the former result is kept until the step is forgotten."""

from __future__ import annotations

import logging
from pathlib import Path

from PyQt6.QtCore import QTimer

from app.events import Event
from app.kept_results import KeptResults
from app.parts.history import HistoryPart
from app.rebake_layers import LayerInfo
from app.undo_step import Step
from app.window_parts import Part, Workbench
from bake.errors import ObscuraError, ResultError

logger = logging.getLogger(__name__)

_BAKE = "bake"
MOST_KEPT = 24
"""Steps whose results are kept; older ones can no longer be undone."""


class ResultsHistoryPart(Part):
    """Keeps results around each bake, puts them back on undo, and clears up behind the undo stack."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self._kept = KeptResults(bench.cache)
        self._before: tuple[Path, Path | None] | None = None
        self.next_step: tuple[str, LayerInfo] = (_BAKE, LayerInfo())
        """What the step will be called that the next new result makes, and what it knows."""
        self.about_to_put: Event[[]] = Event()
        self._sweep = QTimer(bench.window)
        self._sweep.setSingleShot(True)
        self._sweep.setInterval(1000)
        self._sweep.timeout.connect(self._drop_unused)

    def connect(self) -> None:
        """Follows bakes and the undo stack."""
        controller, undo = self.bench.controller, self.bench.undo
        controller.about_to_bake.connect(self._on_begin)
        controller.bake_ended.connect(self._on_end)
        undo.indexChanged.connect(self._sweep.start)
        self.bench.document.opened.connect(self._drop_orphans)
        self._drop_orphans()

    def close(self) -> None:
        """Removes all that was kept."""
        self.bench.undo.indexChanged.disconnect(self._sweep.start)
        self._sweep.stop()
        self._kept.drop_others((), self._kept.count)

    def former(self) -> Path | None:
        """Where the result is kept that the last bake replaced; None if none did, or if that was undone."""
        undo = self.bench.undo
        for row in reversed(range(undo.index())):
            step = undo.command(row)
            if isinstance(step, Step) and any(isinstance(item, LayerInfo) for item in step.holds):
                kept = [path for path in step.holds if isinstance(path, Path)]
                return kept[0] if len(kept) > 1 else None
        return None

    def _drop_orphans(self) -> None:
        path = self.bench.document.result_path
        self.bench.jobs.run("undo orphans", lambda: self._kept.drop_orphans(path), lambda _none: None, self._on_error)

    def _on_begin(self, result: Path) -> None:
        self._before = None
        try:
            self._before = (result, self._kept.keep(result))
        except (ObscuraError, OSError) as error:
            logger.warning("this bake cannot be undone: %s", error)

    def _on_end(self, replaced: bool) -> None:
        before, self._before = self._before, None
        (text, info), self.next_step = self.next_step, (_BAKE, LayerInfo())
        if before is None or not replaced or before[0] != self.bench.document.result_path:
            self._sweep.start()
            return
        result, former = before
        try:
            latter = self._kept.keep(result)
        except ObscuraError as error:
            logger.warning("this bake cannot be undone: %s", error)
            return
        if latter is not None:
            step = Step(
                text,
                redo=lambda: self._put(step, latter, result),
                undo=lambda: self._put(step, former, result),
                done=True,
                failed=self._on_error,
            )
            step.holds = (info, *(path for path in (former, latter) if path is not None))
            self.bench.undo.push(step)
            self._forget_oldest()

    def _forget_oldest(self) -> None:
        undo = self.bench.undo
        steps = [step for row in range(undo.count()) if isinstance(step := undo.command(row), Step)]
        keeping = [step for step in steps if any(isinstance(item, Path) for item in step.holds)]
        for step in keeping[:-MOST_KEPT]:
            step.holds = tuple(item for item in step.holds if not isinstance(item, Path))

    def _put(self, step: Step, kept: Path | None, result: Path) -> None:
        if kept is not None and kept not in step.holds:
            raise ResultError("is no longer kept", where=f"the result before “{step.text()}”", remedy="bake again")
        self.about_to_put.emit()
        history = self.bench.part(HistoryPart)
        history.set_waiting(True)
        self.bench.controller.busy.emit("Putting the former result back")
        self.bench.jobs.run(
            "put result back", lambda: self._kept.restore(kept, result), lambda _none: self._show(kept), self._on_error
        )

    def _show(self, kept: Path | None) -> None:
        if kept is None:
            self.bench.document.drop_result()
            self._end_waiting()
        else:
            self.bench.controller.reload_result(lambda _well: self._end_waiting())

    def _end_waiting(self) -> None:
        self.bench.controller.busy.emit("")
        self.bench.part(HistoryPart).set_waiting(False)

    def _on_error(self, error: ObscuraError) -> None:
        self._end_waiting()
        self.bench.banner.show_message(logging.ERROR, str(error))

    def _drop_unused(self) -> None:
        undo = self.bench.undo
        steps = [undo.command(row) for row in range(undo.count())]
        used = [path for step in steps if isinstance(step, Step) for path in step.holds if isinstance(path, Path)]
        if self._before is not None and self._before[1] is not None:
            used.append(self._before[1])
        count = self._kept.count
        self.bench.jobs.run(
            "drop kept", lambda: self._kept.drop_others(used, count), lambda _none: None, self._on_error
        )
