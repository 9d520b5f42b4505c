"""Small pieces that the groups of a panel are made of."""

from __future__ import annotations

from collections.abc import Sequence

from PyQt6.QtGui import QStandardItemModel
from PyQt6.QtWidgets import QComboBox, QFormLayout, QGroupBox, QHBoxLayout, QLabel, QSlider, QWidget

_CELL = "padding-right: 5px; font-weight: normal;"


def group_form(box: QGroupBox) -> QFormLayout:
    """The rows of a group."""
    form = QFormLayout(box)
    form.setContentsMargins(8, 4, 8, 6)
    form.setVerticalSpacing(4)
    return form


def choice(entries: Sequence[tuple[str, object]], tip: str) -> QComboBox:
    """A choice of texts with data, that may be narrower than its texts."""
    combo = QComboBox()
    combo.setToolTip(tip)
    combo.setMinimumContentsLength(8)
    combo.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
    for text, data in entries:
        combo.addItem(text, data)
    return combo


def enable_choice(combo: QComboBox, row: int, on: bool) -> None:
    """Lets a row of a choice be chosen, or not."""
    model = combo.model()
    item = model.item(row) if isinstance(model, QStandardItemModel) else None
    if item is not None:
        item.setEnabled(on)


def note(tip: str) -> QLabel:
    """Text of several lines below a control."""
    label = QLabel()
    label.setWordWrap(True)
    label.setToolTip(tip)
    return label


def small_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table as rich text for a label; the first column aligns to the left."""
    lines = [
        "".join(
            f'<{tag} align="{"right" if number else "left"}" style="{_CELL}">{text}</{tag}>'
            for number, text in enumerate(cells)
        )
        for tag, cells in (("th", headings), *(("td", row) for row in rows))
    ]
    return "<table>" + "".join(f"<tr>{line}</tr>" for line in lines) + "</table>"


def in_row(*widgets: QWidget) -> QWidget:
    """Widgets side by side; sliders and choices take the room that is left."""
    holder = QWidget()
    row = QHBoxLayout(holder)
    row.setContentsMargins(0, 0, 0, 0)
    for widget in widgets:
        row.addWidget(widget, 1 if isinstance(widget, QSlider | QComboBox) else 0)
    if not any(isinstance(widget, QSlider | QComboBox) for widget in widgets):
        row.addStretch(1)
    return holder
