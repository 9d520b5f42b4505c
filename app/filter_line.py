"""The line that a table is filtered by."""

from __future__ import annotations

from PyQt6.QtWidgets import QLineEdit


class FilterLine(QLineEdit):
    """Takes a text and can be cleared.

    Args:
        asks: What is filtered by, shown while it is empty.
        tip: What typing does.
        widest: In pixels; without it, as wide as there is room.
    """

    def __init__(
        self, asks: str, tip: str = "Show only rows that contain this text", widest: int | None = None
    ) -> None:
        super().__init__()
        self.setPlaceholderText(asks)
        self.setToolTip(tip)
        self.setClearButtonEnabled(True)
        if widest is not None:
            self.setMaximumWidth(widest)
