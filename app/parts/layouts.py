"""Where the panels stand: presets, the user's own layouts, and what the last session left."""

from __future__ import annotations

from PyQt6.QtCore import QByteArray
from PyQt6.QtWidgets import QInputDialog

from app.actions import Action, ActionSpec
from app.dialogs import show_dialog
from app.layout_dialog import LayoutDialog
from app.layouts import LAYOUT_VERSION, PRESETS, Preset, SavedLayouts, apply_preset
from app.window_parts import Part, Workbench

_MENU = "View/Layout"


class LayoutsPart(Part):
    """The Layout menu."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.saved = SavedLayouts(bench.store)
        self._default_state = QByteArray()
        self._listed: list[str] = []

    def actions(self) -> list[Action]:
        """Presets, saving, reset."""
        found: list[Action] = [
            (
                ActionSpec(
                    f"layout-{preset.name.lower()}", _MENU, f"&{preset.name}", preset.tip, (f"Ctrl+{number}",), group=6
                ),
                lambda preset=preset: self.use(preset),
            )
            for number, preset in enumerate(PRESETS, start=1)
        ]
        found += [
            (
                ActionSpec("layout-save", _MENU, "&Save layout …", "Keep the panels as they are under a name", group=6),
                self.ask_to_save,
            ),
            (
                ActionSpec("layout-manage", _MENU, "&Manage layouts …", "Rename and delete saved layouts", group=6),
                self.manage,
            ),
            (
                ActionSpec("reset-layout", _MENU, "&Reset layout", "Put all panels back where they were", group=6),
                lambda: self.use(PRESETS[0]),
            ),
        ]
        return found

    def connect(self) -> None:
        """Brings back the layout of the last session."""
        bench, window = self.bench, self.bench.window
        self._default_state = window.saveState(LAYOUT_VERSION)
        self.use(PRESETS[0])
        bench.docks["Bake"].raise_()  # what a new user needs first
        geometry, state = bench.store.value("window/geometry"), bench.store.value("window/state")
        if isinstance(geometry, QByteArray):
            window.restoreGeometry(geometry)
        if isinstance(state, QByteArray):
            self.restore(state)
        self._list_saved()

    def close(self) -> None:
        """Keeps the layout for the next session."""
        self.bench.store.setValue("window/geometry", self.bench.window.saveGeometry())
        self.bench.store.setValue("window/state", self.state())

    def state(self) -> QByteArray:
        """Where the panels stand now."""
        return self.bench.window.saveState(LAYOUT_VERSION)

    def restore(self, state: QByteArray) -> bool:
        """Puts the panels where they stood; one of another version changes nothing."""
        return self.bench.window.restoreState(state, LAYOUT_VERSION)

    def use(self, preset: Preset) -> None:
        """Shows the panels of a preset."""
        apply_preset(self.bench.window, self.bench.docks, preset, self._default_state)

    def use_saved(self, name: str) -> None:
        """Arranges the panels as they were saved."""
        state = self.saved.state(name)
        if state is not None:
            self.restore(state)

    def save(self, name: str) -> None:
        """Keeps the panels as they are under a name."""
        self.saved.save(name, self.state())
        self._list_saved()

    def ask_to_save(self) -> None:
        """Asks for a name and keeps the panels as they are."""
        dialog = QInputDialog(self.bench.window)
        dialog.setWindowTitle("Save layout")
        dialog.setLabelText("Name of the layout")
        dialog.setComboBoxEditable(True)
        dialog.setComboBoxItems(["", *self.saved.names()])
        dialog.textValueSelected.connect(lambda name: self.save(name.strip()) if name.strip() else None)
        show_dialog(dialog)

    def manage(self) -> None:
        """Opens the list of saved layouts."""
        dialog = LayoutDialog(self.saved, self.bench.window)
        dialog.chosen.connect(self.use_saved)
        dialog.changed.connect(self._list_saved)
        show_dialog(dialog)

    def _list_saved(self) -> None:
        """Gives each saved layout an action, so that menu, palette and shortcuts have it."""
        registry = self.bench.registry
        for name in self._listed:
            registry.remove(name)
        self._listed = []
        for name in self.saved.names():
            spec = ActionSpec(
                f"layout:{name}", _MENU, name.replace("&", "&&"), f"Arrange the panels as in “{name}”", group=6
            )
            action = registry.add(spec, lambda name=name: self.use_saved(name))
            self.bench.menus[_MENU].insertAction(registry["layout-save"], action)
            self._listed.append(spec.id)
