"""What a window remembers of its user: colours and the layout of its panels."""

from __future__ import annotations

from PyQt6.QtCore import QByteArray

from app.actions import Action, ActionSpec
from app.style import apply_scheme
from app.window_parts import Part, Workbench

LAYOUT_VERSION = 2


class HabitsPart(Part):
    """Bright or dark, and where the panels stand."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self._default_state = QByteArray()

    def actions(self) -> list[Action]:
        """Colours and layout."""
        menu = "View"
        return [
            (
                ActionSpec("light-palette", menu, "Bright window", "Light colours for the panels", (), True, 5),
                lambda on: self._set_scheme("light" if on else ""),
            ),
            (
                ActionSpec("dark-palette", menu, "Dark window", "Dark colours for the panels", (), True, 5),
                lambda on: self._set_scheme("dark" if on else ""),
            ),
            (
                ActionSpec("reset-layout", menu, "&Reset layout", "Put all panels back where they were", group=6),
                lambda: self.bench.window.restoreState(self._default_state, LAYOUT_VERSION),
            ),
        ]

    def connect(self) -> None:
        """Brings back the layout of the last session."""
        bench, window = self.bench, self.bench.window
        self._show_scheme()
        self._default_state = window.saveState(LAYOUT_VERSION)
        geometry, state = bench.store.value("window/geometry"), bench.store.value("window/state")
        if isinstance(geometry, QByteArray):
            window.restoreGeometry(geometry)
        if isinstance(state, QByteArray):
            window.restoreState(state, LAYOUT_VERSION)

    def close(self) -> None:
        """Keeps the layout for the next session."""
        self.bench.store.setValue("window/geometry", self.bench.window.saveGeometry())
        self.bench.store.setValue("window/state", self.bench.window.saveState(LAYOUT_VERSION))

    def _set_scheme(self, name: str) -> None:
        self.bench.store.setValue("window/scheme", name)
        apply_scheme(name)
        self._show_scheme()

    def _show_scheme(self) -> None:
        name = str(self.bench.store.value("window/scheme", ""))
        self.bench.registry["light-palette"].setChecked(name == "light")
        self.bench.registry["dark-palette"].setChecked(name == "dark")
