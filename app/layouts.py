"""Layouts of the panels: presets for a kind of work, and those that the user has saved."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from PyQt6.QtCore import QByteArray, QSettings
from PyQt6.QtWidgets import QDockWidget, QMainWindow

LAYOUT_VERSION = 4
"""Raised when a stored arrangement no longer fits the panels that there are; older ones are then forgotten."""

_SAVED = "layouts/saved"


@dataclass(frozen=True, slots=True)
class Preset:
    """A layout that comes with the window.

    Attributes:
        name: Stable name, also shown.
        tip: What it is for.
        panels: What it shows, of the panels that there are.
        front: Those in front of the others of their tabs.
    """

    name: str
    tip: str
    panels: frozenset[str]
    front: tuple[str, ...]


_ELSEWHERE = frozenset({"Regions", "Region list", "Walk", "Walk plot", "Pops", "Comparison", "Results", "Runtime"})
"""Panels that only layouts show which name them; what nobody names belongs to Inspect."""

PRESETS = (
    Preset("Inspect", "Find out why a spot is dark", frozenset(), ("Objects", "Display", "Explain", "Probe", "Spots")),
    Preset(
        "Edit",
        "Move, copy and delete objects, and rebake what that can reach",
        frozenset({"Bake", "Objects", "History", "Object", "Rebake", "Display", "Comparison", "Probe", "Log"}),
        ("Objects", "Object", "Probe"),
    ),
    Preset(
        "Regions",
        "Dynamic regions, their models and boundaries",
        frozenset({"Regions", "Region list", "Walk", "Walk plot", "Pops", "Objects", "Display", "Log"}),
        ("Objects", "Regions", "Region list"),
    ),
    Preset(
        "Bake",
        "Settings, stages and what the bake found",
        frozenset({"Bake", "Objects", "History", "Display", "Marks", "Stages", "Findings", "Log"}),
        ("Bake", "Display", "Stages"),
    ),
    Preset(
        "Compare",
        "Two results or mappings, with much room for the view",
        frozenset({"Display", "Comparison", "Results", "Runtime", "History"}),
        ("Comparison", "Results", "Display"),
    ),
)


def preset_panels(preset: Preset, titles: Iterable[str]) -> set[str]:
    """Which of some panels a preset shows."""
    return {title for title in titles if (title in preset.panels if preset.panels else title not in _ELSEWHERE)}


def apply_preset(
    window: QMainWindow, docks: Mapping[str, QDockWidget], preset: Preset, default_state: QByteArray
) -> None:
    """Puts the panels where they were at first and shows those of a preset."""
    window.restoreState(default_state, LAYOUT_VERSION)
    shown = preset_panels(preset, docks)
    for title, dock in docks.items():
        dock.setVisible(title in shown)
    for title in reversed(preset.front):
        if title in docks and title in shown:
            docks[title].raise_()


class SavedLayouts:
    """The user's own layouts by name.

    Args:
        store: Where they are kept.
    """

    def __init__(self, store: QSettings) -> None:
        self._store = store

    def names(self) -> list[str]:
        """In the order of the alphabet."""
        return sorted(self._read())

    def state(self, name: str) -> QByteArray | None:
        """The arrangement of a name."""
        return self._read().get(name)

    def save(self, name: str, state: QByteArray) -> None:
        """Keeps an arrangement, in place of one of that name."""
        self._write({**self._read(), name: state})

    def rename(self, name: str, other: str) -> None:
        """Gives a layout another name, in place of one that has it."""
        layouts = self._read()
        if name in layouts:
            state = layouts.pop(name)
            self._write({**layouts, other: state})

    def delete(self, name: str) -> None:
        """Forgets a layout."""
        self._write({known: state for known, state in self._read().items() if known != name})

    def _read(self) -> dict[str, QByteArray]:
        stored = self._store.value(_SAVED, {})
        entries = stored.items() if isinstance(stored, dict) else ()
        return {str(name): state for name, state in entries if isinstance(state, QByteArray)}

    def _write(self, layouts: dict[str, QByteArray]) -> None:
        if layouts:
            self._store.setValue(_SAVED, layouts)
        else:
            self._store.remove(_SAVED)
