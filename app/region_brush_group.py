"""The validity brush: which grid points of a region count, switched by hand and kept in a region file."""

from __future__ import annotations

import numpy as np
from PyQt6.QtCore import pyqtSignal
from PyQt6.QtWidgets import QCheckBox, QDoubleSpinBox, QGroupBox, QPushButton, QRadioButton, QWidget

from app.group_parts import group_form, in_row, note
from app.region_models import reachable_bits
from app.region_state import RegionState, Tool
from viewer.region_marks import highlighted
from viewer.region_values import POINTS


class RegionBrushGroup(QGroupBox):
    """Edits the state's brush; asks for whole regions to be switched and for the file to be written."""

    switch_asked = pyqtSignal(object, str)  # bits of all points, what it is called
    save_asked = pyqtSignal()

    def __init__(self, state: RegionState, parent: QWidget | None = None) -> None:
        super().__init__("Validity", parent)
        self._state = state
        self._filling = False
        self.brush = QCheckBox("Brush in the view")
        self.brush.setToolTip(
            "Drag over points of the selected region to switch them; Ctrl switches the other way (V).\n"
            "The region is fitted again at once; points that were never traced count from the next bake on."
        )
        self.brush.toggled.connect(lambda on: None if self._filling else state.use_tool(Tool.BRUSH, on))
        self.off, self.on = QRadioButton("off"), QRadioButton("on")
        self.off.setToolTip("The brush takes points out: they count as unreachable (X switches)")
        self.on.setToolTip("The brush puts points back in (X switches)")
        self.on.toggled.connect(lambda on: None if self._filling else state.set_brush(on=on))
        self.radius = QDoubleSpinBox()
        self.radius.setRange(0.0, 1000.0)
        self.radius.setDecimals(2)
        self.radius.setSingleStep(0.1)
        self.radius.setSuffix(" m")
        self.radius.setToolTip("All points this near to the one under the cursor are switched; 0 for that one alone")
        self.radius.valueChanged.connect(lambda value: None if self._filling else state.set_brush(radius=value))
        self._all_off = self._button("All off", "Switch every point of the selected region off", False)
        self._all_on = self._button("All on", "Switch every point of the selected region on", True)
        self._baked = self._button("As baked", "Back to the bits that the result was baked with", None)
        self._counts = note("Points switched by hand since the bake")
        self._save = QPushButton("Save file …")
        self._save.setToolTip("Write boxes, links and validity as JSON, and let the next bake use it")
        self._save.clicked.connect(self.save_asked)
        form = group_form(self)
        form.addRow(in_row(self.brush, self.off, self.on))
        form.addRow("Radius", self.radius)
        form.addRow(in_row(self._all_off, self._all_on))
        form.addRow(self._counts)
        form.addRow(in_row(self._baked, self._save))
        for event in (state.opened, state.bits_changed, state.view_changed, state.tool_changed):
            event.connect(self.refresh)
        self.refresh()

    def _button(self, text: str, tip: str, on: bool | None) -> QPushButton:
        button = QPushButton(text)
        button.setToolTip(tip)
        button.clicked.connect(lambda: self._switch_all(text, on))
        return button

    def refresh(self) -> None:
        """Follows the state."""
        state = self._state
        if state.baked is None or state.bits is None or state.regions is None:
            return
        self._filling = True
        self.brush.setChecked(state.tool is Tool.BRUSH)
        (self.on if state.brush_on else self.off).setChecked(True)
        self.radius.setValue(state.brush_radius)
        chosen = highlighted(state.regions, state.view)
        for button in (self._all_off, self._all_on, self._baked):
            button.setEnabled(len(chosen) > 0)
        self._counts.setText(self._text(len(chosen)))
        self._filling = False

    def _text(self, chosen: int) -> str:
        state = self._state
        if state.baked is None or state.bits is None:
            return ""
        baked = reachable_bits(state.baked)
        off, on = int((baked & ~state.bits).sum()), int((~baked & state.bits).sum())
        waiting = int(state.pending.sum()) if state.pending is not None else 0
        if not chosen and not (off or on):
            return "Select a region to edit which of its points count."
        if not (off or on):
            return "No point was switched by hand."
        text = f"{off:,} points switched off, {on:,} on since the bake."
        return text + (f" {waiting:,} of them are traced at the next bake." if waiting else "")

    def _switch_all(self, text: str, on: bool | None) -> None:
        state = self._state
        if state.baked is None or state.bits is None or state.regions is None:
            return
        owners = highlighted(state.regions, state.view)
        own = (owners[:, None] * POINTS + np.arange(POINTS)).ravel()
        bits = state.bits.copy()
        bits[own] = reachable_bits(state.baked)[own] if on is None else on
        self.switch_asked.emit(bits, f"points of {len(owners)} region{'s' if len(owners) > 1 else ''}: {text.lower()}")
