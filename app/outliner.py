"""The objects of the scene as a tree of their paths, with role, triangles and a tick for visibility."""

from __future__ import annotations

import numpy as np
from PyQt6.QtCore import Qt, QTimer, pyqtSignal
from PyQt6.QtWidgets import QHeaderView, QLabel, QLineEdit, QTreeWidget, QTreeWidgetItem, QVBoxLayout, QWidget

from app.document import Document

_INDEX = Qt.ItemDataRole.UserRole


class Outliner(QWidget):
    """Follows and sets the document's selection and visibility."""

    object_activated = pyqtSignal(int)

    def __init__(self, document: Document, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._document = document
        self._items: list[QTreeWidgetItem] = []
        self._filling = False
        self._filter = QLineEdit()
        self._filter.setPlaceholderText("Filter by path or role")
        self._filter.setClearButtonEnabled(True)
        self._filter.setToolTip("Show only objects whose path or role contains this text")
        self._filter.textChanged.connect(self._on_filter)
        self._tree = QTreeWidget()
        self._tree.setColumnCount(3)
        self._tree.setHeaderLabels(["Object", "Role", "Triangles"])
        self._tree.setUniformRowHeights(True)
        self._tree.setToolTip("Tick what is drawn; click to select, double-click to fly there")
        header = self._tree.header()
        assert header is not None
        header.setStretchLastSection(False)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        for column in (1, 2):
            header.setSectionResizeMode(column, QHeaderView.ResizeMode.ResizeToContents)
        self._tree.itemSelectionChanged.connect(self._on_select)
        self._tree.itemDoubleClicked.connect(self._on_double_click)
        self._tree.itemChanged.connect(self._on_tick)
        self._count = QLabel()
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.addWidget(self._filter)
        layout.addWidget(self._tree, 1)
        layout.addWidget(self._count)
        # Ticking a group changes many items: collect them.
        self._ticked = QTimer(self)
        self._ticked.setSingleShot(True)
        self._ticked.setInterval(0)
        self._ticked.timeout.connect(self._apply_ticks)
        document.world_changed.connect(self._rebuild)
        document.opened.connect(self._rebuild)
        document.selection_changed.connect(self._show_selection)
        document.visibility_changed.connect(self._show_visibility)
        self._rebuild()

    def item_of(self, index: int) -> QTreeWidgetItem:
        """The tree item of an object."""
        return self._items[index]

    def _rebuild(self) -> None:
        self._filling = True
        self._tree.setUpdatesEnabled(False)
        self._tree.clear()
        self._items = []
        world = self._document.world
        groups: dict[str, QTreeWidgetItem] = {}
        if world is not None:
            counts = np.diff(world.first_face)
            for index, path in enumerate(world.object_paths):
                group, _, name = path.rpartition("/")
                item = QTreeWidgetItem([name, str(world.object_roles[index]), f"{counts[index]:,}"])
                item.setTextAlignment(2, Qt.AlignmentFlag.AlignRight)
                item.setFlags(item.flags() | Qt.ItemFlag.ItemIsUserCheckable)
                shown = bool(self._document.visible[index])
                item.setCheckState(0, Qt.CheckState.Checked if shown else Qt.CheckState.Unchecked)
                item.setData(0, _INDEX, index)
                item.setToolTip(0, path)
                self._items.append(item)
                self._add(groups, group, item)
            self._count.setText(f"{world.object_count:,} objects, {world.face_count:,} triangles")
        else:
            self._count.setText("Nothing is open.")
        self._tree.expandToDepth(0 if len(self._items) > 60 else 2)
        self._tree.setUpdatesEnabled(True)
        self._filling = False
        if self._filter.text():
            self._on_filter(self._filter.text())

    def _add(self, groups: dict[str, QTreeWidgetItem], path: str, item: QTreeWidgetItem) -> None:
        if not path:
            self._tree.addTopLevelItem(item)
            return
        if path not in groups:
            outer, _, name = path.rpartition("/")
            group = QTreeWidgetItem([name, "", ""])
            group.setFlags(group.flags() | Qt.ItemFlag.ItemIsUserCheckable | Qt.ItemFlag.ItemIsAutoTristate)
            group.setCheckState(0, Qt.CheckState.Checked)
            group.setData(0, _INDEX, -1)
            groups[path] = group
            self._add(groups, outer, group)
        groups[path].addChild(item)

    def _on_filter(self, text: str) -> None:
        wanted = text.strip().lower()
        keep: set[int] = set()
        for item in self._items:
            matches = not wanted or wanted in item.toolTip(0).lower() or wanted in item.text(1).lower()
            item.setHidden(not matches)
            parent = item.parent()
            while matches and parent is not None and id(parent) not in keep:
                keep.add(id(parent))
                parent = parent.parent()
        groups = {id(group): group for item in self._items for group in _ancestors(item)}
        for key, group in groups.items():
            group.setHidden(key not in keep)
            if wanted:
                group.setExpanded(True)

    def _on_select(self) -> None:
        chosen = self._tree.selectedItems()
        if not self._filling:
            self._document.select(int(chosen[0].data(0, _INDEX)) if chosen else -1)

    def _on_double_click(self, item: QTreeWidgetItem) -> None:
        index = int(item.data(0, _INDEX))
        if index >= 0:
            self.object_activated.emit(index)

    def _on_tick(self, item: QTreeWidgetItem, column: int) -> None:
        if not self._filling and column == 0:
            self._ticked.start()

    def _apply_ticks(self) -> None:
        ticks = [item.checkState(0) is Qt.CheckState.Checked for item in self._items]
        self._document.set_visible(np.array(ticks, bool))

    def _show_visibility(self) -> None:
        self._filling = True
        for item, shown in zip(self._items, self._document.visible, strict=True):
            state = Qt.CheckState.Checked if shown else Qt.CheckState.Unchecked
            if item.checkState(0) is not state:
                item.setCheckState(0, state)
        self._filling = False

    def _show_selection(self) -> None:
        index = self._document.selected
        self._filling = True
        self._tree.clearSelection()
        if 0 <= index < len(self._items):
            self._items[index].setSelected(True)
            self._tree.scrollToItem(self._items[index])
        self._filling = False


def _ancestors(item: QTreeWidgetItem) -> list[QTreeWidgetItem]:
    found = []
    parent = item.parent()
    while parent is not None:
        found.append(parent)
        parent = parent.parent()
    return found
