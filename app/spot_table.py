"""The suspicious spots of a bake: sortable, filterable by object, cause and sign."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import QCheckBox, QComboBox, QHBoxLayout, QHeaderView, QVBoxLayout, QWidget

from app.elided_label import ElidedLabel
from app.filter_line import FilterLine
from app.tables import Cell, RowsView
from bake.explain.cause_names import CauseKind
from bake.explain.spots import Spots
from viewer.instance_rows import Column
from viewer.spot_rows import spot_columns

_ALL = "All causes"
_RANK, _OBJECT, _CAUSE = 0, 1, 2
_WIDEST_OBJECT = 230  # pixels at first: signs need some too; longer paths are cut in the middle


@dataclass(frozen=True, slots=True)
class ListedSpots:
    """Spots as the table shows them: what to make of 2000 takes a while, and can be made in any thread.

    Attributes:
        headings, tips: Of its columns.
        rows: Cells of each spot, in the order of the spots.
    """

    headings: Sequence[str]
    tips: Sequence[str]
    rows: Sequence[tuple[Cell, ...]]


def listed_spots(spots: Spots, paths: tuple[str, ...]) -> ListedSpots:
    """Makes the rows of a table.

    Args:
        spots: What is to be listed.
        paths: Of the objects by their numbers.
    """
    columns = spot_columns(spots, paths)
    rows = zip(*(_cells(column) for column in columns), strict=True)
    meant = [_with_meaning(row, kind) for row, kind in zip(rows, spots.guess, strict=True)]
    return ListedSpots([column.heading for column in columns], [column.tip for column in columns], meant)


class SpotTable(QWidget):
    """A row a spot; choosing one asks to show it, a double click to explain it."""

    spot_chosen = pyqtSignal(int)
    spot_activated = pyqtSignal(int)
    distance_chosen = pyqtSignal(int)
    marks_toggled = pyqtSignal(bool)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._spots: Spots | None = None
        self._causes: list[str] = []
        self.distance = QComboBox()
        self.distance.setToolTip("At which distance values are looked at")
        self.distance.activated.connect(self.distance_chosen)
        self.cause = QComboBox()
        self.cause.setToolTip("Show only spots of one likely cause")
        self.cause.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.cause.setMinimumContentsLength(16)
        self.cause.addItem(_ALL)
        for kind in CauseKind:
            self.cause.addItem(kind.heading)
            self.cause.setItemData(self.cause.count() - 1, kind.meaning, Qt.ItemDataRole.ToolTipRole)
        self.cause.currentIndexChanged.connect(self._refill)
        self.marks = QCheckBox("Marks")
        self.marks.setToolTip("Mark the vertices of all spots in the view")
        self.marks.toggled.connect(self.marks_toggled)
        self._count = ElidedLabel()
        self._filter = FilterLine("Object or sign", widest=240)
        self._filter.setMinimumWidth(120)
        self.view = RowsView(("Object",), stretch=0)
        self.view.setSortingEnabled(True)
        self.view.setTextElideMode(Qt.TextElideMode.ElideMiddle)  # the end of a path tells the most
        self.view.setToolTip("Click a row to fly there, double-click to have it explained; click a heading to sort")
        self._filter.textChanged.connect(self.view.proxy.setFilterFixedString)
        selection = self.view.selectionModel()
        assert selection is not None
        selection.selectionChanged.connect(self._on_selection)
        self.view.doubleClicked.connect(self._on_double_click)
        top = QHBoxLayout()
        for widget in (self.distance, self.cause, self.marks):
            top.addWidget(widget)
        top.addWidget(self._count, 1)
        top.addWidget(self._filter)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.addLayout(top)
        layout.addWidget(self.view, 1)
        self._headings: Sequence[str] = ()
        self._rows: Sequence[tuple[Cell, ...]] = ()
        self.set_message("No result.")

    def set_message(self, text: str) -> None:
        """Shows no rows, and why."""
        self._spots, self._rows, self._causes = None, (), []
        self.view.rows.set_rows([])
        for widget in (self.distance, self.cause, self.marks, self._filter):
            widget.setEnabled(False)
        self._count.setText(text)

    def set_distances(self, labels: list[str], chosen: int) -> None:
        """The baked distances, and which is looked at."""
        self.distance.clear()
        self.distance.addItems(labels)
        self.distance.setCurrentIndex(chosen)

    def set_spots(self, spots: Spots, listed: ListedSpots) -> None:
        """Replaces the rows."""
        self._spots, self._rows = spots, listed.rows
        self._causes = [kind.heading for kind in spots.guess]
        for widget in (self.distance, self.cause, self.marks, self._filter):
            widget.setEnabled(True)
        if listed.headings != self._headings:
            self._headings = listed.headings
            self.view.rows.set_headings(listed.headings, listed.tips)
            header = self.view.horizontalHeader()
            assert header is not None
            for number in range(len(listed.headings)):
                is_last = number == len(listed.headings) - 1
                mode = QHeaderView.ResizeMode.Stretch if is_last else QHeaderView.ResizeMode.Interactive
                header.setSectionResizeMode(number, mode)
            self.view.sortByColumn(_RANK, Qt.SortOrder.AscendingOrder)
        self._refill()

    def step(self, step: int) -> None:
        """Chooses the row below or above the chosen one, as the table is sorted and filtered."""
        rows, selection = self.view.proxy.rowCount(), self.view.selectionModel()
        if rows and selection is not None:
            chosen = selection.selectedRows()
            row = (chosen[0].row() + step) % rows if chosen else 0
            self.view.selectRow(row)
            self.view.scrollTo(self.view.proxy.index(row, 0))

    def chosen(self) -> int:
        """The chosen spot, -1 for none."""
        row = self.view.chosen()
        return -1 if row is None or self._spots is None else int(row[_RANK].key)

    def _refill(self) -> None:
        if self._spots is None:
            return
        wanted = self.cause.currentText() if self.cause.currentIndex() > 0 else ""
        rows = [row for row, cause in zip(self._rows, self._causes, strict=True) if not wanted or cause == wanted]
        self.view.set_rows(rows)
        self.view.setColumnWidth(_OBJECT, min(self.view.columnWidth(_OBJECT), _WIDEST_OBJECT))
        more = f", {self._spots.left_out:,} lighter ones left out" if self._spots.left_out else ""
        of = f" of {len(self._rows):,}" if len(rows) < len(self._rows) else ""
        self._count.setText(f"{len(rows):,}{of} spots{more}" if self._rows else "No suspicious spots.")

    def _on_selection(self) -> None:
        spot = self.chosen()
        if spot >= 0:
            self.spot_chosen.emit(spot)

    def _on_double_click(self) -> None:
        spot = self.chosen()
        if spot >= 0:
            self.spot_activated.emit(spot)


def _cells(column: Column) -> list[Cell]:
    tip = "" if column.heading == "Object" else column.tip  # paths may be cut short, so theirs are themselves
    return [Cell(text, key, tip=tip) for text, key in zip(column.texts, column.keys, strict=True)]


def _with_meaning(row: tuple[Cell, ...], kind: CauseKind) -> tuple[Cell, ...]:
    """The row, its cause with what that means."""
    cause = replace(row[_CAUSE], tip=f"{kind.meaning} {row[_CAUSE].tip}.")
    return (*row[:_CAUSE], cause, *row[_CAUSE + 1 :])
