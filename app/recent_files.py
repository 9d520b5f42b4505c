"""The files opened last, kept between sessions."""

from __future__ import annotations

from pathlib import Path

from PyQt6.QtCore import QSettings

_KEY = "recent/files"
MOST = 12


def recent_files(store: QSettings) -> list[Path]:
    """The latest first; those that are gone are left out."""
    stored = store.value(_KEY, [])
    names = [stored] if isinstance(stored, str) else list(stored or [])
    return [Path(name) for name in names if Path(name).exists()]


def add_recent_file(store: QSettings, path: Path) -> None:
    """Puts a file to the top of the list."""
    path = path.resolve()
    names = [str(path), *(str(known) for known in recent_files(store) if known != path)]
    store.setValue(_KEY, names[:MOST])


def clear_recent_files(store: QSettings) -> None:
    """Empties the list."""
    store.remove(_KEY)
