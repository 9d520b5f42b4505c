"""How far the running job is: stage, share, rays a second, time left, memory, and the button that stops it."""

from __future__ import annotations

import time

from PyQt6.QtCore import QTimer, pyqtSignal
from PyQt6.QtWidgets import QHBoxLayout, QLabel, QProgressBar, QPushButton, QSizePolicy, QWidget

from bake.types import Progress


class ProgressPanel(QWidget):
    """Visible while something runs."""

    cancel_requested = pyqtSignal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._stage = QLabel()
        self._stage.setMinimumWidth(150)
        self._bar = QProgressBar()
        self._bar.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._bar.setToolTip("Share of this stage that is done")
        self._detail = QLabel()
        self._detail.setToolTip("Rays a second · time left in this stage · memory of the engine · time since the start")
        self._cancel = QPushButton("Cancel")
        self._cancel.setToolTip("Stop the bake; the stored result stays as it was (Esc)")
        self._cancel.clicked.connect(self.cancel_requested)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(8, 3, 8, 3)
        layout.addWidget(self._stage)
        layout.addWidget(self._bar, 1)
        layout.addWidget(self._detail)
        layout.addWidget(self._cancel)
        self._began = self._stage_began = 0.0
        self._stage_name = ""
        self._numbers = ""
        self._clock = QTimer(self)
        self._clock.setInterval(500)
        self._clock.timeout.connect(self._show_detail)
        self.hide()

    def begin(self, what: str) -> None:
        """Shows that something started; the bar runs to and fro until the first share is known."""
        self._began = self._stage_began = time.monotonic()
        self._stage_name, self._numbers = "", ""
        self._stage.setText(what)
        self._bar.setRange(0, 0)
        self._cancel.setEnabled(True)
        self._cancel.setText("Cancel")
        self._show_detail()
        self._clock.start()
        self.show()

    def set_progress(self, progress: Progress, memory_mb: float) -> None:
        """Shows where a bake stands."""
        now = time.monotonic()
        if progress.stage != self._stage_name:
            self._stage_name, self._stage_began = progress.stage, now
            self._stage.setText(progress.stage.capitalize())
        parts = []
        if progress.total > 0:
            share = min(progress.done / progress.total, 1.0)
            self._bar.setRange(0, 1000)
            self._bar.setValue(round(1000 * share))
            if progress.rays_per_s > 0:
                parts.append(f"{progress.rays_per_s / 1e6:.2f} Mrays/s")
            elapsed = progress.seconds or now - self._stage_began
            if share > 0.02:
                parts.append(f"{duration(elapsed * (1.0 - share) / share)} left")
        else:
            self._bar.setRange(0, 0)
        if memory_mb > 0:
            parts.append(f"{memory_mb:,.0f} MB")
        self._numbers = "  ·  ".join(parts)
        self._show_detail()

    def set_cancelling(self) -> None:
        """Answers the click on Cancel at once."""
        self._stage.setText("Cancelling …")
        self._cancel.setEnabled(False)

    def end(self) -> None:
        """Hides the panel."""
        self._clock.stop()
        self.hide()

    def _show_detail(self) -> None:
        since = duration(time.monotonic() - self._began)
        self._detail.setText(f"{self._numbers}  ·  {since}" if self._numbers else since)


def duration(seconds: float) -> str:
    """A time for people: `8 s`, `2 min 5 s`, `1 h 12 min`."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
