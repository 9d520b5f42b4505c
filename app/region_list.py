"""The tables of regions and of the boundaries between them, one at a time."""

from __future__ import annotations

from PyQt6.QtCore import QTimer, pyqtSignal
from PyQt6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from app.column_table import ColumnTable
from app.filter_line import FilterLine
from app.region_state import RegionState
from viewer.region_rows import boundary_columns, region_columns

_BOUNDARIES, _REGIONS = "Boundaries", "Regions"
_REFRESH_MS = 120
"""How long models must rest before the table follows them: it is slower to fill than they are to make."""


class RegionList(QWidget):
    """A row a region or a boundary; a click selects it, a double click flies there."""

    region_chosen = pyqtSignal(int)
    link_chosen = pyqtSignal(int)

    def __init__(self, state: RegionState, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._state = state
        self.kind = QComboBox()
        self.kind.addItems((_BOUNDARIES, _REGIONS))
        self.kind.setToolTip("What the table lists")
        self.kind.currentIndexChanged.connect(self._on_kind)
        self._count = QLabel()
        self._filter = FilterLine("Filter by name", widest=240)
        self.view = ColumnTable()
        self.view.setToolTip("Click a row to fly there and to highlight it; click a heading to sort")
        self._filter.textChanged.connect(self._on_filter)
        self.view.row_chosen.connect(self._on_chosen)
        top = QHBoxLayout()
        top.addWidget(self.kind)
        top.addWidget(self._count, 1)
        top.addWidget(self._filter)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.addLayout(top)
        layout.addWidget(self.view, 1)
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.setInterval(_REFRESH_MS)
        self._rest.timeout.connect(self._refill)
        self._shown: tuple[bool, int] = (False, 0)
        state.opened.connect(self._on_opened)
        state.regions_changed.connect(self._rest.start)
        state.view_changed.connect(self._on_view)
        self._on_opened()

    def set_kind(self, kind: str) -> None:
        """Shows "Boundaries" or "Regions"."""
        self.kind.setCurrentText(kind)

    def select_next(self, step: int) -> None:
        """Chooses the row below or above the chosen one, as the table is sorted."""
        self.view.choose_next(step)

    def _on_opened(self) -> None:
        has = self._state.regions is not None
        for widget in (self.kind, self._filter):
            widget.setEnabled(has)
        self._refill(fresh=True)

    def _on_kind(self) -> None:
        self._refill(fresh=True)

    def _on_view(self) -> None:
        view = self._state.view
        if (view.as_fitted, view.column) != self._shown:
            self._rest.start()
        self._show_chosen()

    def _refill(self, *, fresh: bool = False) -> None:
        state, result, regions = self._state, self._state.document.result, self._state.regions
        self._rest.stop()
        self._shown = (state.view.as_fitted, state.view.column)
        if regions is None or result is None:
            self.view.set_columns(())
            self._count.setText("No regions.")
            return
        distances = result.settings.column_distances
        if self.kind.currentText() == _REGIONS:
            columns = region_columns(regions, state.view, distances, state.region_bytes)
            self.view.set_columns(columns, sorted_by=0 if fresh else None)
            nouns = ("region", "regions")
        else:
            columns = boundary_columns(regions, distances)
            # The largest mismatch of the models in use comes first, at the distance in view.
            after = [number for number, column in enumerate(columns) if column.heading.startswith("After")]
            by = after[min(state.view.column, len(after) - 1)]
            self.view.set_columns(columns, sorted_by=by if fresh else None, descending=True)
            nouns = ("boundary", "boundaries")
        count = len(columns[0].texts)
        self._count.setText(f"{count:,} {nouns[count != 1]}")
        self._show_chosen()

    def _on_filter(self, text: str) -> None:
        self.view.set_filter(text)
        self._show_chosen()

    def _on_chosen(self, row: int) -> None:
        (self.region_chosen if self.kind.currentText() == _REGIONS else self.link_chosen).emit(row)

    def _show_chosen(self) -> None:
        """Marks the row of what is selected in the view."""
        view = self._state.view
        if self.kind.currentText() == _REGIONS:
            self.view.show_chosen(view.region if view.link < 0 else -1)
        else:
            self.view.show_chosen(view.link)
