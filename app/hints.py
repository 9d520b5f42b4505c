"""A card of hints for new users, over the view; once dismissed it does not come back by itself."""

from __future__ import annotations

from collections.abc import Sequence

from PyQt6.QtCore import QEvent, QObject, Qt, pyqtSignal
from PyQt6.QtGui import QResizeEvent
from PyQt6.QtWidgets import QFrame, QGridLayout, QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

_MARGIN = 14


class HintCard(QFrame):
    """Says how to begin; sits in a corner of its parent and moves with it."""

    dismissed = pyqtSignal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setObjectName("hintCard")
        self.setStyleSheet(
            "#hintCard { background: rgba(36, 39, 43, 235); border: 1px solid #5d6268; border-radius: 6px; }"
            "#hintCard QLabel { color: #e8e9ea; }"
        )
        title = QLabel("<b>First steps</b>")
        self._rows = QGridLayout()
        self._rows.setHorizontalSpacing(14)
        self._rows.setVerticalSpacing(3)
        close = QPushButton("Got it")
        close.setToolTip("Do not show this again; Help → First steps brings it back")
        close.clicked.connect(self.dismissed)
        bottom = QHBoxLayout()
        bottom.addStretch(1)
        bottom.addWidget(close)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(12, 10, 12, 10)
        layout.setSizeConstraint(QVBoxLayout.SizeConstraint.SetFixedSize)
        layout.addWidget(title)
        layout.addLayout(self._rows)
        layout.addLayout(bottom)
        parent.installEventFilter(self)
        self.hide()

    def set_hints(self, rows: Sequence[tuple[str, str]]) -> None:
        """Says these things: what to do, and what comes of it."""
        while self._rows.count():
            item = self._rows.takeAt(0)
            widget = item.widget() if item is not None else None
            if widget is not None:
                widget.deleteLater()
        for number, (what, outcome) in enumerate(rows):
            for column, text in enumerate((f"<b>{what}</b>", outcome)):
                self._rows.addWidget(QLabel(text), number, column, Qt.AlignmentFlag.AlignLeft)
        self._place()

    def resizeEvent(self, event: QResizeEvent | None) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Stays in its corner."""
        super().resizeEvent(event)
        self._place()

    def eventFilter(self, watched: QObject | None, event: QEvent | None) -> bool:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Stays in its corner."""
        if event is not None and event.type() is QEvent.Type.Resize:
            self._place()
        return super().eventFilter(watched, event)

    def _place(self) -> None:
        parent = self.parentWidget()
        if parent is not None:
            self.move(max(parent.width() - self.width() - _MARGIN, 0), _MARGIN)
