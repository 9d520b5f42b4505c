"""Regularisation of the regions' models, live: nothing is traced."""

from __future__ import annotations

import math

import numpy as np
from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import QCheckBox, QDoubleSpinBox, QGroupBox, QPushButton, QSlider, QSpinBox, QWidget

from app.group_parts import group_form, in_row, note, small_table
from app.number_edit import NumberEdit
from app.region_state import RegionState
from bake.errors import SettingsError
from viewer.fields import distance_label

_STEPS = 200
_LOW, _HIGH = -2.0, 4.0  # powers of ten at the slider's second and last position


class RegionModelGroup(QGroupBox):
    """Edits β, sweeps, tolerance and the search of centres in the state's settings."""

    kept = pyqtSignal()

    def __init__(self, state: RegionState, parent: QWidget | None = None) -> None:
        super().__init__("Regularisation", parent)
        self._state = state
        self._filling = False
        tip = (
            "How strongly neighbouring models are drawn together where they meet, against the fit's own error.\n"
            "0 leaves them as fitted. Nothing is traced."
        )
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setRange(0, _STEPS)
        self.slider.setToolTip(tip)
        self.slider.valueChanged.connect(lambda value: self._change(region_beta=beta_at(value)))
        self.beta = QDoubleSpinBox()
        self.beta.setRange(0.0, 1e9)
        self.beta.setDecimals(3)
        self.beta.setStepType(QDoubleSpinBox.StepType.AdaptiveDecimalStepType)
        self.beta.setKeyboardTracking(False)
        self.beta.setToolTip(tip)
        self.beta.setMaximumWidth(96)
        self.beta.valueChanged.connect(lambda value: self._change(region_beta=value))
        self.sweeps_slider = QSlider(Qt.Orientation.Horizontal)
        self.sweeps_slider.setRange(0, 100)
        self.sweeps = QSpinBox()
        self.sweeps.setRange(0, 100_000)
        self.sweeps.setKeyboardTracking(False)
        self.sweeps.setMaximumWidth(96)
        for widget in (self.sweeps_slider, self.sweeps):
            widget.setToolTip("Most passes over all regions; it ends sooner where nothing changes any more")
            widget.valueChanged.connect(lambda value: self._change(region_sweeps=value))
        self.tolerance = NumberEdit("AO")
        self.tolerance.setToolTip("It ends when no model changes by more than this at a boundary")
        self.tolerance.changed.connect(self._on_tolerance)
        self.optimise = QCheckBox("Search the centres")
        self.optimise.setToolTip("Search each model's centre instead of trying two; fits all regions again")
        self.optimise.toggled.connect(lambda on: self._change(optimise_centre=on))
        self._figures = note("Worst and mean mismatch over all boundaries, and mean fit error over all regions")
        self._energy = note(
            "Sum of squared changes plus weighted squared mismatches; it never rises from sweep to sweep"
        )
        self._reset = QPushButton("Reset")
        self._reset.setToolTip("Back to the models as baked")
        self._reset.clicked.connect(self._on_reset)
        self._keep = QPushButton("Use in bake")
        self._keep.setToolTip("Put these settings into the bake settings")
        self._keep.clicked.connect(self.kept)
        form = group_form(self)
        form.addRow("β", in_row(self.slider, self.beta))
        form.addRow("Sweeps", in_row(self.sweeps_slider, self.sweeps))
        form.addRow("Tolerance", self.tolerance)
        form.addRow(self.optimise)
        form.addRow(self._figures)
        form.addRow(self._energy)
        form.addRow(in_row(self._reset, self._keep))
        for event in (state.opened, state.settings_changed, state.regions_changed, state.view_changed):
            event.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Follows the state."""
        settings, result = self._state.settings, self._state.document.result
        if settings is None or result is None:
            return
        self._filling = True
        self.slider.setValue(position_of(settings.region_beta))
        if self.beta.value() != settings.region_beta:
            self.beta.setValue(settings.region_beta)
        self.sweeps.setValue(settings.region_sweeps)
        self.sweeps_slider.setValue(min(settings.region_sweeps, self.sweeps_slider.maximum()))
        if not self.tolerance.hasFocus() or self._tolerance() is None:
            self.tolerance.set_value(settings.region_tolerance)
        self.optimise.setChecked(settings.optimise_centre)
        self._figures.setText(self._figures_text())
        self._energy.setText(energy_text(self._state.energies, as_baked=not self._state.is_preview))
        self._reset.setEnabled(settings != result.settings)
        self._filling = False

    def _figures_text(self) -> str:
        regions, result, column = self._state.regions, self._state.document.result, self._state.view.column
        if regions is None or result is None:
            return ""
        rows: list[list[str]] = []
        before, after = (np.asarray(part)[:, column] for part in (regions.mismatch_before, regions.mismatch_after))
        if len(before):
            rows.append(["worst mismatch", f"{before.max():.4f}", f"{after.max():.4f}"])
            rows.append(["mean mismatch", f"{before.mean():.4f}", f"{after.mean():.4f}"])
        errors = [np.asarray(models.rmse)[:, column] for models in (regions.fitted, regions.regularised)]
        if np.isfinite(errors[0]).any():
            rows.append(["mean fit error", *(f"{np.nanmean(error):.4f}" for error in errors)])
        if not rows:
            return "No boundary and no valid point."
        label = distance_label(result.settings.column_distances[column])
        return small_table([f"at {label}", "fitted", "regularised"], rows)

    def _tolerance(self) -> float | None:
        try:
            return self.tolerance.value()
        except ValueError:
            return None

    def _on_tolerance(self) -> None:
        value = self._tolerance()
        if value is not None and 0.0 <= value <= 1.0:
            self._change(region_tolerance=value)

    def _change(self, **changes: object) -> None:
        settings = self._state.settings
        if self._filling or settings is None:
            return
        try:
            self._state.set_settings(settings.replaced(**changes))
        except SettingsError:
            self.refresh()

    def _on_reset(self) -> None:
        result = self._state.document.result
        if result is not None:
            self._state.set_settings(result.settings)


def beta_at(position: int) -> float:
    """β at a position of the slider: 0 at its left end, then from 0.01 to 10,000 by powers, to three digits."""
    if position <= 0:
        return 0.0
    value = 10.0 ** (_LOW + (_HIGH - _LOW) * (position - 1) / (_STEPS - 1))
    return float(f"{value:.3g}")


def position_of(beta: float) -> int:
    """The slider's position nearest to a β."""
    if beta <= 0.0:
        return 0
    share = (math.log10(beta) - _LOW) / (_HIGH - _LOW)
    return 1 + round(min(max(share, 0.0), 1.0) * (_STEPS - 1))


def energy_text(energies: np.ndarray, *, as_baked: bool) -> str:
    """How the descent went, in a line."""
    if as_baked:
        return "As baked."
    if not len(energies):
        return "Nothing to regularise: the models are as fitted."
    before, after = energies[-1].tolist()
    fall = 1.0 - after / before if before > 0.0 else 0.0
    return f"{len(energies):,} sweep{'s' if len(energies) > 1 else ''}; the last lowered the energy by {fall:.2%}."
