"""Buttons of panels that stand for actions of the menus, under shorter words."""

from __future__ import annotations

from collections.abc import Sequence

from PyQt6.QtCore import Qt
from PyQt6.QtGui import QAction
from PyQt6.QtWidgets import QGridLayout, QSizePolicy, QToolButton


def action_button(action: QAction, word: str) -> QToolButton:
    """A button that does, shows and greys what an action does, under a word of its own."""
    action.setIconText(word)  # what buttons show
    button = QToolButton()
    button.setDefaultAction(action)
    button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
    button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
    return button


def fill_grid(
    actions: Sequence[QAction], words: Sequence[str], *, grid: QGridLayout | None = None, columns: int = 2
) -> QGridLayout:
    """Buttons in rows of equal columns."""
    grid = QGridLayout() if grid is None else grid
    grid.setSpacing(4)
    for number, (action, word) in enumerate(zip(actions, words, strict=True)):
        grid.addWidget(action_button(action, word), number // columns, number % columns)
    for column in range(columns):
        grid.setColumnStretch(column, 1)
    return grid
