"""What an action is, and how keys and mouse are shown as a table."""

from __future__ import annotations

import html
from collections.abc import Callable, Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ActionSpec:
    """One thing the user can do.

    Attributes:
        id: Stable name.
        menu: Menu it stands in, or menu and submenu as in `View/Panels`; a line is drawn where `group` changes.
        text: What the menu says.
        tip: What it does, in a sentence.
        keys: Shortcuts, the first one shown in the menu.
        checkable: Whether it switches something on and off.
        group: Group within its menu.
        context: Context menus it stands in too: "object" for lists of objects, "view" for the picture.
        needs: What must be there for it, by name, see `app.parts.availability`; without it, it is greyed.
    """

    id: str
    menu: str
    text: str
    tip: str
    keys: tuple[str, ...] = ()
    checkable: bool = False
    group: int = 0
    context: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """The text without the mark of its mnemonic."""
        return self.text.replace("&&", "\0").replace("&", "").replace("\0", "&")


Action = tuple[ActionSpec, Callable[..., object]]
"""An action and what it calls; a checkable one passes its new state."""

MENUS = ("File", "Edit", "View", "Bake", "Help")
"""The first menus and the last one; others that actions name stand before the last."""


def keys_text(rows: Iterable[tuple[str, str]], mouse: Iterable[tuple[str, str]]) -> str:
    """Keys and mouse gestures as rich text, two tables.

    Args:
        rows: Keys and what they do.
        mouse: Gestures and what they do.
    """
    return f"<h3>Mouse</h3>{_table(mouse)}<h3>Keys</h3>{_table(rows)}"


def _table(rows: Iterable[tuple[str, str]]) -> str:
    lines = (f"<tr><td><b>{html.escape(a)}</b>&nbsp;&nbsp;</td><td>{html.escape(b)}</td></tr>" for a, b in rows)
    return f"<table>{''.join(lines)}</table>"
