"""How a walk is walked and played: speed, frame rate, half-life, play and scrub, camera and light."""

from __future__ import annotations

from collections.abc import Callable

from PyQt6.QtCore import Qt
from PyQt6.QtGui import QIcon
from PyQt6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QGroupBox,
    QLabel,
    QSlider,
    QStyle,
    QToolButton,
    QWidget,
)

from app.group_parts import choice, group_form, in_row
from app.walk_state import Follow, WalkState
from bake.errors import SettingsError
from bake.walk import CHOSEN, Variant
from viewer.fields import distance_label
from viewer.region_glyph import AXES
from viewer.walk_curves import TITLES

_FOLLOW = (("stays", Follow.STAY), ("moves along", Follow.BESIDE), ("walks behind", Follow.BEHIND))
_RATES = (("⅛ ×", 0.125), ("¼ ×", 0.25), ("½ ×", 0.5), ("1 ×", 1.0), ("2 ×", 2.0), ("4 ×", 4.0))
_PLAY, _STOP = QStyle.StandardPixmap.SP_MediaPlay, QStyle.StandardPixmap.SP_MediaPause
_BACK, _ON = QStyle.StandardPixmap.SP_MediaSeekBackward, QStyle.StandardPixmap.SP_MediaSeekForward
FRAME_RATES = (30, 60, 90, 144)


