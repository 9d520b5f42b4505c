"""The Help menu."""

from __future__ import annotations

from app import dialogs
from app.actions import Action, ActionSpec, keys_text
from app.window_parts import Part


class HelpPart(Part):
    """Keys, mouse and version."""

    def actions(self) -> list[Action]:
        """What keys do, and what this is."""
        menu, window = "Help", self.bench.window
        return [
            (
                ActionSpec("keys", menu, "&Keys and mouse", "What keys and mouse buttons do", ("F1",)),
                lambda: dialogs.show_keys(window, self.keys_text()),
            ),
            (ActionSpec("about", menu, "&About Obscura", "Version and licence"), lambda: dialogs.show_about(window)),
        ]

    def keys_text(self) -> str:
        """Keys and mouse as they are set, as rich text."""
        style = self.bench.area.main.navigation.style
        return keys_text(self.bench.registry.key_rows(), style.gestures())
