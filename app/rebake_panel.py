"""The rebake's panel: what has changed since the bake, what to bake anew, how the last rebake went, and its layers."""

from __future__ import annotations

from collections.abc import Sequence

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtGui import QAction
from PyQt6.QtWidgets import QCheckBox, QGridLayout, QGroupBox, QLabel, QSizePolicy, QVBoxLayout, QWidget

from app.action_buttons import action_button, fill_grid
from app.alpha_group import AlphaGroup
from app.rebake_layers import Layer
from app.rebaker import Timing
from app.tables import Cell, RowsView
from bake.rebake.types import RebakeReport

_NO_RESULT = "Bake first. Then only what a change can reach is baked anew."
_LAYER_TIP = "What each bake and rebake since the scene was opened has changed, the latest first; double click compares"
_LAYER_TIPS = ("What was done", "Vertices with another value since, by however little", "Whether it is in view")
_SELECT_STALE = "stale"
_LEAST_BOUND = 5e-6  # less would be told as 0


class RebakePanel(QWidget):
    """Says what is stale and how rebakes go; asks for nothing itself but the choice of a layer."""

    auto_toggled = pyqtSignal(bool)
    layer_chosen = pyqtSignal(int)
    layer_activated = pyqtSignal()
    stale_asked = pyqtSignal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._stale = _text()
        self._stale.linkActivated.connect(lambda _link: self.stale_asked.emit())
        self._settings = _text()
        self._settings.setObjectName("hint")
        self.auto = QCheckBox("At once, after every change")
        self.auto.setToolTip(
            "Rebake whatever a change reaches as soon as it is made. A further change takes the place of the rebake "
            "under way"
        )
        self.auto.toggled.connect(self.auto_toggled)
        self._buttons = QGridLayout()
        self._buttons.setSpacing(4)
        self._state = _text()
        self._report = _text()
        self._report.hide()
        self._groups = QVBoxLayout()
        self.alpha = AlphaGroup()
        layers = QGroupBox("Layers")
        self.layers = RowsView(("Layer", "Vertices", "State"), stretch=0)
        self.layers.rows.set_headings(("Layer", "Vertices", "State"), _LAYER_TIPS)
        self.layers.setToolTip(_LAYER_TIP)
        self.layers.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        self.layers.doubleClicked.connect(lambda _index: self.layer_activated.emit())
        self.layers.setMinimumHeight(92)
        self.layers.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored)  # it gives way to the rest
        selection = self.layers.selectionModel()
        assert selection is not None
        selection.selectionChanged.connect(lambda *_: self.layer_chosen.emit(self.chosen_layer()))
        self._layer_buttons = QVBoxLayout()
        self._layer_buttons.setSpacing(4)
        inner = QVBoxLayout(layers)
        inner.setContentsMargins(4, 4, 4, 4)
        inner.addWidget(self.layers, 1)
        inner.addLayout(self._layer_buttons)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(6, 6, 6, 6)
        layout.addWidget(self._stale)
        layout.addLayout(self._buttons)
        layout.addWidget(self._settings)
        layout.addWidget(self.auto)
        layout.addWidget(self._state)
        layout.addWidget(self._report)
        layout.addLayout(self._groups)
        layout.addWidget(self.alpha)
        layout.addWidget(layers, 1)
        self.show_stale(None)
        self.show_state("")
        self.show_settings("")
        self.show_layers(())

    def add_buttons(self, actions: Sequence[QAction], words: Sequence[str]) -> None:
        """Puts actions above the state under short words: the first in a row of its own, the others three a row."""
        self._buttons.addWidget(action_button(actions[0], words[0]), 0, 0, 1, 3)
        for number, (action, word) in enumerate(zip(actions[1:], words[1:], strict=True)):
            self._buttons.addWidget(action_button(action, word), 1 + number // 3, number % 3)

    def add_layer_buttons(self, actions: Sequence[QAction], words: Sequence[str]) -> None:
        """Puts actions below the layers, two a row, under short words."""
        self._layer_buttons.addLayout(fill_grid(actions, words))

    def add_layer_rows(self, rows: Sequence[tuple[str, Sequence[QAction]]], words: Sequence[str]) -> None:
        """Puts a table of actions below the layers: what is done, and to what of a layer.

        Args:
            rows: What the row does, and its actions.
            words: What the columns stand for.
        """
        grid = QGridLayout()
        grid.setSpacing(4)
        for number, (title, actions) in enumerate(rows):
            grid.addWidget(QLabel(title), number, 0)
            for column, (action, word) in enumerate(zip(actions, words, strict=True), start=1):
                grid.addWidget(action_button(action, word), number, column)
                grid.setColumnStretch(column, 1)
        self._layer_buttons.addLayout(grid)

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
            link = f' · <a href="{_SELECT_STALE}">select</a>' if text else ""
            self._stale.setText(f"<b>Since the bake:</b> {text}{link}" if text else "The result is up to date.")

    def show_settings(self, text: str) -> None:
        """Says which other settings than the result's a rebake would use; empty for none."""
        self._settings.setText(text)
        self._settings.setVisible(bool(text))

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
    if report.bound >= _LEAST_BOUND:
        lines.append(f"At most {report.bound:.5f} was left out of a sample")
    if report.stale:
        lines.append(f"{len(report.stale):,} objects are left as they were, though the change may reach them")
    return "<br>".join(lines)


def _text() -> QLabel:
    label = QLabel()
    label.setWordWrap(True)
    label.setTextFormat(Qt.TextFormat.RichText)
    return label
