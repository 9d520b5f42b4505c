"""The causes of a dark spot as cards: how sure, what was measured, and what would mend it."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import TYPE_CHECKING

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from bake.explain.cause_types import Cause, Remedy
from viewer.fields import distance_label

if TYPE_CHECKING:
    from bake.explain.preview import Preview

_SHOWN = 3


class CauseCards(QWidget):
    """The likeliest causes, one card each."""

    preview_asked = pyqtSignal(object)  # Remedy
    apply_asked = pyqtSignal(object)  # Remedy

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._layout = QVBoxLayout(self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._cards: list[_Card] = []

    def set_causes(self, causes: Sequence[Cause]) -> None:
        """Replaces the cards."""
        for card in self._cards:
            self._layout.removeWidget(card)
            card.deleteLater()
        self._cards = [_Card(cause, self) for cause in causes[:_SHOWN]]
        for card in self._cards:
            self._layout.addWidget(card)

    def set_preview(self, preview: Preview) -> None:
        """Shows beside its remedy what it would do."""
        for card in self._cards:
            card.set_preview(preview)

    def set_busy(self, busy: bool) -> None:
        """Whether a preview is on its way."""
        for card in self._cards:
            card.set_busy(busy)


class _Card(QFrame):
    def __init__(self, cause: Cause, cards: CauseCards) -> None:
        super().__init__(cards)
        self.setFrameShape(QFrame.Shape.StyledPanel)
        self.setToolTip(cause.kind.meaning)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 6, 8, 6)
        layout.setSpacing(3)
        layout.addWidget(_label(f"<b>{html.escape(cause.kind.heading)}</b>  ·  {100.0 * cause.confidence:.0f} % sure"))
        layout.addWidget(_label(html.escape(cause.evidence)))
        self._rows = [_RemedyRow(remedy, cards) for remedy in cause.remedies]
        for row in self._rows:
            layout.addWidget(row)

    def set_preview(self, preview: Preview) -> None:
        for row in self._rows:
            row.set_preview(preview)

    def set_busy(self, busy: bool) -> None:
        for row in self._rows:
            row.set_busy(busy)


class _RemedyRow(QWidget):
    def __init__(self, remedy: Remedy, cards: CauseCards) -> None:
        super().__init__()
        self._remedy = remedy
        text = _label("→ " + html.escape(remedy.text))
        self._preview = QPushButton("Preview")
        self._preview.setToolTip("Bake the surface around the spot as it would be; nothing is written")
        self._preview.clicked.connect(lambda: cards.preview_asked.emit(remedy))
        self._apply = QPushButton("Apply")
        self._apply.setToolTip("Write it into the scene's side file; Undo takes it back. " + _written(remedy))
        self._apply.clicked.connect(lambda: cards.apply_asked.emit(remedy))
        self._outcome = _label("")
        self._outcome.hide()
        buttons = QHBoxLayout()
        buttons.addStretch(1)
        buttons.addWidget(self._preview)
        buttons.addWidget(self._apply)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(2)
        layout.addWidget(text)
        layout.addWidget(self._outcome)
        layout.addLayout(buttons)
        for button in (self._preview, self._apply):
            button.setVisible(remedy.writes)

    def set_preview(self, preview: Preview) -> None:
        if preview.remedy != self._remedy:
            return
        rows = [
            f"{distance_label(metres)}: {_number(before)} → <b>{_number(after)}</b>"
            for metres, before, after in zip(preview.distances, preview.before, preview.after, strict=True)
        ]
        self._outcome.setText(",  ".join(rows))
        self._outcome.show()

    def set_busy(self, busy: bool) -> None:
        self._preview.setEnabled(not busy)


def _number(value: float) -> str:
    return "—" if value != value else f"{value:.3f}"


def _written(remedy: Remedy) -> str:
    lines = [
        f"{path}: " + ", ".join(f"{key} = {value}" for key, value in keys.items())
        for path, keys in remedy.objects.items()
    ]
    lines += [f"{option} = {value}" for option, value in remedy.options.items()]
    return "It says\n" + "\n".join(lines) if lines else ""


def _label(text: str) -> QLabel:
    label = QLabel(text)
    label.setWordWrap(True)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return label
