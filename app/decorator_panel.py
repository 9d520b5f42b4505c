"""What is shown of trees, shrubs, small decorators and LODs; groups that the result has nothing for are absent."""

from __future__ import annotations

import numpy as np
from PyQt6.QtCore import pyqtSignal
from PyQt6.QtWidgets import (
    QCheckBox,
    QGroupBox,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from app.document import Document
from app.group_parts import choice, enable_choice, group_form, in_row, note, small_table
from app.volume_group import VolumeGroup
from bake.decorator_types import Decorators, FogBoxes, TreeFits
from viewer.decorator_view import FogColor, TreeShading
from viewer.fields import distance_label
from viewer.fog_view import lost_share
from viewer.lods import at_level, level_count, shown_level

_NONE = "This result has no trees, shrubs, small decorators or LODs."
_TREES = (
    ("Local × global, as the game has it", TreeShading.PRODUCT),
    ("Global only, fitted without local", TreeShading.LINEAR),
    ("Gold: the volume at the vertices", TreeShading.GOLD),
    ("Local only: the tree alone", TreeShading.LOCAL),
    ("Not coloured", TreeShading.NONE),
)
_FOG = (
    ("Not drawn", None),
    ("By density as traced", FogColor.USED),
    ("By density as given", FogColor.GIVEN),
    ("By what overlap took", FogColor.LOST),
)


class DecoratorPanel(QWidget):
    """Edits the document's `DecoratorView`, and its visible LODs."""

    models_requested = pyqtSignal()
    lods_requested = pyqtSignal()
    table_requested = pyqtSignal(str)  # kind of an instance table

    def __init__(self, document: Document, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._document = document
        self._filling = False
        self._none = QLabel(_NONE)
        self._none.setWordWrap(True)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(6, 6, 6, 6)
        layout.setSpacing(6)
        self.volume = VolumeGroup(document)
        self._groups = [
            self._build_trees(),
            self._build_scalars(),
            self._build_fog(),
            self.volume,
            self._build_lods(),
        ]
        for widget in (*self._groups, self._none):
            layout.addWidget(widget)
        layout.addStretch(1)
        for event in (document.result_changed, document.decorators_changed, document.visibility_changed):
            event.connect(self.refresh)
        document.display_changed.connect(self.refresh)
        document.selection_changed.connect(self.refresh)
        self.refresh()

    def _build_trees(self) -> QWidget:
        box = QGroupBox("Trees")
        form = group_form(box)
        self.trees = choice(_TREES, "Which model colours the trees; distance and range are those of Display")
        self.trees.currentIndexChanged.connect(lambda: self._change(trees=self.trees.currentData()))
        self._tree_note = note("Error of each model against the signal traced on the trees themselves")
        self._models = QPushButton("Compare models")
        self._models.setToolTip("The selected tree three times: global only, local × global, gold (M)")
        self._models.clicked.connect(self.models_requested)
        form.addRow(self.trees)
        form.addRow(self._tree_note)
        form.addRow(in_row(self._models, self._table_button("Trees")))
        return box

    def _build_scalars(self) -> QWidget:
        box = QGroupBox("Shrubs and small decorators")
        form = group_form(box)
        self.scalars = QCheckBox("Coloured by their scalar")
        self.scalars.setToolTip("One value each: the baked AO of the surface around them")
        self.scalars.toggled.connect(lambda on: self._change(scalars=on))
        self._scalar_note = note("A decorator whose sphere meets no baked surface counts as open")
        form.addRow(self.scalars, self._table_button("Scalars"))
        form.addRow(self._scalar_note)
        return box

    def _build_fog(self) -> QWidget:
        box = QGroupBox("Fog boxes")
        form = group_form(box)
        self.fog = choice(_FOG, "Shrubs as rays meet them: boxes in which visibility falls by exp(−density × length)")
        self.fog.currentIndexChanged.connect(lambda: self._change(fog=self.fog.currentData()))
        self._fog_note = note("Where boxes overlap their densities were lowered, so that they do not darken twice")
        form.addRow(in_row(self.fog, self._table_button("Fog boxes")))
        form.addRow(self._fog_note)
        return box

    def _build_lods(self) -> QWidget:
        box = QGroupBox("Levels of detail")
        form = group_form(box)
        self.level = choice((), "Level drawn of everything that has LODs; single ones can be ticked in Objects")
        self.level.activated.connect(self._on_level)
        compare = QPushButton("Compare levels")
        compare.setToolTip("The levels of the selected object side by side on one camera, finest first (Alt+M)")
        compare.clicked.connect(self.lods_requested)
        form.addRow("Show", self.level)
        form.addRow(in_row(compare, self._table_button("LODs")))
        return box

    def _table_button(self, kind: str) -> QPushButton:
        button = QPushButton("Table")
        button.setToolTip(f"{kind} as a table, below the view")
        button.clicked.connect(lambda: self.table_requested.emit(kind))
        return button

    def refresh(self) -> None:
        """Follows the document."""
        self.volume.refresh()
        self._filling = True
        try:
            self._fill()
        finally:
            self._filling = False

    def _fill(self) -> None:
        document, view = self._document, self._document.decorators
        values, result, world = document.values, document.result, document.world
        has = Decorators() if values is None else values.decorators
        levels = 0 if world is None or result is None else level_count(world)
        scalars = [part for part in (has.shrub_scalars, has.small_scalars) if part is not None]
        shown = (has.fits is not None, bool(scalars), has.fog is not None, has.volume is not None, levels > 0)
        for group, visible in zip(self._groups, shown, strict=True):
            group.setVisible(visible)
        self._none.setVisible(result is not None and not any(shown))
        self._none.setText(
            "This result has no trees, shrubs, small decorators or LODs." if result else "No result yet."
        )
        self._none.setVisible(not any(shown))
        labels = () if result is None else tuple(map(distance_label, result.settings.column_distances))
        if has.fits is not None and values is not None:
            self.trees.setCurrentIndex(self.trees.findData(view.trees))
            for row, (_, shading) in enumerate(_TREES):
                enable_choice(self.trees, row, shading is TreeShading.NONE or values.has(shading))
            self._tree_note.setText(_tree_text(has.fits, len(has.models), labels))
            self._models.setEnabled(values.tree_row(document.selected) >= 0 and values.has(TreeShading.GOLD))
        if scalars:
            self.scalars.setChecked(view.scalars)
            alone = sum(int((~np.asarray(part.found)).sum()) for part in scalars)
            counts = [
                f"{len(part.object):,} {name}"
                for name, part in (("shrubs", has.shrub_scalars), ("small", has.small_scalars))
                if part is not None
            ]
            self._scalar_note.setText(", ".join(counts) + f"; {alone:,} met no baked surface")
        if has.fog is not None:
            self.fog.setCurrentIndex(self.fog.findData(view.fog))
            self._fog_note.setText(_fog_text(has.fog))
        if levels and world is not None:
            self._fill_levels(levels, shown_level(world, document.visible))

    def _fill_levels(self, count: int, shown: int) -> None:
        texts = ["Finest", *(f"LOD {level}" for level in range(1, count + 1)), "As ticked in Objects"]
        if [self.level.itemText(row) for row in range(self.level.count())] != texts:
            self.level.clear()
            self.level.addItems(texts)
        self.level.setCurrentIndex(shown if shown >= 0 else count + 1)

    def _change(self, **changes: object) -> None:
        if not self._filling:
            self._document.set_decorators(self._document.decorators.replaced(**changes))

    def _on_level(self, level: int) -> None:
        document = self._document
        if document.world is not None and level <= level_count(document.world):
            document.set_visible(at_level(document.world, document.visible, level))
        self.refresh()


def _tree_text(fits: TreeFits, models: int, labels: tuple[str, ...]) -> str:
    means = (
        ("global only", fits.rmse_global.mean(axis=0)),
        ("local × global", fits.rmse_product.mean(axis=0)),
        ("gold from the volume", fits.rmse_volume.mean(axis=0)),
    )
    rows = [[name, *(f"{error:.4f}" for error in errors)] for name, errors in means]
    title = f"{len(fits.object):,} trees of {models:,} models; mean RMSE"
    return title + small_table(["", *(f"at {label}" for label in labels)], rows)


def _fog_text(fog: FogBoxes) -> str:
    lost = lost_share(fog)
    lowered = lost > 1e-6
    text = f"{len(fog):,} boxes, {int(lowered.sum()):,} lowered by overlap"
    return text + (f", by {float(lost[lowered].mean()):.0%} on average" if lowered.any() else "")
