"""What AO does in the running game: ambient light of a time of day, dimmed by AO, in the bits that the game has."""

from __future__ import annotations

from PyQt6.QtCore import Qt, QTimer, pyqtSignal
from PyQt6.QtGui import QColor, QImage, QPixmap
from PyQt6.QtWidgets import QCheckBox, QHBoxLayout, QLabel, QSizePolicy, QSlider, QToolButton, QVBoxLayout, QWidget

from app.curve_widget import CurveWidget
from viewer.display import Display
from viewer.runtime_light import ALBEDO, DAY, ambient_light, clock, displayed, name_of_hour
from viewer.tone import GAME_BITS

NOON = 12.0
_PER_HOUR = 12
_SKY_HEIGHT = 10
_DAY_SECONDS = 24.0
_TICK_MS = 100


class RuntimePanel(QWidget):
    """Edits the parts of a `Display` that the runtime preview needs."""

    changed = pyqtSignal(dict)  # fields of `Display` by name

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._filling = False
        self._play = QTimer(self)
        self._play.setInterval(_TICK_MS)
        self._play.timeout.connect(self._on_tick)
        self.on = QCheckBox("Preview in ambient light")
        self.on.setToolTip(f"Ambient light × AO × a neutral surface that gives back {ALBEDO:.0%} of it (U)")
        self.on.toggled.connect(self._on_toggled)
        self.hour = QSlider(Qt.Orientation.Horizontal)
        self.hour.setRange(0, int(DAY) * _PER_HOUR)
        self.hour.setPageStep(_PER_HOUR)
        self.hour.setValue(int(NOON * _PER_HOUR))
        self.hour.setToolTip("Time of day: the colour of the ambient light")
        self.hour.valueChanged.connect(self._on_hour)
        self.time = QLabel()
        self.time.setMinimumWidth(self.time.fontMetrics().horizontalAdvance("00:00 afternoon"))
        self.play = QToolButton()
        self.play.setText("Play")
        self.play.setCheckable(True)
        self.play.setToolTip(f"Let a day pass in {_DAY_SECONDS:.0f} s")
        self.play.toggled.connect(self._on_play)
        self._sky = QLabel()
        self._sky.setFixedHeight(_SKY_HEIGHT)
        self._sky.setScaledContents(True)
        self._sky.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self._sky.setPixmap(_day())
        self._sky.setToolTip("Colour of an open surface from midnight to midnight")
        self.game = QCheckBox(f"{GAME_BITS} bits, dithered")
        self.game.setToolTip(f"AO in {1 << GAME_BITS} levels a pixel with ordered dither, as the game stores it (G)")
        self.game.toggled.connect(lambda on: self._tell(game=on))
        self.curve = CurveWidget()
        self.curve.curve_changed.connect(lambda curve: self._tell(curve=curve))
        self._layout()
        self.fill(Display(), available=False)

    def _layout(self) -> None:
        first, second, marks = QHBoxLayout(), QHBoxLayout(), QHBoxLayout()
        first.addWidget(self.on)
        first.addStretch(1)
        first.addWidget(self.play)
        second.addWidget(self.time)
        second.addStretch(1)
        for text, stretch in (("night", 0), ("dawn", 1), ("noon", 1), ("dusk", 1), ("night", 0)):
            label = QLabel(text)
            label.setAlignment(Qt.AlignmentFlag.AlignCenter)
            label.setStyleSheet("color: palette(placeholder-text); font-size: 11px;")
            marks.addWidget(label, stretch)
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 6, 8, 6)
        column.setSpacing(4)
        column.addLayout(first)
        column.addLayout(second)
        column.addWidget(self.hour)
        column.addWidget(self._sky)
        column.addLayout(marks)
        column.addSpacing(4)
        column.addWidget(QLabel("Remap curve of the blended AO"))
        column.addWidget(self.curve)
        column.addWidget(self.game)
        column.addStretch(1)

    @property
    def chosen_hour(self) -> float:
        """The time on the slider, hours."""
        return self.hour.value() / _PER_HOUR

    def fill(self, display: Display, *, available: bool) -> None:
        """Follows what is shown."""
        self._filling = True
        self.on.setChecked(display.hour is not None)
        if display.hour is not None and abs(display.hour - self.chosen_hour) > 0.5 / _PER_HOUR:
            self.hour.setValue(round(display.hour * _PER_HOUR))
        self.game.setChecked(display.game)
        self.curve.set_curve(display.curve)
        self._say_time()
        for widget in (self.on, self.game, self.curve):
            widget.setEnabled(available)
        for widget in (self.hour, self.play):
            widget.setEnabled(available and display.hour is not None)
        if not available or display.hour is None:
            self.play.setChecked(False)
        self._filling = False

    def stop(self) -> None:
        """Lets no more time pass."""
        self._play.stop()

    def _tell(self, **changes: object) -> None:
        if not self._filling:
            self.changed.emit(changes)

    def _on_toggled(self, on: bool) -> None:
        self._tell(hour=self.chosen_hour if on else None)

    def _on_hour(self) -> None:
        self._say_time()
        self._tell(hour=self.chosen_hour)

    def _on_play(self, on: bool) -> None:
        if on:
            self._play.start()
        else:
            self._play.stop()

    def _on_tick(self) -> None:
        step = max(1, round(DAY * _PER_HOUR * _TICK_MS / 1000.0 / _DAY_SECONDS))
        self.hour.setValue((self.hour.value() + step) % (int(DAY) * _PER_HOUR))

    def _say_time(self) -> None:
        self.time.setText(f"{clock(self.chosen_hour)}  {name_of_hour(self.chosen_hour)}")


def _day() -> QPixmap:
    count = 96
    image = QImage(count, 1, QImage.Format.Format_RGB32)
    for x in range(count):
        color = displayed(ALBEDO * ambient_light(DAY * (x + 0.5) / count))
        image.setPixelColor(x, 0, QColor.fromRgbF(*color.tolist()))
    return QPixmap.fromImage(image)
