"""Two results at once: how they are shown, and a table of what changed in which object."""

from __future__ import annotations

import enum

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import (
    QButtonGroup,
    QComboBox,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QStackedLayout,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from app.column_table import ColumnTable
from app.compare_job import Compared
from app.elided_label import ElidedLabel
from app.filter_line import FilterLine
from viewer.compare_changes import SORTED_BY, change_columns, overall


class CompareMode(enum.StrEnum):
    """How two results are shown."""

    ONE = "one"
    SIDE = "side"
    WIPE = "wipe"
    DIFFERENCE = "difference"


MODES: tuple[tuple[CompareMode, str, str], ...] = (
    (CompareMode.ONE, "One", "One result at a time; the flicker key shows the other"),
    (CompareMode.SIDE, "Side by side", "This result to the left, the other to the right, on one camera"),
    (CompareMode.WIPE, "Wipe", "A line in the view, to be dragged: this result to the left, the other to the right"),
    (CompareMode.DIFFERENCE, "Difference", "This result minus the other: orange is brighter here, blue is darker"),
)
_EMPTY = (
    "Compare this result with another one of the same scene:\n"
    "a folder that was saved, or what the bake before looked like."
)


class ComparePanel(QWidget):
    """Shows a comparison; asks for others."""

    folder_requested = pyqtSignal()
    before_requested = pyqtSignal()
    end_requested = pyqtSignal()
    mode_chosen = pyqtSignal(str)
    flip_changed = pyqtSignal(bool)
    column_chosen = pyqtSignal(int)
    row_chosen = pyqtSignal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._stack = QStackedLayout(self)
        self._stack.addWidget(self._build_empty())
        self._stack.addWidget(self._build_full())

    def _build_empty(self) -> QWidget:
        page = QWidget()
        self._message = QLabel(_EMPTY)
        self._message.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._message.setWordWrap(True)
        self.open = QPushButton("Compare with result …")
        self.open.setToolTip("Choose the folder of another result of this scene")
        self.open.clicked.connect(self.folder_requested)
        self.before = QPushButton("With the bake before")
        self.before.setToolTip("What this scene looked like before the last bake of this session")
        self.before.clicked.connect(self.before_requested)
        row = QHBoxLayout()
        row.addStretch(1)
        row.addWidget(self.open)
        row.addWidget(self.before)
        row.addStretch(1)
        column = QVBoxLayout(page)
        column.addStretch(1)
        column.addWidget(self._message)
        column.addLayout(row)
        column.addStretch(1)
        return page

    def _build_full(self) -> QWidget:
        page = QWidget()
        self.modes = QButtonGroup(self)
        top = QHBoxLayout()
        for number, (_, text, tip) in enumerate(MODES):
            button = QToolButton()
            button.setText(text)
            button.setToolTip(tip)
            button.setCheckable(True)
            self.modes.addButton(button, number)
            top.addWidget(button)
        self.modes.idClicked.connect(lambda number: self.mode_chosen.emit(MODES[number][0].value))
        self.flip = QToolButton()
        self.flip.setText("Hold: other")
        self.flip.setToolTip("Shows the other result for as long as it is held; O switches to and fro")
        self.flip.pressed.connect(lambda: self.flip_changed.emit(True))
        self.flip.released.connect(lambda: self.flip_changed.emit(False))
        top.addWidget(self.flip)
        self.distance = QComboBox()
        self.distance.setToolTip("The distance whose changes the table lists")
        self.distance.activated.connect(lambda row: self.column_chosen.emit(row - 1))
        top.addSpacing(8)
        top.addWidget(self.distance)
        top.addStretch(1)
        self._filter = FilterLine("Filter by object or state", widest=220)
        top.addWidget(self._filter)
        self.end = QPushButton("End")
        self.end.setToolTip("Show this result alone again")
        self.end.clicked.connect(self.end_requested)
        top.addWidget(self.end)
        self.summary = ElidedLabel()
        self.table = ColumnTable()
        self.table.setToolTip("Click a row to select the object and fly to its largest change; click a heading to sort")
        self.table.row_chosen.connect(self.row_chosen)
        self._filter.textChanged.connect(self.table.set_filter)
        column = QVBoxLayout(page)
        column.setContentsMargins(4, 4, 4, 4)
        column.setSpacing(3)
        column.addLayout(top)
        column.addWidget(self.summary)
        column.addWidget(self.table, 1)
        return page

    def set_message(self, text: str = "") -> None:
        """Shows no comparison, and why; empty says how to begin one."""
        self._message.setText(text or _EMPTY)
        self._stack.setCurrentIndex(0)

    def set_available(self, *, result: bool, before: bool) -> None:
        """What a comparison could be begun with."""
        self.open.setEnabled(result)
        self.before.setEnabled(before)

    def set_mode(self, mode: CompareMode) -> None:
        """Marks the button of a mode."""
        button = self.modes.button([known for known, _, _ in MODES].index(mode))
        assert button is not None
        button.setChecked(True)

    def set_distances(self, labels: list[str], column: int) -> None:
        """The distances of the result in view; -1 chooses the blend."""
        self.distance.clear()
        self.distance.addItem("Blended")
        self.distance.addItems([f"AO at {label}" for label in labels])
        self.distance.setCurrentIndex(column + 1)

    def set_compared(self, compared: Compared, this: str, other: str) -> None:
        """Fills the table."""
        world, match = compared.wanted.result.world, compared.other.match
        columns = change_columns(world, match, compared.changes)
        first = not self.table.columns.columns
        self.table.set_columns(columns, sorted_by=SORTED_BY if first else None, descending=True)
        text = f"{this}  −  {other}:  {overall(compared.changes)}  ·  {match.summary}"
        self.summary.setText(text)
        self.summary.setToolTip(f"{text}\n{compared.other.path}")
        self._stack.setCurrentIndex(1)
