"""The Edit menu: undo, the command palette, shortcuts and preferences."""

from __future__ import annotations

from app.actions import Action, ActionSpec
from app.command_palette import CommandPalette
from app.dialogs import show_dialog
from app.shortcut_editor import ShortcutEditor
from app.window_parts import Part, Workbench


class EditPart(Part):
    """What helps to find and to change actions."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.palette = CommandPalette(bench.registry, bench.store, bench.window)

    def actions(self) -> list[Action]:
        """Palette and shortcuts."""
        menu = "Edit"
        return [
            (
                ActionSpec(
                    "palette",
                    menu,
                    "Command &palette …",
                    "Find any action by a few letters of its name",
                    ("Ctrl+K", "Ctrl+Shift+P"),
                    group=5,
                ),
                self.palette.open,
            ),
            (
                ActionSpec("shortcuts", menu, "&Shortcuts …", "Give actions other keys", group=8),
                self.edit_shortcuts,
            ),
        ]

    def edit_shortcuts(self) -> None:
        """Opens the editor of shortcuts."""
        show_dialog(ShortcutEditor(self.bench.registry, self.bench.window))
