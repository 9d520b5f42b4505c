"""What of the regions is drawn in the view: the first group of their panel."""

from __future__ import annotations

import html

import numpy as np
from PyQt6.QtWidgets import QCheckBox, QGroupBox, QPushButton, QRadioButton, QWidget

from app.group_parts import choice, group_form, in_row, note
from app.region_state import RegionState
from bake.region_types import PointState
from viewer.fields import distance_label
from viewer.region_view import PointSet, RegionColor

_BOXES = (
    ("Not drawn", None),
    ("By fit error", RegionColor.ERROR),
    ("By mismatch", RegionColor.MISMATCH),
    ("By valid points", RegionColor.VALID),
    ("By memory", RegionColor.MEMORY),
    ("By parameters determined", RegionColor.TERMS),
    ("By centre of the model", RegionColor.CENTRE),
)
_POINTS = (
    ("Not drawn", PointSet.NONE),
    ("Of the selected region", PointSet.SELECTED),
    ("Of all regions", PointSet.ALL),
)


class RegionShownGroup(QGroupBox):
    """Edits the part of the state's `RegionView` that says which marks are drawn."""

    def __init__(self, state: RegionState, parent: QWidget | None = None) -> None:
        super().__init__("Show", parent)
        self._state = state
        self._filling = False
        self._summary = note("Points are traced where objects can be; absorbed regions use another one's model")
        self.boxes = choice(_BOXES, "Boxes of the regions; a click in the view selects the region under the cursor")
        self.boxes.currentIndexChanged.connect(lambda: self._change(boxes=self.boxes.currentData()))
        self.points = choice(_POINTS, "The 8 × 8 × 8 grid points of a region by what became of them")
        self.points.currentIndexChanged.connect(lambda: self._change(points=self.points.currentData()))
        self.column = choice((), "Distance at which models, errors and mismatches are shown")
        self.column.currentIndexChanged.connect(lambda: self._change(column=max(self.column.currentIndex(), 0)))
        self.links = self._check("Links", "links", "Which regions touch, through the middle of what they share")
        self.centres = self._check("Centres", "centres", "The point about which each model bends")
        self.models = self._check("Models", "models", "A small sphere lit by each region's model, at its centre")
        self.front = self._check("Through walls", "through_walls", "Draw boxes, links, points and centres before walls")
        self.deformed = self._check(
            "AO as radius", "deformed", "Spheres show AO by radius and colour, instead of as light on their surface"
        )
        self.fitted = QRadioButton("As fitted")
        self.fitted.setToolTip("Each model as fitted to its own region (R switches)")
        self.regularised = QRadioButton("Regularised")
        self.regularised.setToolTip("Models drawn toward their neighbours, as an engine uses them (R switches)")
        self.fitted.toggled.connect(lambda on: self._change(as_fitted=on))
        self._forget = QPushButton("Deselect")
        self._forget.setToolTip("Lets go of the selected region or boundary")
        self._forget.clicked.connect(lambda: self._change(region=-1, link=-1))
        form = group_form(self)
        form.addRow(self._summary)
        form.addRow("Boxes", self.boxes)
        form.addRow("Points", self.points)
        form.addRow("Distance", self.column)
        form.addRow(in_row(self.links, self.centres, self.models))
        form.addRow(in_row(self.front, self.deformed))
        form.addRow(in_row(self.fitted, self.regularised))
        self._chosen = note("The selected region or boundary")
        form.addRow(self._chosen)
        form.addRow(in_row(self._forget))
        for event in (state.opened, state.view_changed, state.regions_changed):
            event.connect(self.refresh)
        self.refresh()

    def _check(self, text: str, name: str, tip: str) -> QCheckBox:
        check = QCheckBox(text)
        check.setToolTip(tip)
        check.toggled.connect(lambda on: self._change(**{name: on}))
        return check

    def refresh(self) -> None:
        """Follows the state."""
        if self._state.regions is None:
            return
        self._filling = True
        try:
            self._fill()
        finally:
            self._filling = False

    def _fill(self) -> None:
        state, view, regions, result = self._state, self._state.view, self._state.regions, self._state.document.result
        if regions is None or result is None:
            return
        labels = [distance_label(distance) for distance in result.settings.column_distances]
        if [self.column.itemText(row) for row in range(self.column.count())] != labels:
            self.column.clear()
            self.column.addItems(labels)
        self.boxes.setCurrentIndex(self.boxes.findData(view.boxes))
        self.points.setCurrentIndex(self.points.findData(view.points))
        self.column.setCurrentIndex(view.column)
        checks = (
            (self.links, view.links),
            (self.centres, view.centres),
            (self.models, view.models),
            (self.front, view.through_walls),
            (self.deformed, view.deformed),
        )
        for check, on in checks:
            check.setChecked(on)
        (self.fitted if view.as_fitted else self.regularised).setChecked(True)
        points = np.asarray(regions.points.state)
        valid, dropped = (int((points == code).sum()) for code in (PointState.VALID, PointState.BACK_FACES))
        absorbed = f", {len(regions.absorbed):,} absorbed" if regions.absorbed else ""
        self._summary.setText(
            f"{len(regions.graph):,} regions{absorbed}, {len(regions.graph.link):,} links; "
            f"{valid:,} of {len(points):,} points valid, {dropped:,} see too many back faces"
        )
        self._chosen.setText(_chosen_text(state))
        self._forget.setEnabled(view.region >= 0 or view.link >= 0)

    def _change(self, **changes: object) -> None:
        if not self._filling:
            self._state.set_view(self._state.view.replaced(**changes))


def _chosen_text(state: RegionState) -> str:
    regions, view = state.regions, state.view
    if regions is None:
        return ""
    graph = regions.graph
    if 0 <= view.link < len(graph.link):
        a, b = (html.escape(graph.names[region]) for region in graph.link[view.link])
        before = float(regions.mismatch_before[view.link, view.column])
        after = float(regions.mismatch_after[view.link, view.column])
        return (
            f"<b>{a} – {b}</b><br>{graph.link_area[view.link]:.3g} m² shared; "
            f"mismatch {before:.4f} as fitted, {after:.4f} regularised"
        )
    if 0 <= view.region < len(graph):
        fitted, used = regions.fitted.rmse[view.region, view.column], regions.regularised.rmse[view.region, view.column]
        errors = "no valid point" if np.isnan(fitted) else f"RMSE {fitted:.4f} as fitted, {used:.4f} regularised"
        return f"<b>{html.escape(graph.names[view.region])}</b><br>{errors}"
    return "Click on a region in the view, or on a row of the region list."
