"""One editor per kind of setting; each shows a value, gives it back exactly, and says when it changed."""

from __future__ import annotations

import dataclasses
import enum
import types
import typing
from typing import Any

from PyQt6.QtCore import pyqtSignal
from PyQt6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from app.number_edit import NumberEdit, plain_number
from bake.errors import SettingsError
from bake.ground import Ground
from bake.setting_fields import option_name
from bake.settings import BakeSettings

_INT_MAX = 2**31 - 1

ALPHA_LOOKS = (("accurate", 0.03), ("smooth", 0.1), ("Sloan et al.", 1.0))
"""Named strengths of the regulariser."""


class SettingEditor(QWidget):
    """Edits one field of `BakeSettings`."""

    changed = pyqtSignal()

    def __init__(self, item: dataclasses.Field[Any]) -> None:
        super().__init__()
        self.item = item
        self.row = QHBoxLayout(self)
        self.row.setContentsMargins(0, 0, 0, 0)
        self.row.setSpacing(4)

    def value(self) -> Any:
        """The value as edited.

        Raises:
            SettingsError: what is typed is no value of this kind.
        """
        raise NotImplementedError

    def set_value(self, value: Any) -> None:
        """Shows a value without a signal."""
        raise NotImplementedError

    def _refuse(self, text: str, remedy: str) -> SettingsError:
        return SettingsError(f"{text!r} is no valid value", where=f"--{option_name(self.item.name)}", remedy=remedy)


class IntEditor(SettingEditor):
    """A whole number within bounds."""

    def __init__(self, item: dataclasses.Field[Any]) -> None:
        super().__init__(item)
        low, high = item.metadata["low"] or 0, item.metadata["high"]
        self._spin = _large_spin(low, high) if high > _INT_MAX else _spin(int(low), int(high))
        self._spin.valueChanged.connect(self.changed)
        self.row.addWidget(self._spin, 1)

    def value(self) -> int:
        """The number."""
        return int(self._spin.value())

    def set_value(self, value: int) -> None:
        """Shows a number."""
        with _silent(self._spin):
            self._spin.setValue(value)


class PairEditor(SettingEditor):
    """A minimum and a maximum."""

    def __init__(self, item: dataclasses.Field[Any]) -> None:
        super().__init__(item)
        low, high = int(item.metadata["low"]), int(item.metadata["high"])
        self._spins = (_spin(low, high), _spin(low, high))
        for spin in self._spins:
            spin.valueChanged.connect(self.changed)
        self.row.addWidget(self._spins[0], 1)
        self.row.addWidget(QLabel("to"))
        self.row.addWidget(self._spins[1], 1)

    def value(self) -> tuple[int, int]:
        """Minimum and maximum."""
        return self._spins[0].value(), self._spins[1].value()

    def set_value(self, value: tuple[int, int]) -> None:
        """Shows both."""
        for spin, number in zip(self._spins, value, strict=True):
            with _silent(spin):
                spin.setValue(number)


class FloatEditor(SettingEditor):
    """A number with its unit; optionally absent."""

    def __init__(self, item: dataclasses.Field[Any], *, optional: bool = False) -> None:
        super().__init__(item)
        self._present = QCheckBox() if optional else None
        self._edit = NumberEdit(item.metadata["unit"])
        self._edit.changed.connect(self.changed)
        if self._present is not None:
            self._present.setToolTip(f"Set a {item.metadata['title'].lower()}")
            self._present.toggled.connect(self._edit.setEnabled)
            self._present.toggled.connect(self.changed)
            self._edit.setEnabled(False)
            self._edit.set_value(item.metadata["suggested"])
            self.row.addWidget(self._present)
        self.row.addWidget(self._edit, 1)

    def value(self) -> float | None:
        """The number, or None where it is switched off."""
        if self._present is not None and not self._present.isChecked():
            return None
        try:
            return self._edit.value()
        except ValueError:
            raise self._refuse(self._edit.text(), "type a number") from None

    def set_value(self, value: float | None) -> None:
        """Shows a number, or none."""
        if self._present is not None:
            with _silent(self._present):
                self._present.setChecked(value is not None)
            self._edit.setEnabled(value is not None)
        if value is not None:
            self._edit.set_value(value)


