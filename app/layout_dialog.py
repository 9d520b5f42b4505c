"""The user's own layouts in a list: use, rename, delete."""

from __future__ import annotations

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from app.layouts import SavedLayouts


class LayoutDialog(QDialog):
    """Edits the saved layouts; a name is changed by a double click on it.

    Args:
        layouts: The saved ones.
        parent: The window.
    """

    chosen = pyqtSignal(str)
    changed = pyqtSignal()

    def __init__(self, layouts: SavedLayouts, parent: QWidget) -> None:
        super().__init__(parent)
        self._layouts = layouts
        self.setWindowTitle("Saved layouts")
        self.resize(360, 280)
        self._hint = QLabel()
        self._hint.setWordWrap(True)
        self.list = QListWidget()
        self.list.setToolTip("Double-click a name to change it")
        self.list.itemChanged.connect(self._on_renamed)
        self.list.currentRowChanged.connect(lambda _row: self._refresh())
        self._use = QPushButton("Use")
        self._use.setToolTip("Arrange the panels like this")
        self._use.clicked.connect(lambda: self.chosen.emit(self.current))
        self._delete = QPushButton("Delete")
        self._delete.setToolTip("Forget this layout")
        self._delete.clicked.connect(self._on_delete)
        row = QHBoxLayout()
        row.addWidget(self._use)
        row.addWidget(self._delete)
        row.addStretch(1)
        close = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        close.rejected.connect(self.reject)
        row.addWidget(close)
        layout = QVBoxLayout(self)
        layout.addWidget(self._hint)
        layout.addWidget(self.list, 1)
        layout.addLayout(row)
        self._fill()

    @property
    def current(self) -> str:
        """The layout chosen; empty if none."""
        item = self.list.currentItem()
        return str(item.data(Qt.ItemDataRole.UserRole)) if item is not None else ""

    def _fill(self) -> None:
        self.list.blockSignals(True)
        self.list.clear()
        for name in self._layouts.names():
            item = QListWidgetItem(name)
            item.setData(Qt.ItemDataRole.UserRole, name)
            item.setFlags(item.flags() | Qt.ItemFlag.ItemIsEditable)
            self.list.addItem(item)
        self.list.setCurrentRow(0)
        self.list.blockSignals(False)
        self._refresh()

    def _refresh(self) -> None:
        for button in (self._use, self._delete):
            button.setEnabled(bool(self.current))
        self._hint.setText(
            "Double-click a name to change it." if self.list.count() else "None yet: use View → Layout → Save layout."
        )

    def _on_renamed(self, item: QListWidgetItem) -> None:
        former, name = str(item.data(Qt.ItemDataRole.UserRole)), item.text().strip()
        if name and name != former:
            self._layouts.rename(former, name)
            self.changed.emit()
        self._fill()

    def _on_delete(self) -> None:
        self._layouts.delete(self.current)
        self.changed.emit()
        self._fill()
