"""Tables of rows: their order, what stays selected, and which row is meant."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from PyQt6.QtCore import Qt
from PyQt6.QtWidgets import QHeaderView
from pytestqt.qtbot import QtBot

from app.tables import Cell, RowsModel, RowsView


def _cells(keys: list[int]) -> list[tuple[Cell, ...]]:
    return [(Cell(f"row {number}"), Cell(str(key), key)) for number, key in enumerate(keys)]


@given(st.lists(st.integers(-5, 5), max_size=30), st.booleans())
def test_every_row_is_found_where_it_stands(keys: list[int], descending: bool) -> None:
    """Whatever the order, each row that was given has one place, and the keys are sorted."""
    model = RowsModel(("Name", "Key"))
    order = Qt.SortOrder.DescendingOrder if descending else Qt.SortOrder.AscendingOrder
    model.sort(1, order)
    model.set_rows(_cells(keys))
    shown = [model.row(row)[1].key for row in range(model.rowCount())]
    assert shown == sorted(keys, reverse=descending)
    for number in range(len(keys)):
        assert model.row(model.place_of(number)) == model.given(number)
    assert model.place_of(len(keys)) == -1


def test_the_selected_row_stays_selected(qtbot: QtBot) -> None:
    """Sorting anew moves the selection with its row; numbers are sorted as numbers."""
    view = RowsView(("Name", "Key"), stretch=0)
    qtbot.addWidget(view)
    view.set_rows(_cells([10, 9, 100]))
    view.setSortingEnabled(True)
    view.show_row(1)
    for order in (Qt.SortOrder.AscendingOrder, Qt.SortOrder.DescendingOrder):
        view.sortByColumn(1, order)
        chosen = view.chosen()
        assert chosen is not None
        assert chosen[0].text == "row 1"
    assert [view.proxy.index(row, 1).data() for row in range(3)] == ["100", "10", "9"]
    view.proxy.setFilterFixedString("100")
    assert view.proxy.rowCount() == 1
    view.show_row(0)
    assert view.chosen() is None


def test_numbers_among_texts_can_be_sorted() -> None:
    """A column of numbers and texts has an order too."""
    model = RowsModel(("Mixed",))
    model.set_rows([(Cell("b", "b"),), (Cell("1", 1),), (Cell("a", "a"),), (Cell("nan", np.nan),)])
    model.sort(0)
    assert [model.row(row)[0].text for row in range(4)] == ["1", "a", "b", "nan"]


def test_columns_are_as_wide_as_their_texts(qtbot: QtBot) -> None:
    """No text of the first rows is cut, and none gets more room than Qt itself gives it."""
    view = RowsView(("Name", "Path", "Number of things"), stretch=0)
    qtbot.addWidget(view)
    view.resize(2000, 300)
    view.set_rows([(Cell(f"row {n}"), Cell("x" * (n % 9) + "W" * (8 - n % 9)), Cell(str(n), n)) for n in range(20)])
    fitted = [view.columnWidth(column) for column in (1, 2)]
    view.resizeColumnsToContents()
    for own, of_qt in zip(fitted, (view.columnWidth(1), view.columnWidth(2)), strict=True):
        assert abs(own - of_qt) <= 4
    header = view.horizontalHeader()
    assert header is not None
    header.setSectionResizeMode(0, QHeaderView.ResizeMode.Interactive)  # as tables do whose last column stretches
    view.setColumnWidth(0, 500)
    view.set_rows([(Cell("1"), Cell("x"), Cell("1", 1))])
    assert view.columnWidth(0) < 100
