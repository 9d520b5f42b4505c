"""What validation and the bake found, by object: the list behind "never a silent repair"."""

from __future__ import annotations

from collections.abc import Sequence

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import QHBoxLayout, QLabel, QVBoxLayout, QWidget

from app.filter_line import FilterLine
from app.tables import Cell, RowsView
from bake.types import Finding

_SEVERITY = {"set-aside": (2, "#d8404a"), "warning": (1, "#c77700"), "info": (0, None)}


class FindingsTable(QWidget):
    """A row a finding; choosing one selects its object."""

    object_chosen = pyqtSignal(str)
    object_activated = pyqtSignal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._row_of: dict[str, int] = {}
        self._following = False
        self._count = QLabel()
        self._filter = FilterLine("Filter by object or finding", widest=280)
        self.view = RowsView(("Severity", "Object", "Finding", "Count", "Detail"), stretch=4)
        self.view.elide_middle(1)
        self.view.setSortingEnabled(True)
        self.view.setToolTip("Click a row to select its object, double-click to fly there")
        self.view.sortByColumn(0, Qt.SortOrder.DescendingOrder)
        self._filter.textChanged.connect(self._on_filter)
        selection = self.view.selectionModel()
        assert selection is not None
        selection.selectionChanged.connect(self._on_selection)
        self.view.doubleClicked.connect(self._on_double_click)
        top = QHBoxLayout()
        top.addWidget(self._count, 1)
        top.addWidget(self._filter)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.addLayout(top)
        layout.addWidget(self.view, 1)
        self._findings: tuple[Finding, ...] | None = None
        self.set_findings(())

    def set_findings(self, findings: Sequence[Finding]) -> None:
        """Replaces the rows."""
        if self._findings is not None and (findings is self._findings or tuple(findings) == self._findings):
            return
        self._findings = tuple(findings)
        self.view.set_rows([_row(finding) for finding in findings])
        self._row_of = {finding.object: row for row, finding in reversed(list(enumerate(findings)))}
        objects = len({finding.object for finding in findings})
        self._count.setText(f"{len(findings):,} findings on {objects:,} objects" if findings else "No findings.")

    def show_object(self, path: str) -> None:
        """Selects the first row of an object, without telling; a row of it that is selected stays."""
        row = self.view.chosen()
        if row is None or row[1].text != path:
            self._following = True
            self.view.show_row(self._row_of.get(path, -1))
            self._following = False

    def _on_filter(self, text: str) -> None:
        self.view.proxy.setFilterFixedString(text)

    def _on_selection(self) -> None:
        row = self.view.chosen()
        if row is not None and not self._following:
            self.object_chosen.emit(row[1].text)

    def _on_double_click(self) -> None:
        row = self.view.chosen()
        if row is not None:
            self.object_activated.emit(row[1].text)


def _row(finding: Finding) -> tuple[Cell, ...]:
    rank, color = _SEVERITY.get(finding.severity, (0, None))
    return (
        Cell(finding.severity, f"{rank} {finding.count:012}", color),
        Cell(finding.object),
        Cell(finding.what),
        Cell(f"{finding.count:,}", finding.count),
        Cell(finding.detail),
    )
