"""The log of window and engine, with levels."""

from __future__ import annotations

import html
import logging
import time

from PyQt6.QtCore import QObject, pyqtSignal
from PyQt6.QtWidgets import (
    QApplication,
    QComboBox,
    QHBoxLayout,
    QLabel,
    QPlainTextEdit,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from app.filter_line import FilterLine

_MOST_LINES = 5000
_LEVELS = (
    ("Everything", logging.DEBUG),
    ("Information", logging.INFO),
    ("Warnings", logging.WARNING),
    ("Errors", logging.ERROR),
)
_PACKAGES = ("app", "bake", "viewer")
_COLORS = {logging.WARNING: "#c77700", logging.ERROR: "#d8404a", logging.CRITICAL: "#d8404a"}


class LogPanel(QWidget):
    """Keeps the last lines; the chosen level filters what is shown, not what is kept."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._lines: list[tuple[int, str]] = []
        self._text = QPlainTextEdit()
        self._text.setReadOnly(True)
        self._text.setPlaceholderText("What window and engine have to say appears here.")
        self._text.setMaximumBlockCount(_MOST_LINES)
        self._text.setLineWrapMode(QPlainTextEdit.LineWrapMode.WidgetWidth)
        self._level = QComboBox()
        for title, level in _LEVELS:
            self._level.addItem(title, level)
        self._level.setCurrentIndex(1)
        self._level.setToolTip("Least serious lines to show")
        self._level.currentIndexChanged.connect(self._refill)
        self.filter = FilterLine("Filter", "Show only lines that contain this text")
        self.filter.textChanged.connect(self._refill)
        copy = QPushButton("Copy")
        copy.setToolTip("Copy the lines shown")
        copy.clicked.connect(self._copy)
        clear = QPushButton("Clear")
        clear.setToolTip("Forget all lines")
        clear.clicked.connect(self.clear)
        top = QHBoxLayout()
        top.addWidget(QLabel("Show"))
        top.addWidget(self._level)
        top.addWidget(self.filter, 1)
        top.addWidget(copy)
        top.addWidget(clear)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.addLayout(top)
        layout.addWidget(self._text, 1)

    def add(self, level: int, source: str, text: str) -> None:
        """Appends a line."""
        line = f"{time.strftime('%H:%M:%S')}  {logging.getLevelName(level).lower():<8}  {source}: {text}"
        self._lines.append((level, line))
        del self._lines[:-_MOST_LINES]
        if self._is_shown(level, line):
            self._append(level, line)

    def clear(self) -> None:
        """Forgets all lines."""
        self._lines.clear()
        self._text.clear()

    def text(self) -> str:
        """The lines shown."""
        return self._text.toPlainText()

    def _append(self, level: int, line: str) -> None:
        escaped = html.escape(line).replace("\n", "<br/>")
        color = _COLORS.get(level)
        style = "white-space: pre-wrap;" + (f" color: {color};" if color else "")
        self._text.appendHtml(f'<span style="{style}">{escaped}</span>')

    def _refill(self) -> None:
        self._text.clear()
        for level, line in self._lines:
            if self._is_shown(level, line):
                self._append(level, line)

    def _is_shown(self, level: int, line: str) -> bool:
        return level >= self._level.currentData() and self.filter.text().lower() in line.lower()

    def _copy(self) -> None:
        clipboard = QApplication.clipboard()
        if clipboard is not None:
            clipboard.setText(self.text())


class LogBridge(QObject):
    """Brings this process's log records, from any thread, to the thread of the panel."""

    line = pyqtSignal(int, str, str)  # level, logger, text

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._handler = _SignalHandler(self)
        self._levels: dict[str, int] = {}

    def attach(self) -> None:
        """Starts listening to the program's loggers; what else listens hears no more than before."""
        self._levels = {name: logging.getLogger(name).level for name in _PACKAGES}
        for name in _PACKAGES:
            package = logging.getLogger(name)
            package.addHandler(self._handler)
            if package.getEffectiveLevel() > logging.INFO:
                for handler in logging.getLogger().handlers:
                    handler.setLevel(max(handler.level, package.getEffectiveLevel()))
                package.setLevel(logging.INFO)

    def detach(self) -> None:
        """Stops listening."""
        for name, level in self._levels.items():
            logging.getLogger(name).removeHandler(self._handler)
            logging.getLogger(name).setLevel(level)
        self._levels = {}


class _SignalHandler(logging.Handler):
    def __init__(self, bridge: LogBridge) -> None:
        super().__init__(logging.INFO)
        self._bridge = bridge

    def emit(self, record: logging.LogRecord) -> None:
        """Hands one record over."""
        try:
            self._bridge.line.emit(record.levelno, record.name.rsplit(".", 1)[-1], self.format(record))
        except RuntimeError:
            return  # the window is gone
