"""The probe: a point anywhere at which a region's model is evaluated, live, for every normal and distance."""

from __future__ import annotations

import html

import numpy as np
from PyQt6.QtCore import Qt
from PyQt6.QtWidgets import QCheckBox, QDoubleSpinBox, QGroupBox, QLabel, QPushButton, QSlider, QWidget

from app.group_parts import choice, group_form, in_row, note, small_table
from app.region_state import RegionState, Tool
from viewer.fields import distance_label
from viewer.region_glyph import AXES, axis_table, probe_ao, probe_region

_INSIDE, _SELECTED = 0, 1


class RegionProbeGroup(QGroupBox):
    """Edits the probe of the state's `RegionView`; positions are shown in world metres."""

    def __init__(self, state: RegionState, parent: QWidget | None = None) -> None:
        super().__init__("Probe", parent)
        self._state = state
        self._filling = False
        self.place = QCheckBox("Place by click")
        self.place.setToolTip(
            "A click in the view puts the probe before the surface there (P); drag its sphere to move it"
        )
        self.place.toggled.connect(lambda on: None if self._filling else state.use_tool(Tool.PROBE, on))
        self._remove = QPushButton("Remove")
        self._remove.setToolTip("Takes the probe out of the view")
        self._remove.clicked.connect(lambda: self._change(probe=None))
        self.position = tuple(self._coordinate(axis) for axis in range(3))
        self.owner = choice(
            (("of the region around it", _INSIDE), ("of the selected region", _SELECTED)),
            "Whose model is evaluated; a model can be asked anywhere, but is meant for its own region",
        )
        self.owner.currentIndexChanged.connect(self._on_owner)
        self.radius = QDoubleSpinBox()
        self.radius.setRange(0.01, 1000.0)
        self.radius.setDecimals(2)
        self.radius.setSingleStep(0.1)
        self.radius.setSuffix(" m")
        self.radius.setToolTip("Radius of the probe's sphere")
        self.radius.valueChanged.connect(lambda value: self._change(probe_size=value))
        self.azimuth = self._angle(0, 360, "Where the needle points, seen from above", "azimuth")
        self.elevation = self._angle(-90, 90, "How far the needle points up or down", "elevation")
        self._normal = QLabel()
        self._values = note("AO at the probe about the needle and about the six axes, as fitted and regularised")
        self._values.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        form = group_form(self)
        form.addRow(in_row(self.place, self._remove))
        form.addRow(in_row(*self.position))
        form.addRow("Model", self.owner)
        form.addRow("Radius", self.radius)
        form.addRow("Needle", in_row(self.azimuth, self.elevation))
        form.addRow(self._normal)
        form.addRow(self._values)
        for event in (state.opened, state.view_changed, state.regions_changed, state.tool_changed):
            event.connect(self.refresh)
        state.document.display_changed.connect(self.refresh)
        self.refresh()

    def _coordinate(self, axis: int) -> QDoubleSpinBox:
        spin = QDoubleSpinBox()
        spin.setRange(-1e9, 1e9)
        spin.setDecimals(2)
        spin.setSingleStep(0.1)
        spin.setPrefix(f"{'xyz'[axis]} ")
        spin.setMinimumWidth(60)
        spin.setButtonSymbols(QDoubleSpinBox.ButtonSymbols.NoButtons)
        spin.setToolTip(f"Position along {'xyz'[axis]}, world metres; the wheel and the arrow keys move it by 0.1 m")
        spin.valueChanged.connect(self._on_position)
        return spin

    def _angle(self, low: int, high: int, tip: str, name: str) -> QSlider:
        slider = QSlider(Qt.Orientation.Horizontal)
        slider.setRange(low, high)
        slider.setPageStep(15)
        slider.setToolTip(f"{tip}, {low}° to {high}°")
        slider.valueChanged.connect(lambda value: self._change(**{name: float(value)}))
        return slider

    def refresh(self) -> None:
        """Follows the state."""
        state, view = self._state, self._state.view
        if state.regions is None or state.document.world is None:
            return
        self._filling = True
        has_probe = view.probe is not None
        self.place.setChecked(state.tool is Tool.PROBE)
        world_position = np.asarray(view.probe or (0.0, 0.0, 0.0)) + state.document.world.origin
        for spin, value in zip(self.position, world_position, strict=True):
            spin.setVisible(has_probe)
            if abs(spin.value() - value) > 0.005:
                spin.setValue(value)
        for widget in (self.owner, self.radius, self.azimuth, self.elevation, self._remove):
            widget.setEnabled(has_probe)
        self.owner.setCurrentIndex(_INSIDE if view.probe_region < 0 else _SELECTED)
        self.radius.setValue(view.probe_size)
        self.azimuth.setValue(round(view.azimuth))
        self.elevation.setValue(round(view.elevation))
        x, y, z = view.normal(state.document.up_axis)
        self._normal.setText(f"{view.azimuth:.0f}° around, {view.elevation:.0f}° up: {x:+.2f}, {y:+.2f}, {z:+.2f}")
        self._normal.setVisible(has_probe)
        self._values.setText(self._text())
        self._filling = False

    def _text(self) -> str:
        state, view, regions = self._state, self._state.view, self._state.regions
        result = state.document.result
        if view.probe is None or regions is None or result is None:
            return "Tick “Place by click”, then click on the surface: the sphere shows the AO of a model there."
        table, needle = axis_table(regions, view), probe_ao(regions, view, state.document.up_axis)
        if table is None or needle is None:
            return "The probe lies in no region: move it, or choose the selected region's model."
        rows = [["needle", f"{needle[0][view.column]:.4f}", f"{needle[1][view.column]:.4f}"]]
        rows += [
            [axis, f"{table[0][row, view.column]:.4f}", f"{table[1][row, view.column]:.4f}"]
            for row, axis in enumerate(AXES)
        ]
        name = html.escape(regions.graph.names[probe_region(regions, view)])
        label = distance_label(result.settings.column_distances[view.column])
        return f"Model of <b>{name}</b>" + small_table([f"AO at {label}", "fitted", "regularised"], rows)

    def _change(self, **changes: object) -> None:
        if not self._filling:
            self._state.set_view(self._state.view.replaced(**changes))

    def _on_position(self) -> None:
        world = self._state.document.world
        if world is not None and self._state.view.probe is not None and not self._filling:
            x, y, z = (float(spin.value() - low) for spin, low in zip(self.position, world.origin, strict=True))
            self._change(probe=(x, y, z))

    def _on_owner(self) -> None:
        selected = self._state.view.region
        if self.owner.currentData() == _SELECTED and selected < 0:
            self.refresh()
            return
        self._change(probe_region=-1 if self.owner.currentData() == _INSIDE else selected)
