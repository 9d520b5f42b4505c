"""The form of all bake settings, generated from the fields of `BakeSettings` and their metadata."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

import dataclasses
import typing

from PyQt6.QtCore import QEvent, QObject, Qt, pyqtSignal
from PyQt6.QtWidgets import (
    QAbstractSpinBox,
    QComboBox,
    QFormLayout,
    QLabel,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from app.setting_editors import SettingEditor, editor_for
from bake.errors import SettingsError
from bake.setting_fields import option_name
from bake.settings import QUALITY_PRESETS, BakeSettings

ORDER = (
    "quality", "rays", "samples_per_face", "sample_spacing", "distances", "mapping", "alpha", "back_face_threshold",
    "kernel", "max_distance", "ground", "seed", "device", "regions",
)  # fmt: skip
"""What comes first; fields that are not named follow in their own order."""


class SettingsForm(QWidget):
    """Edits `BakeSettings`; fields that experts alone need are folded away."""

    changed = pyqtSignal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._editors: dict[str, SettingEditor] = {}
        self._messages: dict[str, QLabel] = {}
        hints = typing.get_type_hints(BakeSettings)
        items = {item.name: item for item in dataclasses.fields(BakeSettings)}
        ordered = [items[name] for name in ORDER if name in items]
        ordered += [item for name, item in items.items() if name not in ORDER]
        self._advanced = QWidget()
        self._fold = QToolButton()
        self._fold.setText("Advanced")
        self._fold.setToolTip("Settings that are seldom needed")
        self._fold.setCheckable(True)
        self._fold.setAutoRaise(True)
        self._fold.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self._fold.toggled.connect(self._on_fold)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addLayout(self._rows([item for item in ordered if not item.metadata["advanced"]], hints))
        layout.addWidget(self._fold)
        self._advanced.setLayout(self._rows([item for item in ordered if item.metadata["advanced"]], hints))
        layout.addWidget(self._advanced)
        layout.addStretch(1)
        self._on_fold(False)
        self.set_settings(BakeSettings())

    def editor(self, field_name: str) -> SettingEditor:
        """The editor of a field."""
        return self._editors[field_name]

    def settings(self) -> BakeSettings:
        """The settings as edited.

        Raises:
            SettingsError: a field has no valid value, or fields contradict each other.
        """
        return BakeSettings(**{name: editor.value() for name, editor in self._editors.items()})

    def set_settings(self, settings: BakeSettings) -> None:
        """Shows settings without a signal."""
        for name, editor in self._editors.items():
            editor.set_value(getattr(settings, name))
        self.validate()

    def validate(self) -> SettingsError | None:
        """Shows what is wrong beside the field at fault; returns it, or None."""
        error = None
        try:
            self.settings()
        except SettingsError as caught:
            error = caught
        for name, message in self._messages.items():
            at_fault = error is not None and error.where == f"--{option_name(name)}"
            message.setVisible(at_fault)
            if at_fault and error is not None:
                message.setText(f"{error.what}; {error.remedy}" if error.remedy else error.what)
                if self._editors[name].item.metadata["advanced"]:
                    self._fold.setChecked(True)
        return error

    def eventFilter(self, watched: QObject | None, event: QEvent | None) -> bool:
        """The wheel scrolls the panel; it changes a value only in the editor that has the focus."""
        if (
            event is not None
            and event.type() is QEvent.Type.Wheel
            and isinstance(watched, QWidget)
            and not watched.hasFocus()
        ):
            event.ignore()
            return True
        return super().eventFilter(watched, event)

    def _rows(self, items: list[dataclasses.Field[typing.Any]], hints: dict[str, typing.Any]) -> QFormLayout:
        form = QFormLayout()
        form.setContentsMargins(0, 0, 0, 0)
        form.setVerticalSpacing(5)
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        for item in items:
            editor = editor_for(item, hints[item.name])
            label = QLabel(item.metadata["title"])
            tip = tooltip_of(item)
            for widget in (label, editor):
                widget.setToolTip(tip)
            label.setBuddy(editor)
            for child in (*editor.findChildren(QAbstractSpinBox), *editor.findChildren(QComboBox)):
                child.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
                child.installEventFilter(self)
                if not child.toolTip():
                    child.setToolTip(tip)
            message = QLabel()
            message.setWordWrap(True)
            message.setObjectName("fieldError")
            message.hide()
            cell = QWidget()
            column = QVBoxLayout(cell)
            column.setContentsMargins(0, 0, 0, 0)
            column.setSpacing(1)
            column.addWidget(editor)
            column.addWidget(message)
            form.addRow(label, cell)
            self._editors[item.name], self._messages[item.name] = editor, message
            editor.changed.connect(lambda name=item.name: self._on_edit(name))
        return form

    def _on_edit(self, name: str) -> None:
        if name == "quality":
            for preset_name, value in QUALITY_PRESETS[self._editors["quality"].value()].items():
                self._editors[preset_name].set_value(value)
        self.validate()
        self.changed.emit()

    def _on_fold(self, open_: bool) -> None:
        self._fold.setArrowType(Qt.ArrowType.DownArrow if open_ else Qt.ArrowType.RightArrow)
        self._advanced.setVisible(open_)


def tooltip_of(item: dataclasses.Field[typing.Any]) -> str:
    """Help, unit and bounds of a setting."""
    data = item.metadata
    unit = f" {data['unit']}" if data["unit"] else ""
    low = f"above {data['above']:g}" if data["above"] is not None else None
    if low is None and data["low"] is not None:
        low = f"{data['low']:g}"
    lines = [data["help"]]
    if low is not None and data["high"] is not None:
        lines.append(f"{low} to {data['high']:g}{unit}")
    if data["affects"] == "solve":
        lines.append("Does not change the rays, only what is made of them")
    elif data["affects"] == "regions":
        lines.append("Does not change the rays, only the models of the regions")
    lines.append(f"Command line: --{option_name(item.name)}")
    return "\n".join(lines)
