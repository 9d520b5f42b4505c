"""A sortable, filterable table over plain rows; the base of the stage report and the findings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from PyQt6.QtCore import QAbstractTableModel, QModelIndex, QObject, QSortFilterProxyModel, Qt
from PyQt6.QtGui import QBrush, QColor
from PyQt6.QtWidgets import QAbstractItemView, QHeaderView, QTableView, QWidget


@dataclass(frozen=True, slots=True)
class Cell:
    """What a cell shows, sorts by, and looks like."""

    text: str
    key: Any = None
    color: str | None = None
    tip: str = ""


class RowsModel(QAbstractTableModel):
    """Rows of cells under headings; numbers (keys that are int or float) align to the right."""

    def __init__(self, headings: Sequence[str], parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._headings = tuple(headings)
        self._rows: list[tuple[Cell, ...]] = []

    def set_rows(self, rows: Sequence[tuple[Cell, ...]]) -> None:
        """Replaces all rows."""
        self.beginResetModel()
        self._rows = list(rows)
        self.endResetModel()

    def set_headings(self, headings: Sequence[str]) -> None:
        """Replaces the headings, and with them the number of columns; leaves no rows."""
        self.beginResetModel()
        self._headings, self._rows = tuple(headings), []
        self.endResetModel()

    def row(self, number: int) -> tuple[Cell, ...]:
        """One row, in source order."""
        return self._rows[number]

    def rowCount(self, parent: QModelIndex = QModelIndex()) -> int:  # noqa: B008 - Qt's own signature
        """Number of rows."""
        return 0 if parent.isValid() else len(self._rows)

    def columnCount(self, parent: QModelIndex = QModelIndex()) -> int:  # noqa: B008 - Qt's own signature
        """Number of columns."""
        return 0 if parent.isValid() else len(self._headings)

    def headerData(self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """The headings."""
        if role == Qt.ItemDataRole.DisplayRole and orientation is Qt.Orientation.Horizontal:
            return self._headings[section]
        return None

    def data(self, index: QModelIndex, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """Text, sort key, colour, tooltip and alignment of a cell."""
        cell = self._rows[index.row()][index.column()]
        if role == Qt.ItemDataRole.DisplayRole:
            return cell.text
        if role == Qt.ItemDataRole.UserRole:
            return cell.text if cell.key is None else cell.key
        if role == Qt.ItemDataRole.ForegroundRole and cell.color is not None:
            return QBrush(QColor(cell.color))
        if role == Qt.ItemDataRole.ToolTipRole:
            return cell.tip or cell.text
        if role == Qt.ItemDataRole.TextAlignmentRole and isinstance(cell.key, int | float):
            return int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        return None


class RowsView(QTableView):
    """Shows a `RowsModel`, sortable by its headings."""

    def __init__(self, headings: Sequence[str], stretch: int, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.rows = RowsModel(headings, self)
        self.proxy = QSortFilterProxyModel(self)
        self.proxy.setSourceModel(self.rows)
        self.proxy.setSortRole(Qt.ItemDataRole.UserRole)
        self.proxy.setFilterCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
        self.proxy.setFilterKeyColumn(-1)
        self.setModel(self.proxy)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setAlternatingRowColors(True)
        self.setShowGrid(False)
        self.setWordWrap(False)
        rows = self.verticalHeader()
        columns = self.horizontalHeader()
        assert rows is not None and columns is not None
        rows.hide()
        rows.setDefaultSectionSize(self.fontMetrics().height() + 6)
        columns.setSectionResizeMode(QHeaderView.ResizeMode.Interactive)
        columns.setSectionResizeMode(stretch, QHeaderView.ResizeMode.Stretch)
        columns.setHighlightSections(False)

    def set_rows(self, rows: Sequence[tuple[Cell, ...]]) -> None:
        """Replaces all rows and fits the columns to them."""
        self.rows.set_rows(rows)
        self.resizeColumnsToContents()

    def show_row(self, number: int) -> None:
        """Selects a row, in source order, and scrolls to it; -1, or one that is filtered out, selects none."""
        index = self.proxy.mapFromSource(self.rows.index(number, 0)) if number >= 0 else QModelIndex()
        if index.isValid():
            self.selectRow(index.row())
        else:
            self.clearSelection()

    def chosen(self) -> tuple[Cell, ...] | None:
        """The selected row."""
        selection = self.selectionModel()
        indexes = selection.selectedRows() if selection is not None else []
        return self.rows.row(self.proxy.mapToSource(indexes[0]).row()) if indexes else None
