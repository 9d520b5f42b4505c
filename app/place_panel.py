"""The panel of the selected objects: where they stand, what they are baked with, and what can be done with them."""

from __future__ import annotations

from collections.abc import Sequence

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtGui import QAction
from PyQt6.QtWidgets import QGridLayout, QGroupBox, QHBoxLayout, QLabel, QToolButton, QVBoxLayout, QWidget

from app.elided_label import ElidedLabel
from app.number_edit import NumberEdit
from bake.types import ObjectKeys, Placing, Role

_EMPTY = "Select an object to move it, or to bake it in another way. Changes are kept in the scene's side file."
_ROWS = (
    ("origin", "Place", "m", "Where the object's own origin stands in the world"),
    ("rotate", "Turned", "°", "Turned about the world's axes, X first, on top of what the file says"),
    ("scale", "Scaled", "x", "Factors along the object's own axes, on top of what the file says"),
)
_KEYS = (
    ("samples", "Samples", "a face", "Samples on each face; empty: as many as the bake's settings say"),
    ("alpha", "Smoothing α", "", "Own smoothing of the values; empty: that of the bake's settings"),
    ("offset", "Offset", "m", "How much farther above the faces rays start; empty: nothing"),
)


class PlacePanel(QWidget):
    """Shows one object's place and keys, or what several have in common; asks for changes."""

    placed = pyqtSignal(str, int, float)  # row, axis, number
    key_set = pyqtSignal(str, object)  # key, number or None

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._name = ElidedLabel(mode=Qt.TextElideMode.ElideLeft)
        self._what = QLabel()
        self._what.setWordWrap(True)
        self.place = QGroupBox("Place")
        self.keys = QGroupBox("Baked with")
        self.fields: dict[tuple[str, int], NumberEdit] = {}
        self.key_fields: dict[str, NumberEdit] = {}
        self._shown: dict[object, str] = {}
        self._buttons = QGridLayout()
        layout = QVBoxLayout(self)
        layout.setContentsMargins(6, 6, 6, 6)
        for widget in (self._name, self._what):
            layout.addWidget(widget)
        self._fill_place()
        self._fill_keys()
        layout.addWidget(self.place)
        layout.addLayout(self._buttons)
        layout.addWidget(self.keys)
        layout.addStretch(1)
        self.show_none()

    def add_buttons(self, actions: Sequence[QAction]) -> None:
        """Puts actions below the place, two a row."""
        for number, action in enumerate(actions):
            button = QToolButton()
            button.setDefaultAction(action)
            button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
            button.setSizePolicy(self.sizePolicy().Policy.Expanding, self.sizePolicy().Policy.Fixed)
            self._buttons.addWidget(button, number // 2, number % 2)

    def show_none(self, text: str = _EMPTY) -> None:
        """Nothing is selected, or it cannot be changed."""
        self._name.hide()
        self._what.setText(text)
        for group in (self.place, self.keys):
            group.setEnabled(False)
        self._clear()

    def show_object(self, path: str, role: Role, note: str, placing: Placing | None, keys: ObjectKeys) -> None:
        """Shows one object.

        Args:
            path: Its path.
            role: What it is to the bake.
            note: How it stands to the result; may be empty.
            placing: Where it is; None if it cannot be moved.
            keys: Its own settings.
        """
        self._name.setVisible(True)
        self._name.setText(path)
        self._name.setToolTip(path)
        self._what.setText(f"Role {role.value}" + (f"; {note}" if note else ""))
        self.place.setEnabled(placing is not None)
        self.keys.setEnabled(True)
        self._clear()
        if placing is not None:
            for row, *_ in _ROWS:
                for axis, value in enumerate(getattr(placing, row)):
                    self._set((row, axis), self.fields[row, axis], round(value, 6))
        self._show_keys([keys])

    def show_several(self, count: int, note: str, keys: Sequence[ObjectKeys]) -> None:
        """Shows what several objects have in common; their places stay empty."""
        self._name.hide()
        self._what.setText(f"{count:,} objects" + (f"; {note}" if note else ""))
        self.place.setEnabled(False)
        self.keys.setEnabled(True)
        self._clear()
        self._show_keys(keys)

    def _show_keys(self, keys: Sequence[ObjectKeys]) -> None:
        for name, *_ in _KEYS:
            values = {getattr(item, name) for item in keys}
            common = next(iter(values)) if len(values) == 1 else None
            line = self.key_fields[name].focusProxy()
            if common is not None:
                self._set(name, self.key_fields[name], common)
            if line is not None:
                line.setPlaceholderText("different" if len(values) > 1 else "as set")  # type: ignore[attr-defined]

    def _set(self, key: object, field: NumberEdit, value: float) -> None:
        field.set_value(value)
        self._shown[key] = field.text()

    def _clear(self) -> None:
        self._shown.clear()
        for field in (*self.fields.values(), *self.key_fields.values()):
            field.clear()

    def _fill_place(self) -> None:
        grid = QGridLayout(self.place)
        grid.setHorizontalSpacing(4)
        for axis in range(3):
            title = QLabel("XYZ"[axis])
            title.setAlignment(Qt.AlignmentFlag.AlignHCenter)
            grid.addWidget(title, 0, axis + 1)
        for number, (row, name, unit, tip) in enumerate(_ROWS, start=1):
            label = QLabel(f"{name} [{unit}]")
            label.setToolTip(tip)
            grid.addWidget(label, number, 0)
            for axis in range(3):
                field = NumberEdit()
                field.setToolTip(f"{tip}: {'XYZ'[axis]}")
                field.settled.connect(lambda row=row, axis=axis: self._on_placed(row, axis))
                self.fields[row, axis] = field
                grid.addWidget(field, number, axis + 1)

    def _fill_keys(self) -> None:
        rows = QVBoxLayout(self.keys)
        for name, title, unit, tip in _KEYS:
            field = NumberEdit(unit)
            field.setToolTip(tip)
            field.settled.connect(lambda name=name: self._on_key(name))
            self.key_fields[name] = field
            label = QLabel(title)
            label.setToolTip(tip)
            label.setMinimumWidth(90)
            line = QHBoxLayout()
            line.addWidget(label)
            line.addWidget(field, 1)
            rows.addLayout(line)

    def _on_placed(self, row: str, axis: int) -> None:
        field = self.fields[row, axis]
        if field.text() == self._shown.get((row, axis), ""):
            return
        try:
            value = field.value()
        except ValueError:
            field.set_text(self._shown.get((row, axis), ""))
            return
        self._shown[row, axis] = field.text()
        self.placed.emit(row, axis, value)

    def _on_key(self, name: str) -> None:
        field = self.key_fields[name]
        if field.text() == self._shown.get(name, ""):
            return
        try:
            value = None if not field.text() else int(field.value()) if name == "samples" else field.value()
        except ValueError:
            field.set_text(self._shown.get(name, ""))
            return
        self._shown[name] = field.text()
        self.key_set.emit(name, value)
