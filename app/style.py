"""Colours that follow the palette, and the choice between a bright and a dark window."""

from __future__ import annotations

from typing import TypeVar

from PyQt6.QtGui import QColor, QPalette
from PyQt6.QtWidgets import QApplication

_DARK = {
    "Window": "#313337", "WindowText": "#e4e5e6", "Base": "#212327", "AlternateBase": "#282b2f", "Text": "#e4e5e6",
    "Button": "#43464c", "ButtonText": "#e4e5e6", "BrightText": "#ffffff", "ToolTipBase": "#3a3d41",
    "ToolTipText": "#e4e5e6", "Highlight": "#3d7fb8", "HighlightedText": "#ffffff", "Link": "#6db3f2",
    "LinkVisited": "#b39ddb", "PlaceholderText": "#8b9096", "Light": "#4a4e53", "Midlight": "#3f4347",
    "Mid": "#55595e", "Dark": "#1a1b1d", "Shadow": "#101112", "Accent": "#3d7fb8",
}  # fmt: skip
_LIGHT = {
    "Window": "#eff0f1", "WindowText": "#202224", "Base": "#ffffff", "AlternateBase": "#f5f6f7", "Text": "#202224",
    "Button": "#e6e8ea", "ButtonText": "#202224", "BrightText": "#ffffff", "ToolTipBase": "#fffde8",
    "ToolTipText": "#202224", "Highlight": "#2f7fbf", "HighlightedText": "#ffffff", "Link": "#1b66a8",
    "LinkVisited": "#6a4f9c", "PlaceholderText": "#7b8087", "Light": "#ffffff", "Midlight": "#dfe1e4",
    "Mid": "#b4b8bd", "Dark": "#9a9ea4", "Shadow": "#6d7177", "Accent": "#2f7fbf",
}  # fmt: skip
_App = TypeVar("_App", bound=QApplication)
_DISABLED = ("WindowText", "Text", "ButtonText", "HighlightedText")


def apply_scheme(name: str) -> None:
    """Gives the application a bright ("light"), a dark ("dark") or the system's own ("") palette.

    The palettes are ours because Qt can switch its own on some platforms only.
    """
    app = QApplication.instance()
    if not isinstance(app, QApplication):
        return
    style = app.style()
    if name in ("light", "dark"):
        app.setPalette(_palette(_DARK if name == "dark" else _LIGHT))
    elif style is not None:
        app.setPalette(style.standardPalette())


def _palette(colors: dict[str, str]) -> QPalette:
    palette = QPalette()
    for role, color in colors.items():
        palette.setColor(QPalette.ColorRole[role], QColor(color))
    faint = QColor(colors["PlaceholderText"])
    for role in _DISABLED:
        palette.setColor(QPalette.ColorGroup.Disabled, QPalette.ColorRole[role], faint)
    palette.setColor(QPalette.ColorGroup.Disabled, QPalette.ColorRole.Highlight, QColor(colors["Mid"]))
    return palette


def is_dark(palette: QPalette) -> bool:
    """Whether a palette has light text on dark."""
    window = palette.color(QPalette.ColorRole.Window).lightness()
    return palette.color(QPalette.ColorRole.WindowText).lightness() > window


def style_sheet(palette: QPalette) -> str:
    """Rules for the few widgets that are not plain Qt."""
    error, hint = ("#ff8f8f", "#e0b35a") if is_dark(palette) else ("#b3261e", "#8a5a00")
    return (
        f"QLabel#fieldError {{ color: {error}; }}"
        f"QLabel#hint {{ color: {hint}; }}"
        "QGroupBox { font-weight: bold; margin-top: 7px; padding-top: 9px; }"
        "QGroupBox::title { subcontrol-origin: margin; left: 6px; padding: 0 2px; }"
        "QDockWidget::title { padding: 4px; }"
        "QToolTip { padding: 3px; }"
    )


def application() -> QApplication:
    """The running application, or a new one in the style that looks the same everywhere."""
    existing = QApplication.instance()
    if isinstance(existing, QApplication):
        return existing
    return styled(QApplication(["obscura"]))


def styled(app: _App) -> _App:
    """Gives an application the program's name and style."""
    app.setApplicationName("obscura")
    app.setApplicationDisplayName("Obscura")
    app.setOrganizationName("obscura")
    app.setStyle("Fusion")
    return app
