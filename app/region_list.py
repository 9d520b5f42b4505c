"""The tables of regions and of the boundaries between them, one at a time."""

from __future__ import annotations

from collections.abc import Sequence

from PyQt6.QtCore import Qt, QTimer, pyqtSignal
from PyQt6.QtWidgets import QComboBox, QHBoxLayout, QHeaderView, QLabel, QLineEdit, QVBoxLayout, QWidget

from app.region_state import RegionState
from app.tables import Cell, RowsView
from viewer.instance_rows import Column
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
        self._filling = False
        self.kind = QComboBox()
        self.kind.addItems((_BOUNDARIES, _REGIONS))
        self.kind.setToolTip("What the table lists")
        self.kind.currentIndexChanged.connect(self._on_kind)
        self._count = QLabel()
        self._filter = QLineEdit()
        self._filter.setPlaceholderText("Filter by name")
        self._filter.setToolTip("Show only rows that contain this text")
        self._filter.setClearButtonEnabled(True)
        self._filter.setMaximumWidth(240)
        self.view = RowsView(("Region",), stretch=0)
        self.view.setSortingEnabled(True)
        self.view.setToolTip("Click a row to fly there and to highlight it; click a heading to sort")
        self._filter.textChanged.connect(self.view.proxy.setFilterFixedString)
        selection = self.view.selectionModel()
        assert selection is not None
        selection.selectionChanged.connect(self._on_selection)
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
        rows = self.view.proxy.rowCount()
        selection = self.view.selectionModel()
        if rows and selection is not None:
            chosen = selection.selectedRows()
            row = (chosen[0].row() + step) % rows if chosen else 0
            self.view.selectRow(row)
            self.view.scrollTo(self.view.proxy.index(row, 0))

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
        state, result = self._state, self._state.document.result
        self._rest.stop()
        self._shown = (state.view.as_fitted, state.view.column)
        regions = state.regions
        if regions is None or result is None:
            self.view.rows.set_headings(("Region",))
            self._count.setText("No regions.")
            return
        distances = result.settings.column_distances
        if self.kind.currentText() == _REGIONS:
            columns = region_columns(regions, state.view, distances, state.region_bytes)
        else:
            columns = boundary_columns(regions, distances)
        self._filling = True
        self._fill(columns, fresh=fresh)
        self._filling = False
        count = len(columns[0].texts)
        noun = "region" if self.kind.currentText() == _REGIONS else "boundary"
        plural = {"region": "regions", "boundary": "boundaries"}[noun]
        self._count.setText(f"{count:,} {noun if count == 1 else plural}")
        self._show_chosen()

    def _fill(self, columns: Sequence[Column], *, fresh: bool) -> None:
        rows = list(zip(*(_cells(column) for column in columns), strict=True))
        if not fresh:
            self.view.rows.set_rows(rows)
            return
        self.view.rows.set_headings([column.heading for column in columns])
        header = self.view.horizontalHeader()
        assert header is not None
        for number in range(len(columns)):
            stretch = QHeaderView.ResizeMode.Stretch if number == 0 else QHeaderView.ResizeMode.Interactive
            header.setSectionResizeMode(number, stretch)
        self.view.set_rows(rows)
        by = self._first_sorting(columns)
        order = Qt.SortOrder.AscendingOrder if by == 0 else Qt.SortOrder.DescendingOrder
        self.view.sortByColumn(by, order)

    def _first_sorting(self, columns: Sequence[Column]) -> int:
        """Boundaries come with the largest mismatch of the models in use first."""
        after = [number for number, column in enumerate(columns) if column.heading.startswith("After")]
        return after[min(self._state.view.column, len(after) - 1)] if after else 0

    def _on_selection(self) -> None:
        selection = self.view.selectionModel()
        if self._filling or selection is None:
            return
        rows = selection.selectedRows()
        if rows:
            number = self.view.proxy.mapToSource(rows[0]).row()
            (self.region_chosen if self.kind.currentText() == _REGIONS else self.link_chosen).emit(number)

    def _show_chosen(self) -> None:
        """Selects the row of what is selected in the view, without telling."""
        view = self._state.view
        wanted = view.region if self.kind.currentText() == _REGIONS and view.link < 0 else view.link
        if self.kind.currentText() == _REGIONS and view.link >= 0:
            wanted = -1
        selection = self.view.selectionModel()
        assert selection is not None
        self._filling = True
        if 0 <= wanted < self.view.rows.rowCount():
            index = self.view.proxy.mapFromSource(self.view.rows.index(wanted, 0))
            if index.isValid() and not selection.isRowSelected(index.row(), index.parent()):
                self.view.selectRow(index.row())
                self.view.scrollTo(index)
        else:
            selection.clearSelection()
        self._filling = False


def _cells(column: Column) -> list[Cell]:
    return [Cell(text, key, tip=column.tip) for text, key in zip(column.texts, column.keys, strict=True)]
