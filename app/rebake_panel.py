"""The rebake's panel: what has changed since the bake, what to bake anew, how the last rebake went, and its layers."""

from __future__ import annotations

from collections.abc import Sequence

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtGui import QAction
from PyQt6.QtWidgets import QCheckBox, QGridLayout, QGroupBox, QLabel, QVBoxLayout, QWidget

from app.action_buttons import fill_grid
from app.alpha_group import AlphaGroup
from app.rebake_layers import Layer
from app.rebaker import Timing
from app.tables import Cell, RowsView
from bake.rebake.types import RebakeReport

_NO_RESULT = "Bake first. Then only what a change can reach is baked anew."
_LAYER_TIP = "What each bake and rebake since the scene was opened has changed, the latest first"


class RebakePanel(QWidget):
    """Says what is stale and how rebakes go; asks for nothing itself but the choice of a layer."""

    auto_toggled = pyqtSignal(bool)
    layer_chosen = pyqtSignal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._stale = _text()
        self.auto = QCheckBox("At once, after every change")
        self.auto.setToolTip(
            "Rebake whatever a change reaches as soon as it is made. A further change takes the place of the rebake "
            "under way"
        )
        self.auto.toggled.connect(self.auto_toggled)
        self._buttons = QGridLayout()
        self._state = _text()
        self._report = _text()
        self._report.hide()
        self._groups = QVBoxLayout()
        self.alpha = AlphaGroup()
        layers = QGroupBox("Layers")
        self.layers = RowsView(("Layer", "Vertices", "State"), stretch=0)
        self.layers.setToolTip(_LAYER_TIP)
        self.layers.setMinimumHeight(110)
        selection = self.layers.selectionModel()
        assert selection is not None
        selection.selectionChanged.connect(lambda *_: self.layer_chosen.emit(self.chosen_layer()))
        self._layer_buttons = QGridLayout()
        inner = QVBoxLayout(layers)
        inner.setContentsMargins(4, 4, 4, 4)
        inner.addWidget(self.layers, 1)
        inner.addLayout(self._layer_buttons)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(6, 6, 6, 6)
        layout.addWidget(self._stale)
        layout.addLayout(self._buttons)
        layout.addWidget(self.auto)
        layout.addWidget(self._state)
        layout.addWidget(self._report)
        layout.addLayout(self._groups)
        layout.addWidget(self.alpha)
        layout.addWidget(layers, 1)
        self.show_stale(None)
        self.show_state("")
        self.show_layers(())

    def add_buttons(self, actions: Sequence[QAction], words: Sequence[str]) -> None:
        """Puts actions above the state, two a row, under short words."""
        fill_grid(actions, words, grid=self._buttons)

    def add_layer_buttons(self, actions: Sequence[QAction], words: Sequence[str]) -> None:
        """Puts actions below the layers, two a row, under short words."""
        fill_grid(actions, words, grid=self._layer_buttons)

    def add_group(self, group: QWidget) -> None:
        """Puts a group of another concern between the report and the smoothing."""
        self._groups.addWidget(group)

    def chosen_layer(self) -> int:
        """Number of the chosen layer, -1 for none."""
        row = self.layers.chosen()
        return -1 if row is None else int(row[0].key[1])

    def show_stale(self, text: str | None) -> None:
        """Says what differs from the result; empty for nothing, None without a result."""
        if text is None:
            self._stale.setText(_NO_RESULT)
        else:
            self._stale.setText(f"<b>Since the bake:</b> {text}" if text else "The result is up to date.")

    def show_state(self, text: str) -> None:
        """What a rebake under way does; empty without one."""
        self._state.setText(text)
        self._state.setVisible(bool(text))

    def show_report(self, report: RebakeReport | None, timing: Timing) -> None:
        """How the last rebake went."""
        self._report.setVisible(report is not None)
        if report is not None:
            self._report.setText(report_text(report, timing))
            stages = "\n".join(f"{name}: {seconds:.2f} s" for name, seconds in report.stages.items())
            self._report.setToolTip(f"Of the last rebake; a ray has changed if its value has\n{stages}")

    def show_layers(self, layers: Sequence[Layer]) -> None:
        """Lists the layers, the latest first."""
        self.layers.set_rows(
            [
                (
                    Cell(layer.name, (layer.name, layer.number), tip=layer.tip),
                    Cell("" if layer.vertices < 0 else f"{layer.vertices:,}", layer.vertices),
                    Cell(layer.state, layer.state),
                )
                for layer in reversed(layers)
            ]
        )


def report_text(report: RebakeReport, timing: Timing) -> str:
    """What a rebake did, as a few lines of rich text."""
    times = [
        f"{word} {seconds:.2f} s"
        for word, seconds in (("first picture", timing.first), ("final", timing.final), ("stored", timing.stored))
        if seconds >= 0.0
    ]
    lines = [", ".join(times).capitalize()]
    if report.full:
        lines.append(f"Baked in full: {report.full}")
    if report.rays_traced or report.rays_changed:
        share = f" ({report.rays_traced / report.rays_changed:.1f} x)" if report.rays_changed else ""
        lines.append(f"{report.rays_traced:,} rays traced, {report.rays_changed:,} changed{share}")
    else:
        lines.append("No ray was traced")
    lines.append(
        f"{report.samples_changed:,} of {report.samples:,} samples, {report.vertices_changed:,} vertices changed"
    )
    if report.bound > 0.0:
        lines.append(f"At most {report.bound:.5f} was left out of a sample")
    if report.stale:
        lines.append(f"{len(report.stale):,} objects are left as they were, though the change may reach them")
    return "<br>".join(lines)


def _text() -> QLabel:
    label = QLabel()
    label.setWordWrap(True)
    label.setTextFormat(Qt.TextFormat.RichText)
    return label
