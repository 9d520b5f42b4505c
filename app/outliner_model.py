"""The outliner's rows: the object tree with role, triangles, visibility and stale marks of the document."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's model functions a0)

from __future__ import annotations

import enum
from collections.abc import Iterable
from typing import Any

import numpy as np
from PyQt6.QtCore import QAbstractItemModel, QItemSelection, QItemSelectionRange, QModelIndex, QObject, Qt

from app.document import Document
from app.object_tree import ObjectTree
from bake.types import BoolArray, Int64Array, Role


class Column(enum.IntEnum):
    """What a column shows."""

    NAME = 0
    ROLE = 1
    TRIANGLES = 2
    EYE = 3


class Mark(enum.Enum):
    """How an object stands to the result in view."""

    FRESH = ""
    STALE = "changed since the bake"
    GONE = "no longer in the scene"


MARK_ROLE = int(Qt.ItemDataRole.UserRole)
SHOWN_ROLE = MARK_ROLE + 1
"""Share of the objects of a row that is drawn, 0 to 1."""

_TITLES = ("Object", "Role", "Faces", "")
_TIPS = (
    "Path of the object; click to sort, once more to turn the order round, a third time for the order of the scene",
    "What the object is to the bake; change it by a right click",
    "Triangles, of a group those of everything in it",
    "Whether it is drawn and can be clicked",
)


_OF_GROUP = Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable
_OF_LEAF = _OF_GROUP | Qt.ItemFlag.ItemNeverHasChildren  # made once: views ask for them again and again


class OutlinerModel(QAbstractItemModel):
    """Rows are made when they are looked at, so that thousands of objects cost nothing."""

    def __init__(self, document: Document, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._document = document
        self.tree = ObjectTree(())
        self._triangles: Int64Array = np.zeros(0, np.int64)
        self._totals = self._counts = self._shown = self._triangles
        self._roles: list[str] = []
        self._marks: list[Mark] = []
        self._marked: Int64Array = self._triangles
        self._filter = ""
        self._order: tuple[int, bool] = (-1, False)

    # What is shown

    def rebuild(self) -> None:
        """Starts over with the document's world."""
        self.beginResetModel()
        world = self._document.world
        self.tree = ObjectTree(world.object_paths if world is not None else ())
        self._triangles = np.diff(world.first_face) if world is not None else np.zeros(0, np.int64)
        self._totals = self.tree.totals(self._triangles)
        self._counts = self.tree.totals(np.ones(len(self._triangles), np.int64))
        self._look()
        self._arrange()
        self.endResetModel()

    def refresh(self) -> bool:
        """Follows visibility, roles and stale marks.

        Returns:
            Whether rows came or went, so that the view has to find its place again.
        """
        before = (self._roles, self._marks)
        self._look()
        moves = self._order[0] in (Column.ROLE, Column.EYE) or "is:" in self._filter
        if moves or (self._filter.strip() and before != (self._roles, self._marks)):
            self.beginResetModel()
            self._arrange()
            self.endResetModel()
            return True
        if self.tree.children(-1):
            last = len(self.tree.children(-1)) - 1
            self.dataChanged.emit(self.index(0, 0), self.index(last, len(Column) - 1))
        return False

    def set_filter(self, text: str) -> None:
        """Shows only what answers all words of a text, see `matching`."""
        if text != self._filter:
            self.beginResetModel()
            self._filter = text
            self._arrange()
            self.endResetModel()

    def sort(self, column: int, order: Qt.SortOrder = Qt.SortOrder.AscendingOrder) -> None:
        """Sorts siblings by a column; -1 is the order of the scene."""
        wanted = (column, order is Qt.SortOrder.DescendingOrder)
        if wanted != self._order:
            self._order = wanted
            self.beginResetModel()
            self._arrange()
            self.endResetModel()

    @property
    def shown_count(self) -> int:
        """Number of objects that answer the filter."""
        return int(self.matching(self._filter).sum())

    def matching(self, text: str) -> BoolArray:
        """Objects that answer all words: letters of the path or the role, `is:stale`, `is:hidden`, `role:tree`."""
        world = self._document.world
        if world is None:
            return np.zeros(0, bool)
        wanted = np.ones(world.object_count, bool)
        for word in text.lower().split():
            if word.startswith("is:"):
                wanted &= self._in_state(word[3:])
            elif word.startswith("role:"):
                wanted &= np.array([role == word[5:] for role in self._roles], bool)
            else:
                names = zip(world.object_paths, self._roles, strict=True)
                wanted &= np.array([word in path.lower() or word in role for path, role in names], bool)
        return wanted

    def _in_state(self, state: str) -> BoolArray:
        if state and "hidden".startswith(state):
            return ~self._document.visible
        if state and "shown".startswith(state):
            return self._document.visible.copy()
        return np.array([mark is not Mark.FRESH for mark in self._marks], bool)

    def _arrange(self) -> None:
        column, descending = self._order
        keys = {
            Column.NAME: self.tree.name_key,
            Column.ROLE: self._role_of,
            Column.TRIANGLES: lambda node: int(self._totals[node]),
            Column.EYE: lambda node: float(self._shown[node]),
        }
        self.tree.show(
            self.matching(self._filter) if self._filter.strip() else None,
            keys.get(Column(column)) if column >= 0 else None,
            descending,
        )

    def _look(self) -> None:
        document, world = self._document, self._document.world
        self._roles, self._marks = [], []
        if world is not None:
            current = document.current
            if current is None:
                self._roles = [role.value for role in world.object_roles]
                self._marks = [Mark.FRESH] * world.object_count
            else:
                pairs = list(zip(world.object_paths, world.object_roles, strict=True))
                self._roles = [current.role_of(path, role).value for path, role in pairs]
                self._marks = [
                    Mark.STALE if path in current.stale else Mark.GONE if path in current.gone else Mark.FRESH
                    for path, _ in pairs
                ]
        visible = document.visible if len(document.visible) == len(self._roles) else np.ones(len(self._roles), bool)
        self._shown = self.tree.totals(visible.astype(np.int64)) / np.maximum(self._counts, 1)
        self._marked = self.tree.totals(np.array([mark is not Mark.FRESH for mark in self._marks], np.int64))

    # Rows and objects

    def node(self, index: QModelIndex) -> int:
        """The node of a row."""
        return int(index.internalId()) if index.isValid() else -1

    def index_of(self, obj: int, column: int = 0) -> QModelIndex:
        """The row of an object; invalid if it is filtered out."""
        if not 0 <= obj < len(self.tree.node_of):
            return QModelIndex()
        return self.index_of_node(self.tree.node_of[obj], column)

    def index_of_node(self, node: int, column: int = 0) -> QModelIndex:
        """The row of a node; invalid if it is filtered out."""
        row = self.tree.row(node)
        return self.createIndex(row, column, node) if row >= 0 else QModelIndex()

    def objects_in(self, selection: QItemSelection) -> list[int]:
        """The objects of selected rows, those in selected groups included."""
        found: set[int] = set()
        for span in selection:
            siblings = self._children(self.node(span.parent()))
            for node in siblings[span.top() : span.bottom() + 1]:
                found.update(self.tree.objects_below(node))
        return sorted(found)

    def selection_of(self, objects: Iterable[int]) -> QItemSelection:
        """Rows of objects, as few ranges as there are runs of neighbours."""
        rows: dict[int, list[int]] = {}
        for obj in objects:
            node = self.tree.node_of[obj]
            if self.tree.row(node) >= 0:
                rows.setdefault(self.tree.parents[node], []).append(self.tree.row(node))
        selection = QItemSelection()
        for parent, numbers in rows.items():
            siblings, ordered = self._children(parent), np.sort(numbers)
            for run in np.split(ordered, np.flatnonzero(np.diff(ordered) > 1) + 1):
                first, last = int(run[0]), int(run[-1])
                selection.append(
                    QItemSelectionRange(
                        self.createIndex(first, 0, siblings[first]),
                        self.createIndex(last, len(Column) - 1, siblings[last]),
                    )
                )
        return selection

    def _children(self, node: int) -> list[int]:
        return self.tree.children(node)

    # Qt's questions

    def index(self, row: int, column: int, parent: QModelIndex = QModelIndex()) -> QModelIndex:  # noqa: B008
        """A row below another."""
        children = self._children(self.node(parent))
        return self.createIndex(row, column, children[row]) if 0 <= row < len(children) else QModelIndex()

    def parent(self, index: QModelIndex) -> QModelIndex:  # type: ignore[override]
        """The row above."""
        above = self.tree.parents[self.node(index)] if index.isValid() else -1
        return QModelIndex() if above < 0 else self.createIndex(self.tree.row(above), 0, above)

    def rowCount(self, parent: QModelIndex = QModelIndex()) -> int:  # noqa: B008
        """Rows below a row."""
        return len(self._children(self.node(parent))) if parent.column() <= 0 else 0

    def columnCount(self, parent: QModelIndex = QModelIndex()) -> int:  # noqa: B008
        """Always the same."""
        return len(Column)

    def hasChildren(self, parent: QModelIndex = QModelIndex()) -> bool:  # noqa: B008
        """Whether there are rows below a row."""
        return parent.column() <= 0 and self.tree.has_children(self.node(parent))

    def flags(self, index: QModelIndex) -> Qt.ItemFlag:
        """Every row can be selected."""
        if not index.isValid():
            return Qt.ItemFlag.NoItemFlags
        return _OF_GROUP if self.tree.has_children(self.node(index)) else _OF_LEAF

    def headerData(self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """Titles of the columns."""
        if orientation is Qt.Orientation.Horizontal:
            if role == Qt.ItemDataRole.DisplayRole:
                return _TITLES[section]
            if role == Qt.ItemDataRole.ToolTipRole:
                return _TIPS[section]
        return None

    def data(self, index: QModelIndex, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """What a cell says."""
        node, column = self.node(index), index.column()
        if role == Qt.ItemDataRole.DisplayRole:
            match column:
                case Column.NAME:
                    return self.tree.names[node]
                case Column.ROLE:
                    return self._role_of(node)
                case Column.TRIANGLES:
                    return f"{self._totals[node]:,}"
                case _:
                    return None
        if role == MARK_ROLE:
            return self._mark_of(node) is not Mark.FRESH
        if role == SHOWN_ROLE:
            return float(self._shown[node])
        if role == Qt.ItemDataRole.ToolTipRole:
            return self._tip(node, column)
        if role == Qt.ItemDataRole.TextAlignmentRole and column == Column.TRIANGLES:
            return Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        if role == Qt.ItemDataRole.AccessibleTextRole and column == Column.EYE:
            return "drawn" if self._shown[node] == 1.0 else "hidden" if self._shown[node] == 0.0 else "partly drawn"
        return None

    def _role_of(self, node: int) -> str:
        own = self.tree.objects[node]
        if own >= 0:
            return self._roles[own]
        return ""

    def _mark_of(self, node: int) -> Mark:
        own = self.tree.objects[node]
        if own >= 0 and self._marks[own] is not Mark.FRESH:
            return self._marks[own]
        return Mark.STALE if self._marked[node] else Mark.FRESH

    def _tip(self, node: int, column: int) -> str:
        own, lines = self.tree.objects[node], [self.tree.path(node)]
        if self.tree.has_children(node):
            lines.append(f"{self._counts[node]:,} objects, {self._totals[node]:,} triangles")
        if own >= 0 and self._marks[own] is not Mark.FRESH:
            lines.append(self._marks[own].value)
            world = self._document.world
            baked: Role | None = world.object_roles[own] if world is not None else None
            if baked is not None and baked.value != self._roles[own]:
                lines.append(f"baked as {baked.value}, now {self._roles[own]}")
        elif self._marked[node]:
            lines.append(f"{self._marked[node]:,} changed since the bake")
        if column == Column.EYE:
            lines.append("click to hide" if self._shown[node] else "click to show")
        return "\n".join(lines)