class AlphaEditor(FloatEditor):
    """The regulariser's weight, with its named looks."""

    def __init__(self, item: dataclasses.Field[Any]) -> None:
        super().__init__(item)
        self._looks = _narrow_combo()
        for name, alpha in ALPHA_LOOKS:
            self._looks.addItem(name, alpha)
        self._looks.addItem("custom")
        self._looks.activated.connect(self._on_look)
        self.changed.connect(self._show_look)
        self.row.insertWidget(0, self._looks, 2)

    def set_value(self, value: float | None) -> None:
        """Shows a weight and the look it is known by."""
        super().set_value(value)
        self._show_look()

    def _on_look(self, index: int) -> None:
        alpha = self._looks.itemData(index)
        if alpha is not None:
            super().set_value(alpha)
            self.changed.emit()

    def _show_look(self) -> None:
        try:
            alpha = self.value()
        except SettingsError:
            alpha = None
        names = [known for _, known in ALPHA_LOOKS]
        self._looks.setCurrentIndex(names.index(alpha) if alpha in names else len(names))


class FloatsEditor(SettingEditor):
    """Numbers separated by commas."""

    def __init__(self, item: dataclasses.Field[Any]) -> None:
        super().__init__(item)
        self._line = QLineEdit()
        self._line.textEdited.connect(self.changed)
        self.row.addWidget(self._line, 1)
        if item.metadata["unit"]:
            self.row.addWidget(QLabel(item.metadata["unit"]))

    def value(self) -> tuple[float, ...]:
        """The numbers."""
        try:
            return tuple(float(part) for part in self._line.text().split(",") if part.strip())
        except ValueError:
            raise self._refuse(self._line.text(), "separate numbers by commas, such as 2, 300") from None

    def set_value(self, value: tuple[float, ...]) -> None:
        """Shows the numbers."""
        self._line.setText(", ".join(plain_number(number) for number in value))


class ChoiceEditor(SettingEditor):
    """One of the members of an enumeration."""

    def __init__(self, item: dataclasses.Field[Any], members: type[enum.StrEnum]) -> None:
        super().__init__(item)
        self._combo = _narrow_combo()
        for member in members:
            self._combo.addItem(member.value.replace("-", " ").capitalize(), member)
        self._combo.currentIndexChanged.connect(self.changed)
        self.row.addWidget(self._combo, 1)

    def value(self) -> enum.StrEnum:
        """The member."""
        return self._combo.currentData()

    def set_value(self, value: enum.StrEnum) -> None:
        """Shows a member."""
        with _silent(self._combo):
            self._combo.setCurrentIndex(self._combo.findData(value))


class FlagEditor(SettingEditor):
    """Yes or no."""

    def __init__(self, item: dataclasses.Field[Any]) -> None:
        super().__init__(item)
        self._box = QCheckBox()
        self._box.toggled.connect(self.changed)
        self.row.addWidget(self._box)
        self.row.addStretch(1)

    def value(self) -> bool:
        """Whether it is ticked."""
        return self._box.isChecked()

    def set_value(self, value: bool) -> None:
        """Ticks it or not."""
        with _silent(self._box):
            self._box.setChecked(value)


class TextEditor(SettingEditor):
    """Free text with suggestions."""

    def __init__(self, item: dataclasses.Field[Any], suggestions: tuple[str, ...]) -> None:
        super().__init__(item)
        self._combo = _narrow_combo()
        self._combo.setEditable(True)
        self._combo.addItems(suggestions)
        self._combo.editTextChanged.connect(self.changed)
        self.row.addWidget(self._combo, 1)

    def value(self) -> str:
        """The text."""
        return self._combo.currentText().strip()

    def set_value(self, value: str) -> None:
        """Shows a text."""
        with _silent(self._combo):
            self._combo.setEditText(value)


