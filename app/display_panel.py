"""What is shown on the surface and how: quantity, range, colours, blend, game storage, look."""

from __future__ import annotations

import numpy as np
from PyQt6.QtCore import Qt
from PyQt6.QtWidgets import (
    QButtonGroup,
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QGridLayout,
    QGroupBox,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QRadioButton,
    QVBoxLayout,
    QWidget,
)

from app.curve_widget import CurveWidget
from app.document import Document
from app.range_widget import RangeWidget
from viewer.colormaps import VALUE_MAPS
from viewer.display import Display
from viewer.fields import Quantity, SurfaceField, distance_label
from viewer.histogram import Histogram, clipped_shares, histogram_of, robust_range
from viewer.inspections import Inspection
from viewer.tone import GAME_BITS, SHORT_SHARE, RemapCurve


class DisplayPanel(QWidget):
    """Edits the document's `Display`."""

    def __init__(self, document: Document, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._document = document
        self._field: SurfaceField | None = None
        self._filling = False
        self._histogram: Histogram | None = None
        self._histogram_key: tuple[SurfaceField | None, float, float] = (None, 0.0, 1.0)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(6, 6, 6, 6)
        layout.setSpacing(6)
        layout.addWidget(self._build_quantity())
        layout.addWidget(self._build_range())
        layout.addWidget(self._build_blend())
        layout.addWidget(self._build_look())
        layout.addStretch(1)
        document.display_changed.connect(self.refresh)
        document.field_changed.connect(self.refresh)
        document.decorators_changed.connect(self.refresh)
        document.result_changed.connect(self._rebuild_choices)
        self._rebuild_choices()

    def _build_quantity(self) -> QWidget:
        box = QGroupBox("Show")
        self._choices = QButtonGroup(self)
        self._choices.idClicked.connect(self._on_choice)
        self._choice_grid = QGridLayout(box)
        self._choice_grid.setContentsMargins(8, 4, 8, 6)
        self._choice_grid.setVerticalSpacing(2)
        self._meanings: list[tuple[Quantity, int]] = []
        self.inspection = QComboBox()
        self.inspection.setToolTip("Look at something else than AO: what the bake is made of, and how sure it is")
        self.inspection.addItem("Inspect …", None)
        for kind in Inspection:
            self.inspection.addItem(kind.heading, kind)
            self.inspection.setItemData(self.inspection.count() - 1, kind.meaning, Qt.ItemDataRole.ToolTipRole)
        self.inspection.activated.connect(self._on_inspection)
        return box

    def _build_range(self) -> QWidget:
        box = QGroupBox("Range and colours")
        self.range = RangeWidget()
        self.range.range_changed.connect(self._on_range)
        self.range.reset_requested.connect(self._on_full_range)
        self._fit = QPushButton("Fit")
        self._fit.setToolTip("Range of the values in view, without the outermost 0.1 % of the vertices at each end")
        self._fit.clicked.connect(self._on_fit)
        self._full = QPushButton("Full")
        self._full.setToolTip("All of 0 to 1, so that two bakes can be compared")
        self._full.clicked.connect(self._on_full_range)
        self._map = QComboBox()
        self._map.setToolTip("Colours of the values; differences are always blue – white – orange")
        for color_map in VALUE_MAPS:
            self._map.addItem(color_map.title, color_map.name)
        self._map.currentIndexChanged.connect(lambda: self._change(color_map=self._map.currentData()))
        self._statistics = QLabel()
        self._statistics.setToolTip("Of the vertices in view")
        row = QHBoxLayout()
        row.addWidget(self._map, 1)
        row.addWidget(self._fit)
        row.addWidget(self._full)
        column = QVBoxLayout(box)
        column.setContentsMargins(4, 4, 4, 6)
        column.addWidget(self.range)
        column.addLayout(row)
        column.addWidget(self._statistics)
        return box

    def _build_blend(self) -> QWidget:
        self._blend_box = QGroupBox("Blend and remap")
        self._short = _percent_spin()
        self._short.setToolTip("Share of the shortest distance; the longest has the rest")
        self._short.valueChanged.connect(lambda value: self._change(short_share=value / 100.0))
        self._mix = QLabel()
        self._exponent = QDoubleSpinBox()
        self._exponent.setRange(0.1, 10.0)
        self._exponent.setSingleStep(0.1)
        self._exponent.setToolTip("Power applied after the curve: above 1 darkens, below 1 brightens")
        self._exponent.valueChanged.connect(self._on_exponent)
        self.curve = CurveWidget()
        self.curve.curve_changed.connect(lambda curve: self._change(curve=curve))
        reset = QPushButton("Reset")
        reset.setToolTip(f"{1 - SHORT_SHARE:.0%} long and {SHORT_SHARE:.0%} short, straight curve")
        reset.clicked.connect(lambda: self._change(short_share=SHORT_SHARE, curve=RemapCurve()))
        self.game = QCheckBox(f"As the game stores it: {GAME_BITS} bits, dithered")
        self.game.setToolTip(
            f"{1 << GAME_BITS} levels a pixel with ordered dither, after interpolation across the triangle (G)"
        )
        self.game.toggled.connect(lambda on: self._change(game=on))
        first, second = QHBoxLayout(), QHBoxLayout()
        first.addWidget(QLabel("Short"))
        first.addWidget(self._short)
        first.addWidget(self._mix, 1)
        second.addWidget(QLabel("Exponent"))
        second.addWidget(self._exponent)
        second.addStretch(1)
        second.addWidget(reset)
        column = QVBoxLayout(self._blend_box)
        column.setContentsMargins(6, 4, 6, 6)
        column.setSpacing(4)
        column.addLayout(first)
        column.addWidget(self.curve)
        column.addLayout(second)
        column.addWidget(self.game)
        return self._blend_box

    def _build_look(self) -> QWidget:
        box = QGroupBox("Look")
        self._edges = QCheckBox("Edges")
        self._edges.setToolTip("Edges of the triangles (E)")
        self._edges.toggled.connect(lambda on: self._change(edges=on))
        self._shading = QCheckBox("Shading")
        self._shading.setToolTip("A light at the camera shapes the surface; colours are then no longer exact (L)")
        self._shading.toggled.connect(lambda on: self._change(shading=on))
        self._back = QCheckBox("Hide back faces")
        self._back.setToolTip("Look into closed rooms from outside (B)")
        self._back.toggled.connect(lambda on: self._change(back_faces=not on))
        row = QHBoxLayout(box)
        row.setContentsMargins(6, 4, 6, 6)
        for widget in (self._edges, self._shading, self._back):
            row.addWidget(widget)
        row.addStretch(1)
        return box

    def refresh(self) -> None:
        """Follows the document."""
        self._filling = True
        try:
            self._fill(self._document.display)
        finally:
            self._filling = False

    def _fill(self, display: Display) -> None:
        document = self._document
        field = self._field = document.shown()
        key = (display.quantity, display.column if display.quantity is Quantity.DISTANCE else 0)
        inspecting = display.quantity is Quantity.INSPECTION
        self.inspection.setCurrentIndex(self.inspection.findData(display.inspection) if inspecting else 0)
        self.inspection.setEnabled(document.result is not None)
        if inspecting:
            self._choices.setExclusive(False)  # or the last choice would stay checked
        for number, meaning in enumerate(self._meanings):
            button = self._choices.button(number)
            assert button is not None
            same = meaning == key or (meaning[0] is display.quantity and display.quantity is Quantity.DIFFERENCE)
            button.setChecked(same)
            if meaning[0] is Quantity.DIFFERENCE:
                button.setEnabled(document.other is not None)
        self._choices.setExclusive(True)
        for widget in (self.range, self._fit, self._full, self._map):
            widget.setEnabled(field is not None and field.rgb is None)
        self._map.setEnabled(field is not None and not field.inspected)
        self._blend_box.setEnabled(document.result is not None)
        self._map.setCurrentIndex(max(self._map.findData(display.color_map), 0))
        self._short.setValue(100.0 * display.short_share)
        self._exponent.setValue(display.curve.exponent)
        self.curve.set_curve(display.curve)
        self.game.setChecked(display.game)
        self._edges.setChecked(display.edges)
        self._shading.setChecked(display.shading)
        self._back.setChecked(not display.back_faces)
        self._fill_range(field, display)

    def _fill_range(self, field: SurfaceField | None, display: Display) -> None:
        if field is None or field.rgb is not None:
            self.range.set_histogram(None, VALUE_MAPS[0])
            self.range.set_range(0.0, 1.0)
            self._statistics.setText("")
            return
        # Every vertex counts the same: by area a wide open backdrop would hide all that matters.
        weights = None
        low, high = display.range_for(field)
        least, most = (0.0, 1.0)
        if field.color_map.diverging or field.inspected:
            least, most = min(low, field.low), max(high, field.high)
        key = (field, least, most)
        if self._histogram is None or self._histogram_key[0] is not field or self._histogram_key[1:] != key[1:]:
            self._histogram, self._histogram_key = histogram_of(field.values, weights, least, most), key
        histogram = self._histogram
        self.range.set_histogram(histogram, display.map_for(field))
        self.range.set_range(low, high, clipped_shares(field.values, weights, low, high))
        self._statistics.setText(
            "no values"
            if histogram.is_empty
            else f"mean {_rounded(histogram.mean)}   min {_rounded(histogram.minimum)}   "
            f"max {_rounded(histogram.maximum)}"
        )

    def _rebuild_choices(self) -> None:
        for button in self._choices.buttons():
            self._choices.removeButton(button)
            self._choice_grid.removeWidget(button)
            button.deleteLater()
        result = self._document.result
        distances = result.settings.column_distances if result is not None else ()
        entries: list[tuple[str, str, Quantity, int]] = []
        if result is not None:
            entries.append(("Blended", "Longest and shortest distance mixed, then remapped (0)", Quantity.BLEND, 0))
            for column, distance in enumerate(distances):
                label = distance_label(distance)
                tip = f"AO where a blocker at {label} counts half (N steps through the distances)"
                entries.append((f"AO at {label}", tip, Quantity.DISTANCE, column))
            tip = "This mapping minus the other; open the comparison first (C)"
            entries.append(("Difference", tip, Quantity.DIFFERENCE, 0))
        entries.append(("Geometry", "The surface without values (T)", Quantity.GEOMETRY, 0))
        self._meanings = [(quantity, column) for _, _, quantity, column in entries]
        for number, (text, tip, _, _) in enumerate(entries):
            button = QRadioButton(text)
            button.setToolTip(tip)
            self._choices.addButton(button, number)
            self._choice_grid.addWidget(button, number // 2, number % 2)
        self._choice_grid.addWidget(self.inspection, len(entries) // 2 + 1, 0, 1, 2)
        shortest, longest = (min(distances), max(distances)) if distances else (2.0, 300.0)
        self._mix.setText(f"at {distance_label(shortest)}, rest at {distance_label(longest)}")
        self.refresh()

    def _change(self, **changes: object) -> None:
        if not self._filling:
            self._document.set_display(self._document.display.replaced(**changes))

    def _on_choice(self, number: int) -> None:
        quantity, column = self._meanings[number]
        if quantity is Quantity.DISTANCE:
            self._change(quantity=quantity, column=column)
        else:
            self._change(quantity=quantity)

    def _on_inspection(self, _row: int) -> None:
        kind = self.inspection.currentData()
        if kind is None:
            self._change(quantity=Quantity.BLEND)
        else:
            self._change(quantity=Quantity.INSPECTION, inspection=Inspection(kind), inspected_range=None)

    def _on_exponent(self, value: float) -> None:
        self._change(curve=RemapCurve(self._document.display.curve.points, value))

    def _on_range(self, low: float, high: float) -> None:
        if self._field is not None:
            self._document.set_display(self._document.display.with_range(self._field, low, high))

    def _on_fit(self) -> None:
        if self._field is not None:
            self._on_range(*robust_range(self._field.values, np.ones(len(self._field.values))))

    def _on_full_range(self) -> None:
        if self._field is not None:
            self._document.set_display(self._document.display.with_range(self._field, None, None))


def _rounded(value: float) -> str:
    """Three decimals, without a sign on zero."""
    return f"{round(value, 3) + 0.0:.3f}"


def _percent_spin() -> QDoubleSpinBox:
    spin = QDoubleSpinBox()
    spin.setRange(0.0, 100.0)
    spin.setDecimals(1)
    spin.setSuffix(" %")
    return spin
