"""Undo and redo, and the panel that lists what can be taken back."""

from __future__ import annotations

from PyQt6.QtWidgets import QUndoView

from app.actions import Action, ActionSpec
from app.undo_step import Step
from app.window_parts import DockSpec, Part, Side, Workbench


class HistoryPart(Part):
    """The window's undo stack. Opening another scene starts it afresh."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self._waiting = False
        self._depth = 0
        self.view = QUndoView(bench.undo)
        self.view.setEmptyLabel("As it was opened")
        self.view.setToolTip("What was done, the latest below; click a line to go back to it or forward again")

    def docks(self) -> list[DockSpec]:
        """The list of steps."""
        return [DockSpec("History", self.view, Side.LEFT)]

    def actions(self) -> list[Action]:
        """Undo and redo."""
        undo, redo = self.bench.undo.undo, self.bench.undo.redo
        return [
            (ActionSpec("undo", "Edit", "&Undo", "Take back the last step", ("Ctrl+Z",)), undo),
            (ActionSpec("redo", "Edit", "&Redo", "Do again what was taken back", ("Ctrl+Shift+Z", "Ctrl+Y")), redo),
        ]

    def connect(self) -> None:
        """Follows the stack."""
        undo = self.bench.undo
        for signal in (undo.canUndoChanged, undo.canRedoChanged, undo.undoTextChanged, undo.redoTextChanged):
            signal.connect(self.refresh)
        self.bench.document.opened.connect(self._start_over)
        self.bench.controller.baking.connect(lambda _on: self.refresh())
        self.refresh()

    def close(self) -> None:
        """Forgets all steps, with what they hold."""
        for signal in (self.bench.undo.canUndoChanged, self.bench.undo.canRedoChanged):
            signal.disconnect(self.refresh)
        for signal in (self.bench.undo.undoTextChanged, self.bench.undo.redoTextChanged):
            signal.disconnect(self.refresh)
        self.bench.undo.clear()

    def set_depth(self, depth: int) -> None:
        """Limits the number of steps, 0 for no limit; where there are steps already, from the next scene on."""
        self._depth = depth
        if not self.bench.undo.count():  # Qt changes the limit of an empty stack only
            self.bench.undo.setUndoLimit(depth)

    def set_waiting(self, waiting: bool) -> None:
        """Lets nothing be undone while a step is still being carried out."""
        self._waiting = waiting
        self.view.setEnabled(not waiting)
        self.refresh()

    def _start_over(self) -> None:
        self.bench.undo.clear()
        self.bench.undo.setUndoLimit(self._depth)
        self.set_waiting(False)

    def refresh(self) -> None:
        """Says in the menu what would be undone."""
        undo, registry = self.bench.undo, self.bench.registry
        steps = (undo.command(undo.index() - 1), undo.command(undo.index()))
        texts = (undo.undoText(), undo.redoText())
        for name, step, text in zip(("undo", "redo"), steps, texts, strict=True):
            why = ""
            if step is None:
                why = f"nothing to {name}"
            elif self._waiting:
                why = "the last step is still being taken"
            elif self.bench.engine.is_baking and isinstance(step, Step) and step.holds:
                why = "a bake is running"
            word = f"&{name.capitalize()}"
            registry[name].setText(word if step is None else f"{word} {text[:60]}")
            registry.enable(name, not why, why)
