"""The command palette: every action of the window by a few letters of its name."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

from PyQt6.QtCore import QEvent, QModelIndex, QObject, QPoint, QRect, QSettings, QSize, Qt
from PyQt6.QtGui import QKeyEvent, QPainter, QPalette, QStandardItem, QStandardItemModel
from PyQt6.QtWidgets import (
    QFrame,
    QLabel,
    QLineEdit,
    QListView,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QVBoxLayout,
    QWidget,
)

from app.action_registry import ActionRegistry
from app.actions import ActionSpec
from app.fuzzy import fuzzy_score

_RECENT = "palette/recent"
MOST_RECENT = 8
_NAME, _KEYS, _NOTE = (Qt.ItemDataRole.UserRole + number for number in range(3))
_WIDTH, _ROWS = 560, 12


class CommandPalette(QFrame):
    """A field and a list over the window; Enter does what is chosen, Escape leaves.

    Actions used last come first; those that cannot be used now are grey and say why.

    Args:
        registry: The actions.
        store: Remembers what was used.
        parent: The window.
    """

    def __init__(self, registry: ActionRegistry, store: QSettings, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self._registry, self._store = registry, store
        self.setFrameShape(QFrame.Shape.StyledPanel)
        self.field = QLineEdit()
        self.field.setPlaceholderText("Type what you want to do")
        self.field.setToolTip("A few letters of an action's name are enough, such as “sp” for Save picture")
        self.field.setClearButtonEnabled(True)
        self.field.textChanged.connect(self._refill)
        self.field.installEventFilter(self)
        self._model = QStandardItemModel(self)
        self.list = QListView()
        self.list.setModel(self._model)
        self.list.setItemDelegate(_Delegate(self.list))
        self.list.setUniformItemSizes(True)
        self.list.setEditTriggers(QListView.EditTrigger.NoEditTriggers)
        self.list.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.clicked.connect(self._run)
        self._tip = QLabel()
        self._tip.setWordWrap(True)
        self._tip.setContentsMargins(4, 2, 4, 2)
        selection = self.list.selectionModel()
        assert selection is not None
        selection.currentChanged.connect(self._show_tip)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(6, 6, 6, 6)
        layout.addWidget(self.field)
        layout.addWidget(self.list, 1)
        layout.addWidget(self._tip)

    def open(self) -> None:
        """Shows the palette below the top of the window, empty."""
        parent = self.parentWidget()
        assert parent is not None
        self.field.clear()
        self._refill()
        row = self.list.sizeHintForRow(0)
        width = min(_WIDTH, parent.width() - 40)
        height = min(row * _ROWS + 90, parent.height() - 60)
        self.resize(width, height)
        self.move(parent.mapToGlobal(QPoint((parent.width() - width) // 2, 40)))
        self.show()
        self.field.setFocus()

    def names(self) -> list[str]:
        """The actions listed, best first."""
        items = (self._model.item(row) for row in range(self._model.rowCount()))
        return [str(item.data(_NAME)) for item in items if item is not None]

    def run_current(self) -> None:
        """Does what is chosen."""
        self._run(self.list.currentIndex())

    def eventFilter(self, watched: QObject | None, event: QEvent | None) -> bool:
        """Arrow keys and Enter of the field are the list's."""
        if isinstance(event, QKeyEvent) and event.type() is QEvent.Type.KeyPress:
            steps = {
                Qt.Key.Key_Down: 1,
                Qt.Key.Key_Up: -1,
                Qt.Key.Key_PageDown: _ROWS - 2,
                Qt.Key.Key_PageUp: 2 - _ROWS,
            }
            if event.key() in steps:
                self._step(steps[Qt.Key(event.key())])
                return True
            if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
                self.run_current()
                return True
        return super().eventFilter(watched, event)

    def _step(self, rows: int) -> None:
        last = self._model.rowCount() - 1
        if last >= 0:
            row = min(max(self.list.currentIndex().row() + rows, 0), last)
            self.list.setCurrentIndex(self._model.index(row, 0))

    def _refill(self) -> None:
        query = self.field.text()
        self._model.clear()
        for spec in self._ranked(query):
            item = QStandardItem(spec.title.rstrip(" …") if not spec.checkable else spec.title)
            action, why = self._registry[spec.id], self._registry.why_disabled(spec.id)
            if spec.checkable:
                item.setText(f"{spec.title}: turn {'off' if action.isChecked() else 'on'}")
            keys = self._registry.keys(spec.id)
            item.setData(spec.id, _NAME)
            item.setData(keys[0].toString() if keys else "", _KEYS)
            item.setData(spec.menu if action.isEnabled() else (why or "cannot be used now"), _NOTE)
            item.setEnabled(action.isEnabled())
            item.setToolTip(spec.tip)
            item.setEditable(False)
            self._model.appendRow(item)
        if self._model.rowCount():
            self.list.setCurrentIndex(self._model.index(0, 0))
        else:
            self._tip.setText(f"Nothing is called “{query}”.")

    def _ranked(self, query: str) -> list[ActionSpec]:
        recent = recent_actions(self._store)
        ranked: list[tuple[float, ActionSpec]] = []
        for place, spec in enumerate(self._registry.specs):
            if spec.id == "palette":
                continue
            usable = self._registry[spec.id].isEnabled()
            lately = MOST_RECENT - recent.index(spec.id) if spec.id in recent else 0
            if not query.strip():
                ranked.append((1000.0 * lately + (500.0 if usable else 0.0) - place, spec))
                continue
            by_name = fuzzy_score(query, spec.title)
            by_menu = fuzzy_score(query, f"{spec.menu} {spec.title}")
            by_tip = 0.5 if query.strip().lower() in spec.tip.lower() else None
            scores = [
                score for score in (by_name, None if by_menu is None else by_menu - 6.0, by_tip) if score is not None
            ]
            if scores:
                ranked.append((max(scores) + 0.4 * lately - (0.0 if usable else 5.0), spec))
        return [spec for _, spec in sorted(ranked, key=lambda entry: -entry[0])]

    def _show_tip(self, index: QModelIndex) -> None:
        self._tip.setText(str(index.data(Qt.ItemDataRole.ToolTipRole) or ""))

    def _run(self, index: QModelIndex) -> None:
        name = index.data(_NAME)
        if not isinstance(name, str) or not self._registry[name].isEnabled():
            return
        self.hide()
        remember_action(self._store, name)
        self._registry[name].trigger()


