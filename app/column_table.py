"""A table of columns of thousands of rows: cells are made as they come into view, sorting and filtering are arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from PyQt6.QtCore import QAbstractTableModel, QModelIndex, QObject, Qt, pyqtSignal
from PyQt6.QtWidgets import QHeaderView, QTableView, QWidget

from app.table_looks import dress, fit_columns
from viewer.instance_rows import Column

_LEAST_STRETCHED = 170
"""Room in pixels that the stretched column gets at least."""


class ColumnModel(QAbstractTableModel):
    """Columns, a selection of their rows that contain a text, and the order in which these are shown."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._columns: tuple[Column, ...] = ()
        self._order = np.zeros(0, np.int64)
        self._shown_at = np.zeros(0, np.int64)
        self._by, self._descending, self._filter = 0, False, ""

    @property
    def columns(self) -> tuple[Column, ...]:
        """What is shown."""
        return self._columns

    def set_columns(self, columns: Sequence[Column]) -> None:
        """Replaces everything; order and filter stay."""
        self.beginResetModel()
        self._columns = tuple(columns)
        self._arrange()
        self.endResetModel()

    def set_filter(self, text: str) -> None:
        """Shows only rows in which a cell contains the text."""
        self.beginResetModel()
        self._filter = text.casefold()
        self._arrange()
        self.endResetModel()

    def sort(self, column: int, order: Qt.SortOrder = Qt.SortOrder.AscendingOrder) -> None:
        """Sorts by the keys of a column."""
        self.beginResetModel()
        self._by, self._descending = column, order is Qt.SortOrder.DescendingOrder
        self._arrange()
        self.endResetModel()

    def source_row(self, row: int) -> int:
        """Which row of the columns a row of the table is."""
        return int(self._order[row])

    def table_row(self, row: int) -> int:
        """Where a row of the columns stands; -1 if the filter leaves it out."""
        return int(self._shown_at[row]) if 0 <= row < len(self._shown_at) else -1

    def _arrange(self) -> None:
        count = len(self._columns[0].texts) if self._columns else 0
        order = np.arange(count)
        if self._columns:
            keys = self._columns[min(max(self._by, 0), len(self._columns) - 1)].keys
            if count and isinstance(keys[0], int | float | np.number):
                values = np.asarray(keys, np.float64)
                order = np.argsort(-values if self._descending else values, kind="stable")
            else:
                order = np.array(sorted(range(count), key=lambda row: keys[row], reverse=self._descending), np.int64)
        if self._filter:
            kept = [
                row for row in order.tolist() if any(self._filter in c.texts[row].casefold() for c in self._columns)
            ]
            order = np.array(kept, np.int64)
        self._order = order.astype(np.int64)
        self._shown_at = np.full(count, -1, np.int64)
        self._shown_at[self._order] = np.arange(len(self._order))

    def rowCount(self, parent: QModelIndex = QModelIndex()) -> int:  # noqa: B008 - Qt's own signature
        """Number of rows that are shown."""
        return 0 if parent.isValid() else len(self._order)

    def columnCount(self, parent: QModelIndex = QModelIndex()) -> int:  # noqa: B008 - Qt's own signature
        """Number of columns."""
        return 0 if parent.isValid() else len(self._columns)

    def headerData(self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """Headings and what they mean."""
        if orientation is Qt.Orientation.Horizontal and 0 <= section < len(self._columns):
            if role == Qt.ItemDataRole.DisplayRole:
                return self._columns[section].heading
            if role == Qt.ItemDataRole.ToolTipRole:
                return self._columns[section].tip
        return None

    def data(self, index: QModelIndex, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """Text, tooltip and alignment of a cell."""
        column = self._columns[index.column()]
        row = int(self._order[index.row()])
        if role == Qt.ItemDataRole.DisplayRole:
            return column.texts[row]
        if role == Qt.ItemDataRole.ToolTipRole:
            return f"{column.texts[row]}\n{column.tip}" if column.tip else column.texts[row]
        if role == Qt.ItemDataRole.TextAlignmentRole and isinstance(column.keys[row], int | float | np.number):
            return int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        return None


class ColumnTable(QTableView):
    """Shows a `ColumnModel`; tells which row the user chose, by its place in the columns."""

    row_chosen = pyqtSignal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.columns = ColumnModel(self)
        self._telling = True
        self.setModel(self.columns)
        dress(self)
        self.setSortingEnabled(True)
        self.setTextElideMode(Qt.TextElideMode.ElideMiddle)  # the end of a path tells the most
        selection = self.selectionModel()
        assert selection is not None
        selection.selectionChanged.connect(self._on_selection)

    def set_columns(
        self, columns: Sequence[Column], *, stretch: int = 0, sorted_by: int | None = None, descending: bool = False
    ) -> None:
        """Replaces everything.

        Args:
            columns: What to show.
            stretch: The one that takes the room that is left.
            sorted_by: Column to sort by from now on; None keeps the order.
            descending: Whether the largest comes first.
        """
        fresh = [column.heading for column in columns] != [column.heading for column in self.columns.columns]
        self._telling = False
        self.columns.set_columns(columns)
        header = self.horizontalHeader()
        assert header is not None
        if fresh and columns:
            for number in range(len(columns)):
                wide = QHeaderView.ResizeMode.Stretch if number == stretch else QHeaderView.ResizeMode.Interactive
                header.setSectionResizeMode(number, wide)
            fit_columns(self)
            port = self.viewport()
            others = sum(self.columnWidth(number) for number in range(len(columns)) if number != stretch)
            if port is not None and port.width() - others < _LEAST_STRETCHED:  # rather scrolled than not to be read
                header.setSectionResizeMode(stretch, QHeaderView.ResizeMode.Interactive)
                self.setColumnWidth(stretch, _LEAST_STRETCHED)
        if sorted_by is not None and columns:
            self.sortByColumn(sorted_by, Qt.SortOrder.DescendingOrder if descending else Qt.SortOrder.AscendingOrder)
        self._telling = True

    def set_filter(self, text: str) -> None:
        """Shows only rows in which a cell contains the text."""
        self._telling = False
        self.columns.set_filter(text)
        self._telling = True

    def chosen(self) -> int:
        """The row chosen, by its place in the columns; -1 for none."""
        selection = self.selectionModel()
        rows = selection.selectedRows() if selection is not None else []
        return self.columns.source_row(rows[0].row()) if rows else -1

    def show_chosen(self, row: int) -> None:
        """Marks a row without telling; -1 for none."""
        self._telling = False
        at = self.columns.table_row(row)
        if at < 0:
            self.clearSelection()
        elif self.chosen() != row:
            self.selectRow(at)
            self.scrollTo(self.columns.index(at, 0))
        self._telling = True

    def choose_next(self, step: int) -> None:
        """Chooses the row below or above the chosen one, in the order shown; tells."""
        count = self.columns.rowCount()
        if count:
            at = self.columns.table_row(self.chosen())
            row = (at + step) % count if at >= 0 else 0
            self.selectRow(row)
            self.scrollTo(self.columns.index(row, 0))

    def _on_selection(self) -> None:
        chosen = self.chosen()
        if self._telling and chosen >= 0:
            self.row_chosen.emit(chosen)
