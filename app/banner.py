"""A line above the view for what the user must know, without stopping them."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping

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
        self._choices: list[QPushButton] = []
        self._text = QLabel()
        self._text.setWordWrap(True)
        self._text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._text.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self._log = QPushButton("Log")
        self._log.setToolTip("Show the log")
        self._log.clicked.connect(self.log_requested)
        close = QToolButton()
        close.setText("✕")
        close.setToolTip("Close this message")
        close.clicked.connect(self.hide)
        layout = self._row = QHBoxLayout(self)
        layout.setContentsMargins(10, 4, 6, 4)
        layout.addWidget(self._text, 1)
        layout.addWidget(self._log)
        layout.addWidget(close)
        self.level = logging.NOTSET
        self._fade = QTimer(self)
        self._fade.setSingleShot(True)
        self._fade.timeout.connect(self.hide)
        self.hide()

    def text(self) -> str:
        """The message shown."""
        return self._text.text()

    def ask(self, text: str, choices: Mapping[str, Callable[[], object]]) -> None:
        """Asks something that can wait; it stays until it is answered, closed, or replaced by another message.

        Args:
            text: The question.
            choices: What to call, by the text of a button.
        """
        self.show_message(logging.INFO, text, choices)
        self._fade.stop()
        self._log.hide()

    def show_message(self, level: int, text: str, choices: Mapping[str, Callable[[], object]] | None = None) -> None:
        """Shows a message of a logging level.

        Args:
            level: How serious it is.
            text: The message.
            choices: What to call, by the text of a button, after which the message goes.
        """
        for button in self._choices:
            button.deleteLater()
        self._choices.clear()
        self._log.show()
        for number, (title, slot) in enumerate((choices or {}).items()):
            button = QPushButton(title)
            button.setToolTip(f"{title}, and close this message")
            button.clicked.connect(self.hide)
            button.clicked.connect(lambda _checked=False, slot=slot: slot())
            self._row.insertWidget(1 + number, button)
            self._choices.append(button)
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
