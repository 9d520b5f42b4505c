"""A sortable, filterable table over plain rows; the base of the stage report and the findings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from PyQt6.QtCore import QAbstractTableModel, QModelIndex, QObject, QSortFilterProxyModel, Qt
from PyQt6.QtGui import QBrush, QColor
from PyQt6.QtWidgets import (
    QHeaderView,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableView,
    QWidget,
)

from app.table_looks import dress, fit_columns

_WIDEST, _LEAST_WIDE = 0.36, 150
"""Widest that a column gets by itself, as a share of the table, and how wide it may be in any case, in pixels."""


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
        self._tips: tuple[str, ...] = ()
        self._given: list[tuple[Cell, ...]] = []
        self._rows: list[tuple[Cell, ...]] = []
        self._order: list[int] = []
        self._by, self._descending = -1, False

    def set_rows(self, rows: Sequence[tuple[Cell, ...]]) -> None:
        """Replaces all rows; they are sorted as those before."""
        self.beginResetModel()
        self._given = list(rows)
        self._arrange()
        self.endResetModel()

    def set_headings(self, headings: Sequence[str], tips: Sequence[str] = ()) -> None:
        """Replaces the headings and what they mean, and with them the number of columns; leaves no rows."""
        self.beginResetModel()
        self._headings, self._tips, self._given = tuple(headings), tuple(tips), []
        self._arrange()
        self.endResetModel()

    def row(self, number: int) -> tuple[Cell, ...]:
        """One row of the model, as it is sorted."""
        return self._rows[number]

    def given(self, number: int) -> tuple[Cell, ...]:
        """The row given as the `number`-th."""
        return self._given[number]

    def place_of(self, number: int) -> int:
        """Where a row stands now that was given as the `number`-th; -1 if there is none."""
        return self._order.index(number) if 0 <= number < len(self._order) else -1

    def sort(self, column: int, order: Qt.SortOrder = Qt.SortOrder.AscendingOrder) -> None:
        """Sorts by the keys of a column: at once, where a proxy would ask for two keys a comparison."""
        self.layoutAboutToBeChanged.emit()
        before, kept = self._order, self.persistentIndexList()
        self._by, self._descending = column, order is Qt.SortOrder.DescendingOrder
        self._arrange()
        place = {number: row for row, number in enumerate(self._order)}
        self.changePersistentIndexList(kept, [self.index(place[before[old.row()]], old.column()) for old in kept])
        self.layoutChanged.emit()

    def _arrange(self) -> None:
        self._order = list(range(len(self._given)))
        if 0 <= self._by < len(self._headings):
            keys = [row[self._by].text if row[self._by].key is None else row[self._by].key for row in self._given]
            try:
                self._order.sort(key=keys.__getitem__, reverse=self._descending)
            except TypeError:  # numbers among texts
                self._order.sort(key=lambda row: str(keys[row]), reverse=self._descending)
        self._rows = [self._given[row] for row in self._order]

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
        if role == Qt.ItemDataRole.ToolTipRole and section < len(self._tips):
            return self._tips[section] or None
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


class _MiddleDelegate(QStyledItemDelegate):
    """Cuts long texts in the middle."""

    def initStyleOption(self, option: QStyleOptionViewItem | None, index: QModelIndex) -> None:
        super().initStyleOption(option, index)
        if option is not None:
            option.textElideMode = Qt.TextElideMode.ElideMiddle


class _FilterProxy(QSortFilterProxyModel):
    """Leaves rows out, and leaves their order to the model."""

    def sort(self, column: int, order: Qt.SortOrder = Qt.SortOrder.AscendingOrder) -> None:
        source = self.sourceModel()
        if source is not None:
            source.sort(column, order)


class RowsView(QTableView):
    """Shows a `RowsModel`, sortable by its headings."""

    def __init__(self, headings: Sequence[str], stretch: int, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.rows = RowsModel(headings, self)
        self.proxy = _FilterProxy(self)
        self.proxy.setSourceModel(self.rows)
        self.proxy.setFilterCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
        self.proxy.setFilterKeyColumn(-1)
        self.setModel(self.proxy)
        self._stretch = stretch
        columns = dress(self)
        columns.setSectionResizeMode(QHeaderView.ResizeMode.Interactive)
        columns.setSectionResizeMode(stretch, QHeaderView.ResizeMode.Stretch)

    def elide_middle(self, column: int) -> None:
        """Cuts texts of a column in the middle where there is no room for them: the end of a path tells the most."""
        self.setItemDelegateForColumn(column, _MiddleDelegate(self))

    def set_rows(self, rows: Sequence[tuple[Cell, ...]]) -> None:
        """Replaces all rows and fits the columns to them, so that none takes the room of the one that stretches."""
        self.rows.set_rows(rows)
        fit_columns(self)
        port = self.viewport()
        most = max(_LEAST_WIDE, int(_WIDEST * (port.width() if port is not None else 0)))
        for column in range(self.rows.columnCount()):
            if column != self._stretch and self.columnWidth(column) > most:
                self.setColumnWidth(column, most)

    def show_row(self, number: int) -> None:
        """Selects the row given as the `number`-th and scrolls to it; -1, or one filtered out, selects none."""
        place = self.rows.place_of(number)
        index = self.proxy.mapFromSource(self.rows.index(place, 0)) if place >= 0 else QModelIndex()
        if index.isValid():
            self.selectRow(index.row())
        else:
            self.clearSelection()

    def chosen(self) -> tuple[Cell, ...] | None:
        """The selected row."""
        selection = self.selectionModel()
        indexes = selection.selectedRows() if selection is not None else []
        return self.rows.row(self.proxy.mapToSource(indexes[0]).row()) if indexes else None