class WalkPlayGroup(QGroupBox):
    """Edits the options of the state's walk and what is shown of it."""

    def __init__(self, state: WalkState, parent: QWidget | None = None) -> None:
        super().__init__("Walk", parent)
        self._state = state
        self._filling = False
        self.play = self._button(_PLAY, "Play or stop (K)", lambda: state.set_playing(not state.is_playing))
        back = self._button(_BACK, "One frame back (,)", lambda: state.set_frame(state.frame - 1))
        on = self._button(_ON, "One frame on (.)", lambda: state.set_frame(state.frame + 1))
        self.scrub = QSlider(Qt.Orientation.Horizontal)
        self.scrub.setToolTip("The moment in view; drag to go to another")
        self.scrub.valueChanged.connect(lambda frame: None if self._filling else state.set_frame(frame))
        self.moment = QLabel()
        self.moment.setToolTip("The moment in view, of the whole walk, and the region that the figure is in")
        self.rate = choice(_RATES, "How fast it is played; the walk itself stays the same")
        self.rate.currentIndexChanged.connect(lambda: self._view(rate=self.rate.currentData()))
        self.speed = self._number(0.1, 50.0, " m/s", "How fast the figure walks")
        self.speed.valueChanged.connect(lambda value: self._change(speed=value))
        self.frame_rate = QComboBox()
        self.frame_rate.setEditable(True)
        self.frame_rate.addItems([str(rate) for rate in FRAME_RATES])
        self.frame_rate.setToolTip("Frames a second of the game: blending in time must look the same at any")
        self.frame_rate.currentTextChanged.connect(self._on_frame_rate)
        self.half_life = self._number(0.0, 10.0, " s", "After this time half of a jump is left to blend in; 0: none")
        self.half_life.setSingleStep(0.05)
        self.half_life.valueChanged.connect(lambda value: self._change(half_life=value))
        self.column = choice((), "Distance of the AO")
        self.column.currentIndexChanged.connect(lambda: self._change(column=max(self.column.currentIndex(), 0)))
        facings = [("the needle's normal", CHOSEN), *((axis, number) for number, axis in enumerate(AXES))]
        self.normal = choice(facings, "Which way the surface faces whose AO is plotted; the needle is the probe's")
        self.normal.currentIndexChanged.connect(lambda: self._view(normal=self.normal.currentData()))
        self.lit = choice([(TITLES[variant], variant) for variant in Variant], "Which variant lights the figure")
        self.lit.currentIndexChanged.connect(lambda: self._view(lit=self.lit.currentData()))
        self.follow = choice(_FOLLOW, "What the camera does while the figure walks")
        self.follow.currentIndexChanged.connect(lambda: self._view(follow=self.follow.currentData()))
        self.marks = QCheckBox("Path, figure and pops in the view")
        self.marks.setToolTip("Pops are diamonds, darker the worse they are")
        self.marks.toggled.connect(lambda on: self._view(marks=on))
        form = group_form(self)
        form.addRow(in_row(back, self.play, on, self.scrub))
        form.addRow(self.moment)
        form.addRow("Play at", self.rate)
        form.addRow("Speed", self.speed)
        form.addRow("Frame rate", in_row(self.frame_rate, QLabel("Hz")))
        form.addRow("Half-life", self.half_life)
        form.addRow("Distance", self.column)
        form.addRow("Facing", self.normal)
        form.addRow("Figure lit by", self.lit)
        form.addRow("Camera", self.follow)
        form.addRow(self.marks)
        for event in (state.options_changed, state.view_changed, state.walk_changed, state.playing_changed):
            event.connect(self.refresh)
        state.regions.opened.connect(self.refresh)
        state.frame_changed.connect(self._show_moment)
        self.refresh()

    def _button(self, picture: QStyle.StandardPixmap, tip: str, slot: Callable[[], object]) -> QToolButton:
        button = QToolButton()
        button.setIcon(self._icon(picture))
        button.setToolTip(tip)
        button.clicked.connect(lambda: slot())
        return button

    def _icon(self, picture: QStyle.StandardPixmap) -> QIcon:
        style = self.style()
        assert style is not None
        return style.standardIcon(picture)

    def _number(self, low: float, high: float, suffix: str, tip: str) -> QDoubleSpinBox:
        spin = QDoubleSpinBox()
        spin.setRange(low, high)
        spin.setDecimals(2)
        spin.setSingleStep(0.1)
        spin.setSuffix(suffix)
        spin.setKeyboardTracking(False)
        spin.setToolTip(tip)
        return spin

    def refresh(self) -> None:
        """Follows the state."""
        state, options, view, walk = self._state, self._state.options, self._state.view, self._state.walk
        result = state.regions.document.result
        self._filling = True
        self.setEnabled(state.regions.regions is not None)
        labels = [] if result is None else [distance_label(d) for d in result.settings.column_distances]
        if [self.column.itemText(row) for row in range(self.column.count())] != labels:
            self.column.clear()
            self.column.addItems(labels)
        self.column.setCurrentIndex(options.column % max(len(labels), 1))
        self.speed.setValue(options.speed)
        if not self.frame_rate.hasFocus():
            self.frame_rate.setCurrentText(f"{options.frame_rate:g}")
        self.half_life.setValue(options.half_life)
        for combo, data in (
            (self.rate, view.rate), (self.normal, view.normal), (self.lit, view.lit), (self.follow, view.follow),
        ):  # fmt: skip
            combo.setCurrentIndex(combo.findData(data))
        self.marks.setChecked(view.marks)
        self.play.setIcon(self._icon(_STOP if state.is_playing else _PLAY))
        for widget in (self.play, self.scrub):
            widget.setEnabled(walk is not None)
        self.scrub.setRange(0, len(walk) - 1 if walk is not None else 0)
        self.scrub.setPageStep(max(round(options.frame_rate), 1))
        self._filling = False
        self._show_moment()

    def _show_moment(self) -> None:
        state, walk, regions = self._state, self._state.walk, self._state.regions.regions
        if walk is None or regions is None:
            self.moment.setText("–")
            return
        self._filling = True
        self.scrub.setValue(state.frame)
        self._filling = False
        name = regions.graph.names[int(walk.region[state.frame])]
        outside = "" if walk.inside[state.frame] else ", outside of all"
        self.moment.setText(f"{state.time:.2f} of {walk.time[-1]:.2f} s  ·  {name}{outside}")

    def _change(self, **changes: object) -> None:
        if not self._filling:
            try:
                self._state.set_options(**changes)
            except SettingsError:
                self.refresh()

    def _view(self, **changes: object) -> None:
        if not self._filling:
            self._state.set_view(**changes)

    def _on_frame_rate(self, text: str) -> None:
        try:
            value = float(text.replace(",", "."))
        except ValueError:
            return
        if 1.0 <= value <= 1000.0:
            self._change(frame_rate=value)
