"""What a window remembers of its user's taste: bright or dark."""

from __future__ import annotations

from app.actions import Action, ActionSpec
from app.style import apply_scheme
from app.window_parts import Part


class HabitsPart(Part):
    """Bright or dark."""

    def actions(self) -> list[Action]:
        """Colours of the window."""
        menu = "View"
        return [
            (
                ActionSpec("light-palette", menu, "Bright window", "Light colours for the panels", (), True, 5),
                lambda on: self.set_scheme("light" if on else ""),
            ),
            (
                ActionSpec("dark-palette", menu, "Dark window", "Dark colours for the panels", (), True, 5),
                lambda on: self.set_scheme("dark" if on else ""),
            ),
        ]

    def connect(self) -> None:
        """Ticks what is chosen."""
        self._show_scheme()

    def set_scheme(self, name: str) -> None:
        """Gives the window a bright ("light"), a dark ("dark") or the system's ("") palette, and remembers it."""
        self.bench.store.setValue("window/scheme", name)
        apply_scheme(name)
        self._show_scheme()

    def _show_scheme(self) -> None:
        name = str(self.bench.store.value("window/scheme", ""))
        self.bench.registry["light-palette"].setChecked(name == "light")
        self.bench.registry["dark-palette"].setChecked(name == "dark")
