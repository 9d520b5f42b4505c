"""The preferences in a dialog; each change holds at once."""

from __future__ import annotations

from collections.abc import Mapping

from PyQt6.QtCore import pyqtSignal
from PyQt6.QtWidgets import (
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QGroupBox,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from app.navigation_styles import STYLES
from app.preferences import SCHEMES, UP_AXES, Preferences


class PreferencesDialog(QDialog):
    """Edits preferences.

    Args:
        preferences: Those that hold.
        devices: Titles of the devices by their names.
        most_threads: Of this machine.
        parent: The window.
    """

    changed = pyqtSignal(object)  # Preferences
    clear_asked = pyqtSignal()
    hints_asked = pyqtSignal()

    def __init__(
        self, preferences: Preferences, devices: Mapping[str, str], most_threads: int, parent: QWidget
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Preferences")
        self._filling = False
        self._preferences = preferences
        styles = {name: style.title for name, style in STYLES.items()}
        devices = {**devices, preferences.device: devices.get(preferences.device, preferences.device)}
        self.scheme = _choice(SCHEMES, "Colours of panels and menus; the picture has its own")
        self.navigation = _choice(styles, "What mouse buttons do in the view")
        self._gestures = QLabel()
        self._gestures.setToolTip("What the mouse does in the view")
        self.up_axis = _choice(
            UP_AXES, "Which way is up in files that do not say, such as OBJ and PLY; holds for what is opened next"
        )
        self.device = _choice(devices, "What scenes are baked on, unless they say themselves")
        self.threads = _number(
            (0, most_threads), "", "all", "CPU threads that bake; fewer leave room for other programs"
        )
        self.cache = _number(
            (0, 1_000_000),
            " MB",
            "no limit",
            "Room for results that were not saved elsewhere; those not used for longest go first",
        )
        self.cache.setSingleStep(1000)
        self.undo = _number((0, 10_000), " steps", "no limit", "Steps that can be undone; holds from the next scene on")
        self.autosave = _number(
            (0, 3600), " s", "never", "How often the session is put aside, to be offered after a crash"
        )
        self._used = QLabel("…")
        self._used.setToolTip("Room that the window's results take now")
        clear = QPushButton("Clear")
        clear.setToolTip("Remove all of the window's results but the one in view; results saved elsewhere stay")
        clear.setAutoDefault(False)
        clear.clicked.connect(self.clear_asked)
        hints = QPushButton("Show hints again")
        hints.setToolTip("The hints that a new user sees")
        hints.setAutoDefault(False)
        hints.clicked.connect(self.hints_asked)
        room = QWidget()
        row = QHBoxLayout(room)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self._used, 1)
        row.addWidget(clear)
        layout = QVBoxLayout(self)
        layout.addWidget(_group("Look", {"Window": self.scheme, "": hints}))
        layout.addWidget(_group("View", {"Mouse": self.navigation, "": self._gestures, "Up axis": self.up_axis}))
        layout.addWidget(_group("Bake", {"Device": self.device, "CPU threads": self.threads}))
        layout.addWidget(
            _group(
                "Keeping",
                {"Room for results": self.cache, "Taken now": room, "Undo": self.undo, "Autosave every": self.autosave},
            )
        )
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.RestoreDefaults | QDialogButtonBox.StandardButton.Close
        )
        buttons.rejected.connect(self.reject)
        defaults = buttons.button(QDialogButtonBox.StandardButton.RestoreDefaults)
        assert defaults is not None
        defaults.setToolTip("As for a new user")
        defaults.setAutoDefault(False)
        defaults.clicked.connect(lambda: self._take(Preferences()))
        layout.addWidget(buttons)
        for box in (self.scheme, self.navigation, self.up_axis, self.device):
            box.currentIndexChanged.connect(self._on_change)
        for spin in (self.threads, self.cache, self.undo, self.autosave):
            spin.valueChanged.connect(self._on_change)
        self._fill()

    def set_used(self, text: str) -> None:
        """Says how much room the results take."""
        self._used.setText(text)

    def _take(self, preferences: Preferences) -> None:
        self._preferences = preferences
        self._fill()
        self.changed.emit(preferences)

    def _fill(self) -> None:
        self._filling, known = True, self._preferences
        for box, value in (
            (self.scheme, known.scheme),
            (self.navigation, known.navigation),
            (self.up_axis, known.up_axis),
            (self.device, known.device),
        ):
            box.setCurrentIndex(max(box.findData(value), 0))
        for spin, number in (
            (self.threads, known.threads),
            (self.cache, known.cache_mb),
            (self.undo, known.undo_depth),
            (self.autosave, known.autosave_s),
        ):
            spin.setValue(number)
        self._filling = False
        self._show_gestures()

    def _show_gestures(self) -> None:
        rows = STYLES[self._preferences.navigation].gestures()[:4]
        self._gestures.setText("\n".join(f"{drag}: {what}" for drag, what in rows))

    def _on_change(self) -> None:
        if self._filling:
            return
        self._preferences = Preferences(
            scheme=str(self.scheme.currentData()),
            navigation=str(self.navigation.currentData()),
            up_axis=int(self.up_axis.currentData()),
            device=str(self.device.currentData()),
            threads=self.threads.value(),
            cache_mb=self.cache.value(),
            undo_depth=self.undo.value(),
            autosave_s=self.autosave.value(),
        )
        self._show_gestures()
        self.changed.emit(self._preferences)


def _choice(entries: Mapping[str, str] | Mapping[int, str], tip: str) -> QComboBox:
    box = QComboBox()
    box.setToolTip(tip)
    for value, title in entries.items():
        box.addItem(title, value)
    return box


def _number(bounds: tuple[int, int], suffix: str, zero: str, tip: str) -> QSpinBox:
    spin = QSpinBox()
    spin.setRange(*bounds)
    spin.setSuffix(suffix)
    spin.setSpecialValueText(zero)
    spin.setKeyboardTracking(False)
    spin.setToolTip(tip)
    return spin


def _group(title: str, rows: Mapping[str, QWidget]) -> QGroupBox:
    box = QGroupBox(title)
    form = QFormLayout(box)
    for label, widget in rows.items():
        form.addRow(label, widget)
    return box