def recent_actions(store: QSettings) -> list[str]:
    """What was done from the palette last, the latest first."""
    stored = store.value(_RECENT, [])
    return [stored] if isinstance(stored, str) else list(stored or [])


def remember_action(store: QSettings, name: str) -> None:
    """Puts an action to the top of those used last."""
    store.setValue(_RECENT, [name, *(known for known in recent_actions(store) if known != name)][:MOST_RECENT])


class _Delegate(QStyledItemDelegate):
    """Name and where it stands on the left, shortcut on the right."""

    def sizeHint(self, option: QStyleOptionViewItem, index: QModelIndex) -> QSize:
        """One line with some air."""
        return QSize(100, option.fontMetrics.height() + 10)

    def paint(self, painter: QPainter | None, option: QStyleOptionViewItem, index: QModelIndex) -> None:
        """Paints one row."""
        if painter is None:
            return
        chosen = bool(option.state & QStyle.StateFlag.State_Selected)
        usable = bool(option.state & QStyle.StateFlag.State_Enabled)
        palette, group = option.palette, QPalette.ColorGroup.Active
        painter.save()
        if chosen:
            painter.fillRect(option.rect, palette.color(group, QPalette.ColorRole.Highlight))
        strong = palette.color(group, QPalette.ColorRole.HighlightedText if chosen else QPalette.ColorRole.Text)
        faint = strong if chosen else palette.color(group, QPalette.ColorRole.PlaceholderText)
        rect = QRect(option.rect).adjusted(8, 0, -8, 0)
        metrics, middle = option.fontMetrics, Qt.AlignmentFlag.AlignVCenter
        keys = str(index.data(_KEYS))
        painter.setPen(faint)
        painter.drawText(rect, middle | Qt.AlignmentFlag.AlignRight, keys)
        rect.setRight(rect.right() - (metrics.horizontalAdvance(keys) + 12 if keys else 0))
        name, note = str(index.data(Qt.ItemDataRole.DisplayRole)), str(index.data(_NOTE))
        painter.setPen(strong if usable else faint)
        painter.drawText(rect, middle, metrics.elidedText(name, Qt.TextElideMode.ElideRight, rect.width()))
        rect.setLeft(rect.left() + metrics.horizontalAdvance(name) + 12)
        painter.setPen(faint)
        if rect.width() > 30:
            painter.drawText(rect, middle, metrics.elidedText(note, Qt.TextElideMode.ElideRight, rect.width()))
        painter.restore()