class GroundEditor(SettingEditor):
    """The ground plane: off, or its axis, scale and offset."""

    def __init__(self, item: dataclasses.Field[Any]) -> None:
        super().__init__(item)
        self._axis = _narrow_combo()
        self._axis.addItems(["none", *Ground.AXES])
        self._axis.setToolTip("The side that faces up, away from the ground")
        self._scale, self._offset = NumberEdit("×"), NumberEdit("↕")
        self._scale.setToolTip("Edges of the plane, in extents of the scene")
        self._offset.setToolTip("Gap below the scene, in extents of the scene along the axis")
        self._axis.currentIndexChanged.connect(self._on_axis)
        self.row.addWidget(self._axis, 2)
        for edit in (self._scale, self._offset):
            edit.changed.connect(self.changed)
            self.row.addWidget(edit, 2)
        self.set_value(None)

    def value(self) -> Ground | None:
        """The plane, or None."""
        axis = self._axis.currentIndex() - 1
        if axis < 0:
            return None
        text = f"{Ground.AXES[axis]}:{self._scale.text()}:{self._offset.text()}"
        return Ground.parse(text)

    def set_value(self, value: Ground | None) -> None:
        """Shows a plane, or none."""
        with _silent(self._axis):
            self._axis.setCurrentIndex(0 if value is None else value.axis + 1)
        shown = Ground() if value is None else value
        self._scale.set_value(shown.scale)
        self._offset.set_value(shown.offset)
        self._show_parts()

    def _on_axis(self) -> None:
        self._show_parts()
        self.changed.emit()

    def _show_parts(self) -> None:
        for edit in (self._scale, self._offset):
            edit.setVisible(self._axis.currentIndex() > 0)


class SkipEditor(SettingEditor):
    """Which stages to leave out."""

    def __init__(self, item: dataclasses.Field[Any]) -> None:
        super().__init__(item)
        self._boxes = [QCheckBox(stage) for stage in BakeSettings.SKIPPABLE]
        columns = [QWidget() for _ in range(2)]
        layouts = [QVBoxLayout(column) for column in columns]
        for number, box in enumerate(self._boxes):
            box.setToolTip(f"Leave out the stage {box.text()}")
            box.toggled.connect(self.changed)
            layouts[number % 2].addWidget(box)
        for column, layout in zip(columns, layouts, strict=True):
            layout.setContentsMargins(0, 0, 0, 0)
            layout.addStretch(1)
            self.row.addWidget(column)

    def value(self) -> tuple[str, ...]:
        """The stages that are ticked."""
        return tuple(box.text() for box in self._boxes if box.isChecked())

    def set_value(self, value: tuple[str, ...]) -> None:
        """Ticks stages."""
        for box in self._boxes:
            with _silent(box):
                box.setChecked(box.text() in value)


def editor_for(item: dataclasses.Field[Any], kind: Any) -> SettingEditor:
    """The editor for a field of `BakeSettings` by its type.

    Raises:
        TypeError: there is no editor for that type; a new kind of setting needs one.
    """
    suggestions = {"device": ("auto", "cpu", "cuda", "cuda:0"), "regions": ("scene", "auto", "none")}
    if item.name == "alpha":
        return AlphaEditor(item)
    if item.name == "skip":
        return SkipEditor(item)
    optional = typing.get_origin(kind) is types.UnionType
    if optional:
        kind = next(part for part in typing.get_args(kind) if part is not types.NoneType)
    if kind is Ground:
        return GroundEditor(item)
    if typing.get_origin(kind) is tuple:
        return FloatsEditor(item) if Ellipsis in typing.get_args(kind) else PairEditor(item)
    if isinstance(kind, type) and issubclass(kind, enum.StrEnum):
        return ChoiceEditor(item, kind)
    if kind is bool:
        return FlagEditor(item)
    if kind is int:
        return IntEditor(item)
    if kind is float:
        return FloatEditor(item, optional=optional)
    if kind is str:
        return TextEditor(item, suggestions.get(item.name, ()))
    raise TypeError(f"no editor for {item.name}: {kind}")


def _narrow_combo() -> QComboBox:
    """A combo box that does not demand the width of its longest entry."""
    combo = QComboBox()
    combo.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
    combo.setMinimumContentsLength(5)
    return combo


def _spin(low: int, high: int) -> QSpinBox:
    spin = QSpinBox()
    spin.setRange(low, high)
    spin.setGroupSeparatorShown(True)
    spin.setMinimumWidth(56)
    return spin


def _large_spin(low: float, high: float) -> QDoubleSpinBox:
    spin = QDoubleSpinBox()
    spin.setDecimals(0)
    spin.setMinimumWidth(56)
    spin.setRange(low, high)
    return spin


class _silent:
    """Keeps a widget from signalling while it is set by the program."""

    def __init__(self, widget: QWidget) -> None:
        self._widget = widget

    def __enter__(self) -> None:
        self._before = self._widget.blockSignals(True)

    def __exit__(self, *_: object) -> None:
        self._widget.blockSignals(self._before)
