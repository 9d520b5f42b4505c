"""Trees, fog boxes, scalars and LODs as tables, one kind at a time."""

from __future__ import annotations

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import QComboBox, QHBoxLayout, QHeaderView, QLabel, QVBoxLayout, QWidget

from app.document import Document
from app.filter_line import FilterLine
from app.tables import Cell, RowsView
from viewer.instance_rows import KINDS, Column, available_kinds, instance_columns


class InstanceTable(QWidget):
    """A row an instance; choosing one selects its object."""

    object_chosen = pyqtSignal(int)
    object_activated = pyqtSignal(int)

    def __init__(self, document: Document, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._document = document
        self._row_of: dict[str, int] = {}
        self._following = False
        self._kind = QComboBox()
        self._kind.setToolTip("What the table lists")
        self._kind.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
        self._kind.currentIndexChanged.connect(self._refill)
        self._count = QLabel()
        self._filter = FilterLine("Filter by path", widest=240)
        self.view = RowsView(("Object",), stretch=0)
        self.view.setSortingEnabled(True)
        self.view.sortByColumn(0, Qt.SortOrder.AscendingOrder)
        self.view.setToolTip("Click a row to select its object, double-click to fly there; click a heading to sort")
        self._filter.textChanged.connect(self.view.proxy.setFilterFixedString)
        selection = self.view.selectionModel()
        assert selection is not None
        selection.selectionChanged.connect(lambda: self._tell(self.object_chosen))
        self.view.doubleClicked.connect(lambda: self._tell(self.object_activated))
        top = QHBoxLayout()
        top.addWidget(self._kind)
        top.addWidget(self._count, 1)
        top.addWidget(self._filter)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.addLayout(top)
        layout.addWidget(self.view, 1)
        document.result_changed.connect(self._on_result)
        document.selection_changed.connect(self._follow)
        self._on_result()

    def set_kind(self, kind: str) -> None:
        """Shows the table of one of `KINDS`."""
        row = self._kind.findText(kind)
        if row >= 0:
            self._kind.setCurrentIndex(row)

    def _on_result(self) -> None:
        kept = self._kind.currentText()
        values, result = self._document.values, self._document.result
        kinds = [] if values is None or result is None else available_kinds(result)
        self._kind.blockSignals(True)
        self._kind.clear()
        self._kind.addItems([kind for kind in KINDS if kind in kinds])
        self._kind.setCurrentIndex(max(self._kind.findText(kept), 0) if kinds else -1)
        self._kind.blockSignals(False)
        self._kind.setEnabled(bool(kinds))
        self._filter.setEnabled(bool(kinds))
        self._refill()

    def _refill(self) -> None:
        result, kind = self._document.result, self._kind.currentText()
        if result is None or not kind:
            self.view.rows.set_headings(("Object",))
            self._row_of = {}
            self._count.setText("No instances." if result is None else "This result has no instances.")
            return
        columns = instance_columns(result, kind)
        self.view.rows.set_headings([column.heading for column in columns])
        header = self.view.horizontalHeader()
        assert header is not None
        for number in range(len(columns)):
            stretch = QHeaderView.ResizeMode.Stretch if number == 0 else QHeaderView.ResizeMode.Interactive
            header.setSectionResizeMode(number, stretch)
        rows = list(zip(*(_cells(column) for column in columns), strict=True))
        self.view.set_rows(rows)
        self._row_of = {row[0].text: number for number, row in enumerate(rows)}
        self._follow()
        self._count.setText(f"{len(rows):,} rows")

    def _follow(self) -> None:
        """Selects the row of the selected object, without telling."""
        document = self._document
        path = "" if document.world is None or document.selected < 0 else document.world.object_paths[document.selected]
        self._following = True
        self.view.show_row(self._row_of.get(path, -1))
        self._following = False

    def _tell(self, signal: object) -> None:
        row, world = self.view.chosen(), self._document.world
        if self._following:
            return
        if row is not None and world is not None and row[0].text in world.object_paths:
            signal.emit(world.object_paths.index(row[0].text))  # type: ignore[attr-defined]


def _cells(column: Column) -> list[Cell]:
    return [Cell(text, key, tip=column.tip) for text, key in zip(column.texts, column.keys, strict=True)]
