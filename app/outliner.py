"""The outliner: the objects of the scene as a tree, with role, triangles, visibility and stale marks."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

from PyQt6.QtCore import QItemSelectionModel, QModelIndex, QPoint, Qt, pyqtSignal
from PyQt6.QtGui import QAction
from PyQt6.QtWidgets import (
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QMenu,
    QToolButton,
    QTreeView,
    QVBoxLayout,
    QWidget,
)

from app.document import Document
from app.filter_line import FilterLine
from app.outliner_delegate import EYE_WIDTH, OutlinerDelegate
from app.outliner_model import Column, OutlinerModel
from bake.types import Role

_FEW_ROWS = 60
_MOST_EXPANDED = 3000
_FILTERS = (
    ("Stale only", "is:stale", "Objects that have changed since the bake"),
    ("Hidden only", "is:hidden", "Objects that are not drawn"),
    ("Shown only", "is:shown", "Objects that are drawn"),
)


class Outliner(QWidget):
    """Follows and sets the document's selection and visibility."""

    object_activated = pyqtSignal(int)
    menu_requested = pyqtSignal(QPoint)  # where, in global pixels; the selection is what the menu is for

    def __init__(self, document: Document, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._document = document
        self._following = False
        self._expanded: set[int] = set()
        self.filter = FilterLine(
            "Filter by path or role",
            "Show only objects whose path or role contains all these words; also role:tree, is:stale, is:hidden",
        )
        self.filter.textChanged.connect(self._on_filter)
        self.model = OutlinerModel(document, self)
        self.tree = QTreeView()
        self.tree.setModel(self.model)
        self.tree.setItemDelegate(OutlinerDelegate(self.tree))
        self.tree.setUniformRowHeights(True)
        self.tree.setAllColumnsShowFocus(True)
        self.tree.setSelectionMode(QTreeView.SelectionMode.ExtendedSelection)
        self.tree.setEditTriggers(QTreeView.EditTrigger.NoEditTriggers)
        self.tree.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.tree.setExpandsOnDoubleClick(False)
        self.tree.setIndentation(14)
        self.tree.setTextElideMode(Qt.TextElideMode.ElideMiddle)  # names of copies differ at their ends
        self.tree.setAccessibleName("Objects")
        self._lay_out_header()
        self.tree.clicked.connect(self._on_click)
        self.tree.doubleClicked.connect(self._on_double_click)
        self.tree.expanded.connect(lambda index: self._on_expanded(index, True))
        self.tree.collapsed.connect(lambda index: self._on_expanded(index, False))
        self.tree.customContextMenuRequested.connect(self._on_menu)
        self._listen_to_selection()
        self._count = QLabel()
        self._count.setToolTip("Objects and triangles of the scene; how many answer the filter, are chosen or stale")
        top = QHBoxLayout()
        top.addWidget(self.filter, 1)
        top.addWidget(self._build_filter_button())
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.addLayout(top)
        layout.addWidget(self.tree, 1)
        layout.addWidget(self._count)
        document.world_changed.connect(self._rebuild)
        document.opened.connect(self._rebuild)
        document.selection_changed.connect(self._show_selection)
        document.visibility_changed.connect(self._refresh)
        document.current_changed.connect(self._refresh)
        self._rebuild()

    def _lay_out_header(self) -> None:
        header = self.tree.header()
        assert header is not None
        header.setStretchLastSection(False)
        header.setMinimumSectionSize(EYE_WIDTH)
        header.setSectionResizeMode(Column.NAME, QHeaderView.ResizeMode.Stretch)
        for column in (Column.ROLE, Column.TRIANGLES):
            header.setSectionResizeMode(column, QHeaderView.ResizeMode.Fixed)
            header.resizeSection(column, self.fontMetrics().horizontalAdvance("888,888") + 12)
        header.resizeSection(Column.ROLE, self.fontMetrics().horizontalAdvance("receiver") + 16)
        header.setSectionResizeMode(Column.EYE, QHeaderView.ResizeMode.Fixed)
        header.resizeSection(Column.EYE, EYE_WIDTH)
        header.setSortIndicatorClearable(True)
        header.setSortIndicator(-1, Qt.SortOrder.AscendingOrder)
        header.setSectionsClickable(True)
        header.setSortIndicatorShown(True)
        header.sortIndicatorChanged.connect(self._on_sort)

    def _build_filter_button(self) -> QToolButton:
        button = QToolButton()
        button.setText("▾")
        button.setToolTip("Common filters")
        button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        menu = QMenu(button)
        entries = [*_FILTERS, *((f"Role {role.value}", f"role:{role.value}", "Objects of this role") for role in Role)]
        for title, text, tip in entries:
            action = QAction(title, menu)
            action.setToolTip(tip)
            action.triggered.connect(lambda _checked=False, text=text: self.filter.setText(text))
            menu.addAction(action)
        button.setMenu(menu)
        return button

    def name_of(self, obj: int) -> str:
        """What the row of an object says; empty if it is filtered out."""
        return str(self.model.index_of(obj).data() or "")

    def is_chosen(self, obj: int) -> bool:
        """Whether the row of an object is selected."""
        selection = self.tree.selectionModel()
        return selection is not None and selection.isSelected(self.model.index_of(obj))

    def toggle(self, obj: int) -> None:
        """Does what a click on an object's eye does."""
        self._toggle(self.model.index_of(obj, Column.EYE))

    # Following the document

    def _rebuild(self) -> None:
        self._following = True
        self._expanded.clear()
        self.model.rebuild()
        self.tree.expandToDepth(0 if len(self.model.tree) > _FEW_ROWS else 2)
        self._following = False
        self._show_selection()

    def _refresh(self) -> None:
        self._following = True
        if self.model.refresh():
            self._expand()
        self._following = False
        self._show_selection()

    def _show_selection(self) -> None:
        """Selects rows, unless they say the same already: a selected group stands for what is in it."""
        document, selection = self._document, self.tree.selectionModel()
        assert selection is not None
        if self.model.objects_in(selection.selection()) != list(document.selection):
            self._following = True
            rows = self.model.selection_of(document.selection)
            selection.select(rows, QItemSelectionModel.SelectionFlag.ClearAndSelect)
            index = self.model.index_of(document.selected)
            if index.isValid():
                selection.setCurrentIndex(index, QItemSelectionModel.SelectionFlag.NoUpdate)
                self.tree.scrollTo(index)
            self._following = False
        self._say_counts()

    def _say_counts(self) -> None:
        document, world = self._document, self._document.world
        if world is None:
            self._count.setText("Nothing is open.")
            return
        text = f"{world.object_count:,} objects, {world.face_count:,} triangles"
        if self.filter.text().strip():
            text = f"{self.model.shown_count:,} of {world.object_count:,} objects"
        if len(document.selection) > 1:
            text += f", {len(document.selection):,} selected"
        if document.current is not None and not document.current.is_fresh:
            text += f"\nSince the bake: {document.current.summary()}"
        self._count.setText(text)

    # Following the user

    def _listen_to_selection(self) -> None:
        selection = self.tree.selectionModel()
        assert selection is not None
        selection.selectionChanged.connect(lambda _new, _old: self._on_select())

    def _on_select(self) -> None:
        selection = self.tree.selectionModel()
        if self._following or selection is None:
            return
        current = self.model.node(selection.currentIndex())
        last = self.model.tree.objects[current] if current >= 0 else -1
        self._document.select_all(self.model.objects_in(selection.selection()), last)

    def _on_filter(self, text: str) -> None:
        self._following = True
        self.model.set_filter(text)
        self._expand()
        self._following = False
        self._show_selection()

    def _on_sort(self, column: int, order: Qt.SortOrder) -> None:
        self._following = True
        self.model.sort(column, order)
        self._expand()
        self._following = False
        self._show_selection()

    def _expand(self) -> None:
        """Opens what answers the filter, or without one what the user had opened."""
        if not self.filter.text().strip():
            for node in tuple(self._expanded):
                self.tree.expand(self.model.index_of_node(node))
        elif self.model.shown_count <= _MOST_EXPANDED:
            self.tree.expandAll()
        else:
            self.tree.expandToDepth(0)

    def _on_expanded(self, index: QModelIndex, open_now: bool) -> None:
        """What the filter opens closes with it."""
        if not self.filter.text().strip():
            (self._expanded.add if open_now else self._expanded.discard)(self.model.node(index))

    def _on_click(self, index: QModelIndex) -> None:
        if index.column() == Column.EYE:
            self._toggle(index)

    def _toggle(self, index: QModelIndex) -> None:
        """Shows or hides a row with all below it; one of several selected rows: all of them."""
        if not index.isValid():
            return
        objects = self.model.tree.objects_below(self.model.node(index))
        chosen = self._document.selection
        if set(objects) <= set(chosen):
            objects = list(chosen)
        visible = self._document.visible.copy()
        visible[objects] = not visible[objects].any()
        self._document.set_visible(visible)

    def _on_double_click(self, index: QModelIndex) -> None:
        node = self.model.node(index)
        if node < 0 or index.column() == Column.EYE:
            return
        if self.model.tree.objects[node] >= 0 or self.model.tree.has_children(node):
            self.object_activated.emit(self.model.tree.objects[node])

    def _on_menu(self, position: QPoint) -> None:
        viewport = self.tree.viewport()
        if viewport is not None and self._document.selection:
            self.menu_requested.emit(viewport.mapToGlobal(position))
