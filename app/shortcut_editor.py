"""The editor of shortcuts: every action with its keys, conflicts shown before anything changes."""

from __future__ import annotations

from PyQt6.QtCore import QSortFilterProxyModel, Qt
from PyQt6.QtGui import QKeySequence, QStandardItem, QStandardItemModel
from PyQt6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QHeaderView,
    QKeySequenceEdit,
    QLabel,
    QPushButton,
    QTableView,
    QVBoxLayout,
    QWidget,
)

from app.action_registry import ActionRegistry
from app.filter_line import FilterLine

_NAME = Qt.ItemDataRole.UserRole


class ShortcutEditor(QDialog):
    """Gives actions other keys; each change holds at once and is remembered.

    Args:
        registry: The actions.
        parent: The window.
    """

    def __init__(self, registry: ActionRegistry, parent: QWidget) -> None:
        super().__init__(parent)
        self._registry = registry
        self.setWindowTitle("Shortcuts")
        self.resize(640, 520)
        tip = "Show only actions whose name, description or keys contain this text"
        self._filter = FilterLine("Filter by action or key", tip)
        self._model = QStandardItemModel(0, 4, self)
        self._model.setHorizontalHeaderLabels(["Menu", "Action", "Keys", "What it does"])
        self._proxy = QSortFilterProxyModel(self)
        self._proxy.setSourceModel(self._model)
        self._proxy.setFilterKeyColumn(-1)
        self._proxy.setFilterCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
        self._filter.textChanged.connect(self._proxy.setFilterFixedString)
        self.table = QTableView()
        self.table.setModel(self._proxy)
        self.table.setSelectionBehavior(QTableView.SelectionBehavior.SelectRows)
        self.table.setSelectionMode(QTableView.SelectionMode.SingleSelection)
        self.table.setEditTriggers(QTableView.EditTrigger.NoEditTriggers)
        self.table.setShowGrid(False)
        rows, columns, selection = (
            self.table.verticalHeader(),
            self.table.horizontalHeader(),
            self.table.selectionModel(),
        )
        assert rows is not None
        assert columns is not None
        assert selection is not None
        rows.hide()
        rows.setDefaultSectionSize(self.fontMetrics().height() + 8)
        columns.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        columns.setStretchLastSection(True)
        selection.currentRowChanged.connect(lambda _now, _before: self._show_current())
        layout = QVBoxLayout(self)
        layout.addWidget(self._filter)
        layout.addWidget(self.table, 1)
        layout.addLayout(self._build_editor())
        self._conflict = QLabel()
        self._conflict.setWordWrap(True)
        self._conflict.setObjectName("hint")
        layout.addWidget(self._conflict)
        layout.addWidget(self._build_buttons())
        self._fill()

    def _build_editor(self) -> QHBoxLayout:
        self.edit = QKeySequenceEdit()
        self.edit.setMaximumSequenceLength(1)
        self.edit.setToolTip("Click here and press the new keys")
        self.edit.setClearButtonEnabled(True)
        self.edit.keySequenceChanged.connect(self._show_conflict)
        self._set = QPushButton("Set")
        self._set.setToolTip("Give these keys to the action, in place of those it has")
        self._set.clicked.connect(lambda: self._give(replace=True))
        self._also = QPushButton("Add")
        self._also.setToolTip("Give these keys to the action beside those it has")
        self._also.clicked.connect(lambda: self._give(replace=False))
        self._reset = QPushButton("Default")
        self._reset.setToolTip("The keys that this action comes with")
        self._reset.clicked.connect(self._on_reset)
        row = QHBoxLayout()
        row.addWidget(QLabel("Keys"))
        row.addWidget(self.edit, 1)
        for button in (self._set, self._also, self._reset):
            button.setAutoDefault(False)
            row.addWidget(button)
        return row

    def _build_buttons(self) -> QDialogButtonBox:
        buttons = QDialogButtonBox()
        everything = buttons.addButton("Reset all", QDialogButtonBox.ButtonRole.ResetRole)
        close = buttons.addButton(QDialogButtonBox.StandardButton.Close)
        assert everything is not None
        assert close is not None
        everything.setToolTip("Give every action the keys it comes with")
        everything.setAutoDefault(False)
        everything.clicked.connect(self._on_reset_all)
        close.setToolTip("Close this window; changes hold already")
        close.setAutoDefault(False)
        close.clicked.connect(self.accept)
        return buttons

    def choose(self, name: str) -> None:
        """Goes to an action."""
        for row in range(self._model.rowCount()):
            item = self._model.item(row, 0)
            if item is not None and item.data(_NAME) == name:
                self.table.selectRow(self._proxy.mapFromSource(item.index()).row())

    def conflict(self) -> str:
        """What is said about the keys typed."""
        return self._conflict.text()

    @property
    def current(self) -> str:
        """The action chosen; empty if none."""
        index = self.table.currentIndex()
        return str(index.siblingAtColumn(0).data(_NAME)) if index.isValid() else ""

    def _fill(self) -> None:
        name = self.current
        self._model.setRowCount(0)
        for spec in self._registry.specs:
            keys = ", ".join(key.toString() for key in self._registry.keys(spec.id))
            row = [QStandardItem(text) for text in (spec.menu, spec.title, keys, spec.tip)]
            row[0].setData(spec.id, _NAME)
            if keys != ", ".join(QKeySequence(key).toString() for key in spec.keys):
                font = row[2].font()
                font.setBold(True)
                row[2].setFont(font)
                row[2].setToolTip(f"Changed; comes with {', '.join(spec.keys) or 'none'}")
            self._model.appendRow(row)
        self.choose(name)
        self._show_current()

    def _show_current(self) -> None:
        name = self.current
        for widget in (self.edit, self._set, self._also, self._reset):
            widget.setEnabled(bool(name))
        keys = self._registry.keys(name) if name else []
        self.edit.setKeySequence(keys[0] if keys else QKeySequence())
        self._show_conflict()

    def _show_conflict(self) -> None:
        key = self.edit.keySequence()
        owner = self._registry.owner_of(key) if not key.isEmpty() else ""
        text = ""
        if owner and owner != self.current:
            title = next(spec.title for spec in self._registry.specs if spec.id == owner)
            text = f"{key.toString()} belongs to “{title}”, which will lose it."
        self._conflict.setText(text)

    def _give(self, *, replace: bool) -> None:
        name, key = self.current, self.edit.keySequence()
        if name:
            others = [] if replace else [known for known in self._registry.keys(name) if known != key]
            self._registry.set_keys(name, [*others, key])
            self._fill()

    def _on_reset(self) -> None:
        name = self.current
        spec = next((spec for spec in self._registry.specs if spec.id == name), None)
        if spec is not None:
            self._registry.set_keys(name, [QKeySequence(key) for key in spec.keys])
            self._fill()

    def _on_reset_all(self) -> None:
        self._registry.reset_keys()
        self._fill()
