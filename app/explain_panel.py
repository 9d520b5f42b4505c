"""Why the clicked point has its value: the value, its occluders, what if one of them did not cast."""

from __future__ import annotations

import html
from collections.abc import Sequence

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import QCheckBox, QComboBox, QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from app.cause_cards import CauseCards
from app.explain_dome import ExplainDome
from app.row_hover import RowHover
from app.tables import Cell, RowsView
from bake.explain.types import Explanation, ShareKind, SpotWithout
from viewer.explain_rows import headline, nearest_text, share_name, share_tip, summary
from viewer.fields import distance_label

_EMPTY = "Click on the surface, then explain the point (X). With this panel open, every click is explained."
_HOVER = "Point at an occluder to see AO here if it did not cast."
_WAIT = "If <b>{name}</b> did not cast: …"
_BACK, _WHOLE = "Show the bake again", "Show the whole surface without it"
_PATH, _SHARE = 0, 1


class ExplainPanel(QWidget):
    """Shows an explanation; asks for counterfactuals, previews and changes of the view."""

    explain_asked = pyqtSignal()
    column_chosen = pyqtSignal(int)
    occluder_chosen = pyqtSignal(int)
    """Object whose rays are drawn alone; -1 for all."""
    without_wanted = pyqtSignal(int)
    """Object, chosen or under the cursor, without which the spot is wanted."""
    surface_asked = pyqtSignal(int)
    drawing_changed = pyqtSignal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._explanation: Explanation | None = None
        self._column = 0
        self._paths: Sequence[str] = ()
        self._hovered = -1
        self._surface_shown = self._surface_busy = False
        self._without_of: dict[int, SpotWithout] = {}
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
        self.dome = ExplainDome()
        self.dome.occluder_clicked.connect(self.choose)
        self._without = _text()
        self._without.setMinimumHeight(3 * self.fontMetrics().height())  # what comes and goes would push the table
        self._without.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.surface = QPushButton(_WHOLE)
        self.surface.setToolTip(
            "Trace again what the chosen occluder shadows. While this is shown it follows the occluder pointed at"
        )
        self.surface.clicked.connect(lambda: self.surface_asked.emit(self.occluder()))
        self.view = RowsView(("Occluder", "Share", "Here", "Nearest"), stretch=_PATH)
        self.view.setSortingEnabled(True)
        self.view.sortByColumn(_SHARE, Qt.SortOrder.DescendingOrder)
        self.view.setTextElideMode(Qt.TextElideMode.ElideMiddle)  # the end tells one of many from the others
        self.view.setMinimumHeight(170)
        selection = self.view.selectionModel()
        assert selection is not None
        selection.selectionChanged.connect(self._on_selection)
        self.hover = RowHover(self.view)
        self.hover.rested.connect(self._on_hover)
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
        layout.addWidget(self.dome)
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

    def looked_at(self) -> int:
        """The object under the cursor, else the chosen one; -1 for none."""
        return self._hovered if self._hovered >= 0 else self.occluder()

    def choose(self, owner: int) -> None:
        """Chooses the row of an object, or none."""
        rows = self.view.rows
        numbers = [n for n in range(rows.rowCount()) if owner >= 0 and rows.given(n)[_PATH].key[1] == owner]
        self.view.show_row(numbers[0] if numbers else -1)

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
        self._without_of.clear()
        self._headline.setText(text)
        self._summary.clear()
        self.view.rows.set_rows([])
        self.dome.set_explanation(None)
        self._hovered = -1
        self._show(False)
        self.causes.set_causes(())

    def set_explanation(self, explanation: Explanation, paths: Sequence[str]) -> None:
        """Shows an explanation; the paths are those of all objects."""
        self._explanation, self._paths = explanation, paths
        self._without_of.clear()
        self.dome.set_explanation(explanation, paths, self._column)
        self._show(True)
        self._fill()
        self._tell_without()

    def set_without(self, without: SpotWithout) -> None:
        """Takes the value without an object, and shows it if that object is looked at."""
        self._without_of[without.object] = without
        self._tell_without()

    def forget_estimate(self, owner: int) -> None:
        """The whole surface without an object is known: what was estimated at the spot can be had exactly."""
        known = self._without_of.get(owner)
        if known is not None and known.is_estimate:
            del self._without_of[owner]
            if owner == self.looked_at():
                self._tell_without()

    def set_surface(self, *, shown: bool, busy: bool) -> None:
        """Whether the surface is shown without an object, and whether one is waited for."""
        self._surface_shown, self._surface_busy = shown, busy
        self.surface.setText(_BACK if shown else _WHOLE)
        self.surface.setEnabled(shown or (self.occluder() >= 0 and not busy))

    def _show(self, on: bool) -> None:
        for widget in (self.dome, self.view, self._without, self.surface):
            widget.setVisible(on)

    def _tell_without(self) -> None:
        """Shows the value without the object that is looked at, or asks for it."""
        explanation, owner = self._explanation, self.looked_at()
        self.set_surface(shown=self._surface_shown, busy=self._surface_busy)
        if explanation is None or owner < 0:
            self._without.setText(_HOVER)
            return
        without, name = self._without_of.get(owner), html.escape(self._paths[owner].rpartition("/")[2])
        if without is None:
            self._without.setText(_WAIT.format(name=name))
            self.without_wanted.emit(owner)
            return
        rows = [
            f"{distance_label(metres)}: {before:.3f} → <b>{after:.3f}</b>"
            for metres, before, after in zip(explanation.distances, without.before, without.after, strict=True)
        ]
        about = " (about)" if without.is_estimate else ""
        self._without.setText(f"If <b>{name}</b> did not cast{about}: " + ",  ".join(rows))

    def _fill(self) -> None:
        explanation = self._explanation
        if explanation is None:
            return
        self._headline.setText(headline(explanation, self._column))
        self._summary.setText(summary(explanation, self._paths[explanation.spot.object], self._column))
        rows: list[tuple[Cell, ...]] = []
        for number, share in enumerate(explanation.shares):
            here, own = float(share.share[self._column]), float(share.own[self._column])
            if share.kind is not ShareKind.OBJECT and abs(here) < 5e-5:
                continue
            name = share_name(share)
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
        metrics = self.view.fontMetrics()
        for number, text in enumerate(("Share 88", "+0.888", "Nearest"), start=1):  # the name gets what is left
            self.view.setColumnWidth(number, metrics.horizontalAdvance(text) + 14)

    def _on_column(self, column: int) -> None:
        chosen, self._column = self.occluder(), column
        self.dome.set_column(column)
        self._fill()
        self.choose(chosen)
        self.column_chosen.emit(column)

    def _on_selection(self) -> None:
        self.dome.set_occluder(self.looked_at())
        self.occluder_chosen.emit(self.occluder())
        self._tell_without()

    def _on_hover(self, row: int) -> None:
        self._hovered = -1 if row < 0 else int(self.view.rows.row(row)[_PATH].key[1])
        self.dome.set_occluder(self.looked_at())
        self._tell_without()


def _text() -> QLabel:
    label = QLabel()
    label.setWordWrap(True)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return label
