"""The layers of an open scene: every bake and rebake since it was opened, as its steps of the undo stack keep them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PyQt6.QtGui import QUndoStack

from app.undo_step import Step
from bake.rebake.types import RebakeReport


@dataclass(frozen=True, slots=True)
class LayerInfo:
    """What a step that replaced the result knows of itself.

    Attributes:
        vertices: How many have another value since; -1 if nobody counted.
        report: Of a rebake.
    """

    vertices: int = -1
    report: RebakeReport | None = None


@dataclass(frozen=True, slots=True)
class Layer:
    """One result that took another's place.

    Attributes:
        number: Of its step on the undo stack.
        name: What was done.
        before, after: Where both results are kept; None if there was none before, or it is no longer kept.
        vertices: How many have another value since; -1 if nobody counted.
        state: "in view", "below" what is in view, "undone", or "not kept" any longer.
        tip: More about it.
    """

    number: int
    name: str
    before: Path | None
    after: Path | None
    vertices: int
    state: str
    tip: str


def layers_of(undo: QUndoStack) -> list[Layer]:
    """The layers of an undo stack, the oldest first."""
    found: list[Layer] = []
    steps = [undo.command(row) for row in range(undo.count())]
    top = max((row for row in range(undo.index()) if _info(steps[row]) is not None), default=-1)
    for row, step in enumerate(steps):
        info = _info(step)
        if not isinstance(step, Step) or info is None:
            continue
        paths = [path for path in step.holds if isinstance(path, Path)]
        state = "in view" if row == top else "below" if row < top else "undone"
        if not paths:
            state = "not kept"
        report = info.report
        tip = f"{report.rays_traced:,} rays in {report.seconds:.2f} s" if report is not None else "A whole bake"
        found.append(
            Layer(
                number=row,
                name=step.text(),
                before=paths[0] if len(paths) > 1 else None,
                after=paths[-1] if paths else None,
                vertices=info.vertices,
                state=state,
                tip=tip,
            )
        )
    return found


def _info(step: object) -> LayerInfo | None:
    if not isinstance(step, Step):
        return None
    return next((item for item in step.holds if isinstance(item, LayerInfo)), None)


def names_of(changed: Sequence[str]) -> str:
    """The objects of a rebake in a few words."""
    if not changed:
        return "rebake"
    first = changed[0].rpartition("/")[2]
    return f"rebake {first}" if len(changed) == 1 else f"rebake {first} and {len(changed) - 1:,} more"
