"""What all tables look like and how rows are chosen in them."""

from __future__ import annotations

from PyQt6.QtWidgets import QAbstractItemView, QHeaderView, QStyle, QTableView

_MEASURED_ROWS = 60
"""Rows whose texts say how wide columns are."""


def dress(table: QTableView) -> QHeaderView:
    """Makes a table one of whole rows, one chosen at a time and none edited; returns the header of its columns."""
    table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
    table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
    table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
    table.setAlternatingRowColors(True)
    table.setShowGrid(False)
    table.setWordWrap(False)
    rows, columns = table.verticalHeader(), table.horizontalHeader()
    assert rows is not None and columns is not None
    rows.hide()
    rows.setDefaultSectionSize(table.fontMetrics().height() + 6)
    columns.setHighlightSections(False)
    columns.setResizeContentsPrecision(_MEASURED_ROWS)
    return columns


def fit_columns(table: QTableView) -> None:
    """Makes columns as wide as their texts, but for those that stretch.

    `resizeColumnsToContents` asks for eight properties of every cell it measures, which takes forty times as long.
    """
    model, header, style = table.model(), table.horizontalHeader(), table.style()
    assert model is not None and header is not None and style is not None
    advance = table.fontMetrics().horizontalAdvance
    margin = 2 * style.pixelMetric(QStyle.PixelMetric.PM_FocusFrameHMargin, None, table) + 3
    rows = range(min(model.rowCount(), _MEASURED_ROWS))
    for column in range(model.columnCount()):
        if header.sectionResizeMode(column) != QHeaderView.ResizeMode.Stretch:
            texts = {str(model.index(row, column).data() or "") for row in rows}
            width = max((advance(text) for text in texts), default=0) + margin
            table.setColumnWidth(column, max(width, header.sectionSizeHint(column)))
