"""Marks over the surface, and the back-face threshold, which moves without tracing again."""

from __future__ import annotations

from PyQt6.QtCore import Qt, QTimer, pyqtSignal
from PyQt6.QtWidgets import (
    QCheckBox,
    QDoubleSpinBox,
    QGroupBox,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSlider,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from app.document import Document
from app.view_presenter import Overlays
from bake.types import Tally, VertexField, VertexState
from viewer.colormaps import WARNING
from viewer.overlays import FILLED_COLOR, UNREFERENCED_COLOR, invalid_count

APPLY_MS = 200
"""How long the slider must rest before the values are solved again."""


class OverlayPanel(QWidget):
    """Switches marks on and off; sets the document's threshold."""

    overlays_changed = pyqtSignal(object)  # Overlays
    threshold_settled = pyqtSignal()
    threshold_kept = pyqtSignal(float)

    def __init__(self, document: Document, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._document = document
        self._filling = False
        self._counted: tuple[VertexField | None, float] = (None, 0.0)
        self._judged: tuple[Tally | None, float, int] = (None, 0.0, 0)
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.setInterval(APPLY_MS)
        self._rest.timeout.connect(self._on_rest)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(6, 6, 6, 6)
        layout.addWidget(self._build_threshold())
        layout.addWidget(self._build_marks())
        layout.addStretch(1)
        document.result_changed.connect(self.refresh)
        document.threshold_changed.connect(self.refresh)
        document.field_changed.connect(self.refresh)
        self.refresh()

    def overlays(self) -> Overlays:
        """What is ticked."""
        return Overlays(
            invalid=self._invalid.isChecked(),
            filled=self._filled.isChecked(),
            unreferenced=self._unreferenced.isChecked(),
            samples=self._samples.isChecked(),
            size=self._size.value(),
        )

    def set_invalid(self, on: bool) -> None:
        """Marks invalid samples, or not."""
        self._invalid.setChecked(on)

    def set_solving(self, busy: bool) -> None:
        """Says that values for the threshold are on their way."""
        self._state.setVisible(busy or self._document.is_preview)
        self._state.setText("Solving again …" if busy else "Preview: the stored result still has its own threshold.")

    def _build_threshold(self) -> QWidget:
        box = QGroupBox("Back-face threshold")
        tip = (
            "A sample is invalid if more than this share of its hits are back faces (Sloan et al. 2013: 25 %).\n"
            "Moving it solves for the vertices again, without tracing."
        )
        self._slider = QSlider(Qt.Orientation.Horizontal)
        self._slider.setRange(0, 1000)
        self._slider.setPageStep(50)
        self._slider.setToolTip(tip)
        self._slider.valueChanged.connect(lambda value: self._on_threshold(value / 1000.0))
        self._spin = QDoubleSpinBox()
        self._spin.setRange(0.0, 100.0)
        self._spin.setDecimals(1)
        self._spin.setSuffix(" %")
        self._spin.setKeyboardTracking(False)
        self._spin.setToolTip(tip)
        self._spin.valueChanged.connect(lambda value: self._on_threshold(value / 100.0))
        self._counts = QLabel()
        self._counts.setWordWrap(True)
        self._counts.setToolTip("Samples above the threshold, out of all; vertices that lost all their samples")
        self._live = QCheckBox("Solve again as it moves")
        self._live.setChecked(True)
        self._live.setToolTip("Off for very large scenes, where a solve takes long: then use Apply")
        self._apply = QPushButton("Apply")
        self._apply.setToolTip("Solve for the vertices with this threshold; nothing is traced or stored")
        self._apply.clicked.connect(self.threshold_settled)
        self._reset = QPushButton("Reset")
        self._reset.setToolTip("Back to the threshold of the stored result")
        self._reset.clicked.connect(self._on_reset)
        self._keep = QPushButton("Use in bake")
        self._keep.setToolTip("Put this threshold into the bake settings")
        self._keep.clicked.connect(lambda: self.threshold_kept.emit(self._document.threshold))
        self._state = QLabel()
        self._state.setWordWrap(True)
        self._state.hide()
        first, buttons = QHBoxLayout(), QHBoxLayout()
        first.addWidget(self._slider, 1)
        first.addWidget(self._spin)
        for button in (self._apply, self._reset, self._keep):
            buttons.addWidget(button)
        column = QVBoxLayout(box)
        column.setContentsMargins(8, 4, 8, 6)
        column.addLayout(first)
        column.addWidget(self._counts)
        column.addWidget(self._live)
        column.addLayout(buttons)
        column.addWidget(self._state)
        return box

    def _build_marks(self) -> QWidget:
        box = QGroupBox("Marks")
        self._invalid = QCheckBox("Invalid samples, by back-face share")
        self._invalid.setToolTip(
            "Samples above the threshold: yellow just above it, dark violet where every hit is a back face"
        )
        self._scale = QLabel()
        self._filled = QCheckBox("Filled vertices")
        self._filled.setToolTip("All their samples were invalid: their values come from the neighbours")
        self._unreferenced = QCheckBox("Unreferenced vertices")
        self._unreferenced.setToolTip("No triangle uses them; they have no value")
        self._samples = QCheckBox("All samples, by AO")
        self._samples.setToolTip("Where AO was estimated; grey is the sample's own value at the distance in view")
        self._size = QSpinBox()
        self._size.setRange(1, 20)
        self._size.setValue(5)
        self._size.setSuffix(" px")
        self._size.setToolTip("Size of the marks in pixels")
        self._size.valueChanged.connect(self._on_overlays)
        column = QVBoxLayout(box)
        column.setContentsMargins(8, 4, 8, 6)
        for check in (self._invalid, self._filled, self._unreferenced, self._samples):
            check.toggled.connect(self._on_overlays)
        column.addWidget(self._invalid)
        column.addWidget(self._scale)
        column.addLayout(_with_swatch(self._filled, FILLED_COLOR))
        column.addLayout(_with_swatch(self._unreferenced, UNREFERENCED_COLOR))
        column.addWidget(self._samples)
        size = QHBoxLayout()
        size.addWidget(QLabel("Size"))
        size.addWidget(self._size)
        size.addStretch(1)
        column.addLayout(size)
        self._drawn = QLabel()
        self._drawn.setWordWrap(True)
        column.addWidget(self._drawn)
        return box

    def set_drawn(self, text: str) -> None:
        """Says what is drawn where it is not everything."""
        self._drawn.setText(text)
        self._drawn.setVisible(bool(text))

    def refresh(self) -> None:
        """Follows the document."""
        document, result = self._document, self._document.result
        self._filling = True
        self._slider.setValue(round(1000 * document.threshold))
        self._spin.setValue(100.0 * document.threshold)
        self._filling = False
        self.setEnabled(result is not None)
        self._scale.setText(_scale_text(document.threshold))
        if result is None or document.field is None:
            self._counted, self._judged = (None, 0.0), (None, 0.0, 0)
            self._counts.setText("No result yet.")
            return
        counted, threshold = self._counted
        self._reset.setEnabled(document.threshold != result.settings.back_face_threshold)
        if counted is document.field and threshold == document.threshold:
            return
        self._counted = document.field, document.threshold
        if self._judged[0] is not result.tally or self._judged[1] != document.threshold:
            self._judged = result.tally, document.threshold, invalid_count(result.tally, document.threshold)
        invalid, total = self._judged[2], len(result.tally)
        state = document.field.state
        filled = int((state == VertexState.FILLED).sum())
        unreferenced = int((state == VertexState.UNREFERENCED).sum())
        self._counts.setText(
            f"{invalid:,} of {total:,} samples invalid ({invalid / max(total, 1):.2%})\n"
            f"{filled:,} vertices filled, {unreferenced:,} unreferenced"
        )
        self._filled.setText(f"Filled vertices ({filled:,})")
        self._unreferenced.setText(f"Unreferenced vertices ({unreferenced:,})")

    def _on_threshold(self, threshold: float) -> None:
        if self._filling:
            return
        self._document.set_threshold(threshold)
        if self._live.isChecked():
            self._rest.start()

    def _on_rest(self) -> None:
        self.threshold_settled.emit()

    def _on_reset(self) -> None:
        result = self._document.result
        if result is not None:
            self._document.set_threshold(result.settings.back_face_threshold)
            self.threshold_settled.emit()

    def _on_overlays(self) -> None:
        self.overlays_changed.emit(self.overlays())


def _with_swatch(check: QCheckBox, color: tuple[int, int, int]) -> QHBoxLayout:
    swatch = QLabel()
    swatch.setFixedSize(10, 10)
    swatch.setStyleSheet(f"background: rgb{color};")
    row = QHBoxLayout()
    row.addWidget(check)
    row.addWidget(swatch)
    row.addStretch(1)
    return row


def _scale_text(threshold: float) -> str:
    """The colours of the invalid samples, as a strip of coloured blocks."""
    colors = WARNING.table()[::23].tolist()
    blocks = "".join(f'<span style="color: rgb({r},{g},{b});">█</span>' for r, g, b in colors)
    return f"{threshold:.0%} {blocks} 100 % back faces"
