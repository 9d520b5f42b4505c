"""One step that can be undone, made of two functions."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import Any

from PyQt6.QtGui import QUndoCommand

from bake.errors import ObscuraError

MERGE_SECONDS = 0.8
"""Steps of the same kind that follow each other faster, such as selections by a held arrow key, are one."""

logger = logging.getLogger(__name__)


class Step(QUndoCommand):
    """Calls `redo` and `undo`.

    Args:
        text: What it did, as in "Undo *text*".
        redo, undo: Do it, take it back. An `ObscuraError` makes the step void.
        done: Whether it has been done already when it is pushed.
        kind: Above 0, steps of one kind that follow each other quickly become one.
        failed: Told why a step is void.
    """

    def __init__(
        self,
        text: str,
        *,
        redo: Callable[[], object],
        undo: Callable[[], object],
        done: bool = False,
        kind: int = -1,
        failed: Callable[[ObscuraError], object] | None = None,
    ) -> None:
        super().__init__(text)
        self._redo, self._undo, self._done, self._kind, self._failed = redo, undo, done, kind, failed
        self._when = time.monotonic()
        self.holds: tuple[object, ...] = ()
        """What must live as long as this step, such as folders of kept results."""

    def redo(self) -> None:
        """Does it, except for the first time if it was done already."""
        if self._done:
            self._done = False
            return
        self._call(self._redo)

    def undo(self) -> None:
        """Takes it back."""
        self._call(self._undo)

    def id(self) -> int:
        """The kind, by which Qt looks for steps to merge."""
        return self._kind

    def mergeWith(self, other: QUndoCommand | None) -> bool:
        """Takes in the step that came after, if it came quickly."""
        if not isinstance(other, Step) or other._when - self._when > MERGE_SECONDS:
            return False
        self._redo, self._when = other._redo, other._when
        self.setText(other.text())
        return True

    def _call(self, function: Callable[[], Any]) -> None:
        try:
            function()
        except ObscuraError as error:
            logger.warning("%s", error)
            self.setObsolete(True)
            if self._failed is not None:
                self._failed(error)
