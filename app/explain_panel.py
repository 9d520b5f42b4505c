"""Why the clicked point has its value: the value, its occluders, what if one of them did not cast."""

from __future__ import annotations

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import QCheckBox, QComboBox, QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from app.cause_cards import CauseCards
from app.tables import Cell, RowsView
from bake.explain.types import Explanation, ShareKind, SpotWithout
from viewer.explain_rows import headline, nearest_text, share_tip, summary
from viewer.fields import distance_label

_EMPTY = "Click on the surface, then explain the point (X). With this panel open, every click is explained."
_PATH, _SHARE = 0, 1


class ExplainPanel(QWidget):
    """Shows an explanation; asks for counterfactuals, previews and changes of the view."""

    explain_asked = pyqtSignal()
    column_chosen = pyqtSignal(int)
    occluder_chosen = pyqtSignal(int)
    """Object whose rays are drawn alone and without which the spot is wanted; -1 for all."""
    surface_asked = pyqtSignal(int)
    drawing_changed = pyqtSignal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._explanation: Explanation | None = None
        self._column = 0
        self._objects: list[int] = []
        self.explain = QPushButton("Explain")
        self.explain.setToolTip("Explain the clicked point (X)")
        self.explain.clicked.connect(self.explain_asked)
        self.distance = QComboBox()
        self.distance.setToolTip("At which distance")
        self.distance.activated.connect(self._on_column)
        self.rays = QCheckBox("Rays")
        self.rays.setToolTip("Draw the rays of the heaviest samples, light where they count as open")
        self.samples = QCheckBox("Samples")
        self.samples.setToolTip("Mark the samples by weight: orange for, blue against")
        for box in (self.rays, self.samples):
            box.setChecked(True)
            box.toggled.connect(self.drawing_changed)
        self._headline, self._summary = _text(), _text()
        self._without = _text()
        self._without.hide()
        self.surface = QPushButton("Show the whole surface without it")
        self.surface.setToolTip("Trace again what this object shadows, and compare it with the bake")
        self.surface.clicked.connect(lambda: self.surface_asked.emit(self.occluder()))
        self.surface.hide()
        self.view = RowsView(("Occluder", "Share", "Here", "Nearest"), stretch=_PATH)
        self.view.setSortingEnabled(True)
        self.view.sortByColumn(_SHARE, Qt.SortOrder.DescendingOrder)
        self.view.setToolTip("Click an occluder to see its rays, and the value without it")
        self.view.setMinimumHeight(170)
        selection = self.view.selectionModel()
        assert selection is not None
        selection.selectionChanged.connect(self._on_selection)
        self.causes = CauseCards()
        top = QHBoxLayout()
        for widget in (self.explain, self.distance):
            top.addWidget(widget, 1)
        second = QHBoxLayout()
        for widget in (self.rays, self.samples):
            second.addWidget(widget)
        second.addStretch(1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(6, 6, 6, 6)
        layout.addLayout(top)
        layout.addLayout(second)
        layout.addWidget(self._headline)
        layout.addWidget(self._summary)
        layout.addWidget(self.view, 1)
        layout.addWidget(self._without)
        layout.addWidget(self.surface)
        layout.addWidget(self.causes)
        layout.addStretch(1)
        self.set_message(_EMPTY)

    @property
    def column(self) -> int:
        """Which distance is looked at."""
        return self._column

    def occluder(self) -> int:
        """The chosen object, -1 for none."""
        row = self.view.chosen()
        return -1 if row is None else int(row[_PATH].key[1])

    def set_enabled(self, on: bool) -> None:
        """Whether there is a clicked point to explain."""
        self.explain.setEnabled(on)

    def set_distances(self, labels: list[str], column: int) -> None:
        """The baked distances."""
        self.distance.clear()
        self.distance.addItems(labels)
        self._column = min(column, max(len(labels) - 1, 0))
        self.distance.setCurrentIndex(self._column)

    def set_message(self, text: str = _EMPTY) -> None:
        """Shows no explanation, and why."""
        self._explanation = None
        self._headline.setText(text)
        self._summary.clear()
        self.view.rows.set_rows([])
        self.view.hide()
        self.causes.set_causes(())
        self.set_without(None)

    def set_explanation(self, explanation: Explanation, path: str) -> None:
        """Shows an explanation; the path is that of the spot's object."""
        self._explanation, self._path = explanation, path
        self.view.show()
        self._fill()

    def set_without(self, without: SpotWithout | None, name: str = "") -> None:
        """Shows the value without the chosen occluder; None takes it away."""
        self._without.setVisible(without is not None)
        self.surface.setVisible(without is not None)
        if without is None or self._explanation is None:
            return
        rows = [
            f"{distance_label(metres)}: {before:.3f} → <b>{after:.3f}</b>"
            for metres, before, after in zip(self._explanation.distances, without.before, without.after, strict=True)
        ]
        about = " (about)" if without.is_estimate else ""
        self._without.setText(f"If <b>{name}</b> did not cast{about}: " + ",  ".join(rows))

    def _fill(self) -> None:
        explanation = self._explanation
        if explanation is None:
            return
        self._headline.setText(headline(explanation, self._column))
        self._summary.setText(summary(explanation, self._path, self._column))
        rows: list[tuple[Cell, ...]] = []
        for number, share in enumerate(explanation.shares):
            here, own = float(share.share[self._column]), float(share.own[self._column])
            if share.kind is not ShareKind.OBJECT and abs(here) < 5e-5:
                continue
            name = share.name.rpartition("/")[2] + (" (itself)" if share.is_self else "")
            tip = f"{share.name}\n{share_tip(share, self._column)}"
            rows.append(
                (
                    Cell(name, (name, share.object, number), tip=tip),
                    Cell(f"{here:+.3f}", here, tip=tip),
                    Cell(f"{own:+.3f}", own, tip="The part that samples on the faces at this spot saw"),
                    Cell(nearest_text(share), share.nearest, tip=tip),
                )
            )
        self.view.set_rows(rows)

    def _on_column(self, column: int) -> None:
        self._column = column
        self._fill()
        self.column_chosen.emit(column)

    def _on_selection(self) -> None:
        self.set_without(None)
        self.occluder_chosen.emit(self.occluder())


def _text() -> QLabel:
    label = QLabel()
    label.setWordWrap(True)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return label
