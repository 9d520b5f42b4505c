"""Selecting, hiding and showing objects, each of which can be undone."""

from __future__ import annotations

import numpy as np
from PyQt6.QtCore import QPoint
from PyQt6.QtWidgets import QApplication

from app.actions import Action, ActionSpec
from app.undo_step import Step
from app.window_parts import Part, Workbench
from bake.types import BoolArray

_SELECT = 1


class SelectionsPart(Part):
    """Watches selection and visibility, whoever changes them, and makes steps of the changes."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self._selection: tuple[tuple[int, ...], int] = ((), -1)
        self._visible: BoolArray = np.zeros(0, bool)
        self._replaying = False

    def actions(self) -> list[Action]:
        """What can be done with selected objects."""
        menu, here = "Edit", ("object",)
        both = ("object", "view")
        selection, scene = ("selection",), ("scene",)
        return [
            (
                ActionSpec("select-all", menu, "Select &all", "Select every object", ("Ctrl+A",), group=1, needs=scene),
                lambda: self.bench.document.select_all(range(len(self.bench.document.visible))),
            ),
            (
                ActionSpec(
                    "select-none",
                    menu,
                    "Select &none",
                    "Let go of all objects",
                    ("Ctrl+Shift+A",),
                    group=1,
                    needs=selection,
                ),
                lambda: self.bench.document.select(-1),
            ),
            (
                ActionSpec(
                    "select-inverse",
                    menu,
                    "&Invert selection",
                    "Select what is not selected",
                    ("Ctrl+I",),
                    group=1,
                    needs=scene,
                ),
                self._invert,
            ),
            (
                ActionSpec(
                    "select-role",
                    menu,
                    "Select same r&ole",
                    "Select all objects of the role of the selected ones",
                    group=1,
                    context=here,
                    needs=selection,
                ),
                self._select_role,
            ),
            (
                ActionSpec(
                    "hide", menu, "&Hide", "Do not draw the selected objects", ("H",), False, 2, both, selection
                ),
                lambda: self._show(hidden=True),
            ),
            (
                ActionSpec("show", menu, "Sho&w", "Draw the selected objects", ("Shift+H",), False, 2, here, selection),
                lambda: self._show(hidden=False),
            ),
            (
                ActionSpec(
                    "show-only",
                    menu,
                    "Show on&ly these",
                    "Hide everything else",
                    ("Ctrl+H",),
                    False,
                    2,
                    both,
                    selection,
                ),
                self._show_only,
            ),
            (
                ActionSpec(
                    "show-all",
                    menu,
                    "Show &everything",
                    "Draw every object but lower levels of detail",
                    ("Alt+H",),
                    False,
                    2,
                    both,
                    scene,
                ),
                self._show_all,
            ),
            (
                ActionSpec(
                    "copy-paths",
                    menu,
                    "Copy &paths",
                    "Put the paths of the selected objects on the clipboard",
                    group=3,
                    context=here,
                    needs=selection,
                ),
                self._copy_paths,
            ),
        ]

    def connect(self) -> None:
        """Follows the document."""
        document = self.bench.document
        document.selection_changed.connect(self._on_selection)
        document.visibility_changed.connect(self._on_visibility)
        for event in (document.opened, document.world_changed):
            event.connect(self._start_over)
        self.bench.panels.outliner.menu_requested.connect(self._show_menu)
        self._start_over()

    def _start_over(self) -> None:
        document = self.bench.document
        self._selection, self._visible = (document.selection, document.selected), document.visible

    def _on_selection(self) -> None:
        document = self.bench.document
        before, after = self._selection, (document.selection, document.selected)
        self._selection = after
        if self._replaying or before[0] == after[0]:
            return
        count = len(after[0])
        world = document.world
        what = (
            world.object_paths[after[0][0]].rpartition("/")[2]
            if count == 1 and world is not None
            else f"{count} objects"
        )
        text = f"select {what}" if count else "select nothing"
        restore = self._restore_selection
        self.bench.undo.push(
            Step(text, redo=lambda: restore(*after), undo=lambda: restore(*before), done=True, kind=_SELECT)
        )

    def _on_visibility(self) -> None:
        before, after = self._visible, self.bench.document.visible
        self._visible = after
        if self._replaying or len(before) != len(after):
            return
        hidden, shown = int((before & ~after).sum()), int((after & ~before).sum())
        words = [f"{word} {count}" for word, count in (("hide", hidden), ("show", shown)) if count]
        text = f"{', '.join(words)} object{'s' if hidden + shown != 1 else ''}"
        restore = self._restore_visibility
        self.bench.undo.push(Step(text, redo=lambda: restore(after), undo=lambda: restore(before), done=True))

    def _restore_selection(self, selection: tuple[int, ...], last: int) -> None:
        self._replaying = True
        count = len(self.bench.document.visible)
        self.bench.document.select_all((index for index in selection if index < count), last)
        self._replaying = False

    def _restore_visibility(self, visible: BoolArray) -> None:
        self._replaying = True
        if len(visible) == len(self.bench.document.visible):
            self.bench.document.set_visible(visible)
        self._replaying = False

    def _invert(self) -> None:
        document = self.bench.document
        chosen = np.ones(len(document.visible), bool)
        chosen[list(document.selection)] = False
        document.select_all(np.flatnonzero(chosen).tolist())

    def _select_role(self) -> None:
        document, world = self.bench.document, self.bench.document.world
        if world is None:
            return
        current, pairs = document.current, list(zip(world.object_paths, world.object_roles, strict=True))
        roles = [role if current is None else current.role_of(path, role) for path, role in pairs]
        wanted = {roles[index] for index in document.selection}
        document.select_all((index for index, role in enumerate(roles) if role in wanted), document.selected)

    def _show(self, *, hidden: bool) -> None:
        visible = self.bench.document.visible.copy()
        visible[list(self.bench.document.selection)] = not hidden
        self.bench.document.set_visible(visible)

    def _show_only(self) -> None:
        visible = np.zeros(len(self.bench.document.visible), bool)
        visible[list(self.bench.document.selection)] = True
        self.bench.document.set_visible(visible)

    def _show_all(self) -> None:
        self.bench.document.set_visible(self.bench.document.visible_at_first())

    def _copy_paths(self) -> None:
        world, clipboard = self.bench.document.world, QApplication.clipboard()
        if world is not None and clipboard is not None:
            clipboard.setText("\n".join(world.object_paths[index] for index in self.bench.document.selection))

    def _show_menu(self, position: QPoint) -> None:
        menu = self.bench.registry.context_menu("object", self.bench.window)
        menu.aboutToHide.connect(menu.deleteLater)
        menu.popup(position)
