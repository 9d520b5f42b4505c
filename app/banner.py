"""A line above the view for what the user must know, without stopping them."""

from __future__ import annotations

import logging

from PyQt6.QtCore import Qt, QTimer, pyqtSignal
from PyQt6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QSizePolicy, QToolButton, QWidget

INFORMATION_MS = 8000

_COLORS = {
    logging.ERROR: ("#7d1f27", "#ffffff"),
    logging.WARNING: ("#7a4d00", "#ffffff"),
    logging.INFO: ("#1f4b6e", "#ffffff"),
}


class Banner(QFrame):
    """Shows one message until it is closed or replaced; what is no more than information leaves by itself."""

    log_requested = pyqtSignal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._text = QLabel()
        self._text.setWordWrap(True)
        self._text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._text.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        log = QPushButton("Log")
        log.setToolTip("Show the log")
        log.clicked.connect(self.log_requested)
        close = QToolButton()
        close.setText("✕")
        close.setToolTip("Close this message")
        close.clicked.connect(self.hide)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(10, 4, 6, 4)
        layout.addWidget(self._text, 1)
        layout.addWidget(log)
        layout.addWidget(close)
        self.level = logging.NOTSET
        self._fade = QTimer(self)
        self._fade.setSingleShot(True)
        self._fade.timeout.connect(self.hide)
        self.hide()

    def text(self) -> str:
        """The message shown."""
        return self._text.text()

    def show_message(self, level: int, text: str) -> None:
        """Shows a message of a logging level."""
        self.level = level
        paper, ink = _COLORS.get(level, _COLORS[logging.INFO])
        self.setStyleSheet(
            f"Banner {{ background: {paper}; }} Banner QLabel {{ color: {ink}; }}"
            f"Banner QToolButton {{ color: {ink}; border: none; padding: 4px; }}"
        )
        self._text.setText(text)
        self.show()
        if level <= logging.INFO:
            self._fade.start(INFORMATION_MS)
        else:
            self._fade.stop()
