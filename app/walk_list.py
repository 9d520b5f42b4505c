"""Plot and pops of a walk side by side, below the view."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

from PyQt6.QtCore import QEvent, Qt, pyqtSignal
from PyQt6.QtGui import QIcon, QPixmap
from PyQt6.QtWidgets import QHBoxLayout, QLabel, QSplitter, QToolButton, QVBoxLayout, QWidget

from app.column_table import ColumnTable
from app.walk_painting import variant_color
from app.walk_plot import WalkPlot
from app.walk_state import WalkState
from bake.walk import Variant, Walk
from viewer.walk_curves import TITLES
from viewer.walk_rows import pop_columns

_SHORT = {
    Variant.RAW: "Raw",
    Variant.REGULARISED: "Regularised",
    Variant.BLENDED: "Time",
    Variant.SPATIAL: "Space",
    Variant.SPATIAL_BLENDED: "Both",
    Variant.TRUTH: "Truth",
}


class WalkList(QWidget):
    """The plot with a button a variant above it, and the table of pops."""

    pop_chosen = pyqtSignal(object)  # Pop

    def __init__(self, state: WalkState, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._state = state
        self._filling = False
        self._listed: tuple[Walk | None, frozenset[Variant]] = (None, frozenset())
        self.plot = WalkPlot(state)
        self.plot.pop_chosen.connect(self.pop_chosen)
        self.buttons: dict[Variant, QToolButton] = {}
        left = QWidget()
        column = QVBoxLayout(left)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(2)
        row = QHBoxLayout()
        row.setSpacing(2)
        for variant in Variant:
            row.addWidget(self._build_button(variant))
        row.addStretch(1)
        column.addLayout(row)
        column.addWidget(self.plot, 1)
        self._count = QLabel()
        self.view = ColumnTable()
        self.view.setToolTip("Frames on which the figure visibly jumps; click one to go there and see its boundary")
        self.view.row_chosen.connect(lambda row: self.pop_chosen.emit(state.pops[row]))
        right = QWidget()
        column = QVBoxLayout(right)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(2)
        column.addWidget(self._count)
        column.addWidget(self.view, 1)
        split = QSplitter(Qt.Orientation.Horizontal)
        split.addWidget(left)
        split.addWidget(right)
        split.setSizes([560, 400])
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.addWidget(split)
        state.walk_changed.connect(self.refresh)
        state.view_changed.connect(self.refresh)
        self.refresh()

    def _build_button(self, variant: Variant) -> QToolButton:
        button = QToolButton()
        button.setText(_SHORT[variant])
        button.setCheckable(True)
        button.setAutoRaise(True)
        button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        button.setToolTip(f"{TITLES[variant]}: show or hide its curve and its pops")
        button.toggled.connect(lambda on: self._on_button(variant, on))
        self.buttons[variant] = button
        return button

    def refresh(self) -> None:
        """Follows the state."""
        state, regions = self._state, self._state.regions.regions
        self._filling = True
        for variant, button in self.buttons.items():
            button.setChecked(variant in state.view.variants)
            button.setEnabled(state.walk is None or variant in state.walk.ao)
            swatch = QPixmap(10, 10)
            swatch.fill(variant_color(variant, self.palette()))
            button.setIcon(QIcon(swatch))
        self._filling = False
        pops, walk = state.pops, state.walk
        if walk is self._listed[0] and state.view.variants == self._listed[1]:
            return
        by_codes = self._listed[0] is None
        self._listed = (walk, state.view.variants)
        columns = pop_columns(pops, regions) if regions is not None and walk is not None else ()
        self.view.set_columns(columns, stretch=2, sorted_by=0 if by_codes else None, descending=True)
        self._count.setText(f"{len(pops):,} pop{'' if len(pops) == 1 else 's'}" if walk is not None else "Pops")

    def changeEvent(self, event: QEvent | None) -> None:
        """The truth has the colour of text."""
        super().changeEvent(event)
        if event is not None and event.type() is QEvent.Type.PaletteChange and self.buttons:
            self.refresh()

    def _on_button(self, variant: Variant, on: bool) -> None:
        if not self._filling:
            variants = self._state.view.variants
            self._state.set_view(variants=variants | {variant} if on else variants - {variant})
