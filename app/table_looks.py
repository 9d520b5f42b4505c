"""What all tables look like and how rows are chosen in them."""

from __future__ import annotations

from PyQt6.QtWidgets import QAbstractItemView, QHeaderView, QTableView

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
