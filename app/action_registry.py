"""The one list of a window's actions, from which menus, shortcuts, palette and the table of keys are made."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PyQt6.QtCore import QObject, QSettings, pyqtSignal
from PyQt6.QtGui import QAction, QKeySequence
from PyQt6.QtWidgets import QMainWindow, QMenu, QWidget

from app.actions import MENUS, ActionSpec

_KEYS = "shortcuts"


class ActionRegistry(QObject):
    """Holds every action of a window; whoever adds one never touches a menu.

    Args:
        window: Owns the actions and has the menu bar.
        store: Keeps the user's own shortcuts.
    """

    changed = pyqtSignal()  # an action was added, enabled or disabled, or has other keys

    def __init__(self, window: QMainWindow, store: QSettings) -> None:
        super().__init__(window)
        self._window, self._store = window, store
        self._specs: dict[str, ActionSpec] = {}
        self._actions: dict[str, QAction] = {}
        self._why: dict[str, str] = {}

    def add(self, spec: ActionSpec, slot: Callable[..., object]) -> QAction:
        """Makes an action.

        Args:
            spec: What it is.
            slot: What it calls; a checkable action passes its new state.

        Raises:
            ValueError: there is one of that name already.
        """
        action = QAction(spec.text, self._window)
        if spec.checkable:
            action.triggered.connect(slot)
        else:
            action.triggered.connect(lambda _checked=False, slot=slot: slot())
        return self.adopt(spec, action)

    def adopt(self, spec: ActionSpec, action: QAction) -> QAction:
        """Takes in an action that exists already, such as one that Qt made for a dock.

        Raises:
            ValueError: there is one of that name already.
        """
        if spec.id in self._specs:
            raise ValueError(f"two actions are called {spec.id}")
        action.setObjectName(spec.id)
        action.setCheckable(spec.checkable)
        action.setStatusTip(spec.tip)
        action.setToolTip(spec.tip)
        self._specs[spec.id], self._actions[spec.id] = spec, action
        action.setShortcuts(self.keys(spec.id))
        self._window.addAction(action)
        return action

    def remove(self, name: str) -> None:
        """Takes an action out of the window; the user's keys for it are remembered."""
        action = self._actions.pop(name)
        del self._specs[name]
        self._why.pop(name, None)
        self._window.removeAction(action)
        action.deleteLater()
        self.changed.emit()

    def __getitem__(self, name: str) -> QAction:
        return self._actions[name]

    def __contains__(self, name: str) -> bool:
        return name in self._actions

    @property
    def actions(self) -> dict[str, QAction]:
        """All actions by id."""
        return dict(self._actions)

    @property
    def specs(self) -> tuple[ActionSpec, ...]:
        """All actions, in the order of the menus."""
        order = menu_order([_top(spec.menu) for spec in self._specs.values()])
        return tuple(sorted(self._specs.values(), key=lambda spec: (order.index(_top(spec.menu)), spec.group)))

    def enable(self, name: str, on: bool, why: str = "") -> None:
        """Lets an action be used, or not.

        Args:
            name: The action.
            on: Whether it can be used.
            why: What the palette says while it can not.
        """
        action = self._actions[name]
        reason = "" if on else why
        if action.isEnabled() != on or self._why.get(name, "") != reason:
            self._why[name] = reason
            action.setEnabled(on)
            self.changed.emit()

    def why_disabled(self, name: str) -> str:
        """Why an action can not be used now; empty if it can, or if nobody said."""
        return self._why.get(name, "")

    def fill_menus(self) -> dict[str, QMenu]:
        """Puts all actions into the menus of the window; returns the menus by name."""
        menus: dict[str, QMenu] = {}
        groups: dict[str, int] = {}
        for spec in self.specs:
            top = _top(spec.menu)
            if top not in menus:
                menus[top] = self._new_menu(top)
            if groups.setdefault(top, spec.group) != spec.group:
                menus[top].addSeparator()
                groups[top] = spec.group
            if spec.menu not in menus:
                menus[spec.menu] = QMenu(spec.menu.rpartition("/")[2], menus[top])
                menus[top].addMenu(menus[spec.menu])
            menus[spec.menu].addAction(self._actions[spec.id])
        return menus

    def _new_menu(self, name: str) -> QMenu:
        bar = self._window.menuBar()
        assert bar is not None
        menu = bar.addMenu(f"&{name}")
        assert menu is not None
        menu.setToolTipsVisible(True)
        return menu

    def context_menu(self, place: str, parent: QWidget) -> QMenu:
        """A menu of the actions that stand in a context."""
        menu = QMenu(parent)
        menu.setToolTipsVisible(True)
        inner: dict[str, QMenu] = {}
        group: tuple[str, int] | None = None
        for spec in self.specs:
            if place not in spec.context:
                continue
            if group is not None and group != (_top(spec.menu), spec.group):
                menu.addSeparator()
            group = (_top(spec.menu), spec.group)
            target = menu
            if "/" in spec.menu:
                if spec.menu not in inner:
                    inner[spec.menu] = QMenu(spec.menu.rpartition("/")[2], menu)
                    inner[spec.menu].setToolTipsVisible(True)
                    menu.addMenu(inner[spec.menu])
                target = inner[spec.menu]
            target.addAction(self._actions[spec.id])
        return menu

    # Keys

    def keys(self, name: str) -> list[QKeySequence]:
        """The shortcuts of an action: the user's own, or those it comes with."""
        stored = self._store.value(f"{_KEYS}/{name}")
        if stored is None:
            return [QKeySequence(key) for key in self._specs[name].keys]
        words = [stored] if isinstance(stored, str) else list(stored)
        return [QKeySequence(word) for word in words if word]

    def set_keys(self, name: str, keys: Sequence[QKeySequence]) -> None:
        """Gives an action other shortcuts and remembers them; another action that has one of them loses it."""
        wanted = [key for key in keys if not key.isEmpty()]
        for other in self._specs:
            held = self.keys(other)
            left = [key for key in held if key not in wanted]
            if other != name and len(left) != len(held):
                self._store_keys(other, left)
        self._store_keys(name, wanted)
        self.changed.emit()

    def owner_of(self, key: QKeySequence) -> str:
        """The action that a shortcut calls; empty if none."""
        return next((name for name in self._specs if key in self.keys(name)), "")

    def reset_keys(self) -> None:
        """Gives every action the shortcuts it comes with."""
        self._store.remove(_KEYS)
        for name, action in self._actions.items():
            action.setShortcuts(self.keys(name))
        self.changed.emit()

    def key_rows(self) -> list[tuple[str, str]]:
        """The keys in use and what they do."""
        rows = ((self.keys(spec.id), spec.tip) for spec in self.specs)
        return [(", ".join(key.toString() for key in keys), tip) for keys, tip in rows if keys]

    def _store_keys(self, name: str, keys: list[QKeySequence]) -> None:
        words = [key.toString() for key in keys]
        if words == [QKeySequence(key).toString() for key in self._specs[name].keys]:
            self._store.remove(f"{_KEYS}/{name}")
        else:
            self._store.setValue(f"{_KEYS}/{name}", words or [""])
        self._actions[name].setShortcuts(keys)


def menu_order(named: Sequence[str]) -> list[str]:
    """Menus from left to right: the known ones, and before the last of them those that only actions name."""
    extra = [menu for menu in dict.fromkeys(named) if menu not in MENUS]
    return [*MENUS[:-1], *extra, MENUS[-1]]


def _top(menu: str) -> str:
    return menu.partition("/")[0]
