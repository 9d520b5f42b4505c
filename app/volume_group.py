"""The tree volume's group of the decorator panel: bricks, voxels, slices, and the voxel that was clicked."""

from __future__ import annotations

import numpy as np
from PyQt6.QtCore import Qt
from PyQt6.QtWidgets import QCheckBox, QGroupBox, QLabel, QPushButton, QSlider, QWidget

from app.document import Document
from app.group_parts import choice, group_form, in_row, note, small_table
from bake.decorator_types import TreeVolume
from viewer.decorator_view import ALL_LAYERS, VoxelColor
from viewer.fields import distance_label
from viewer.volume_view import DIRECTIONS, layers, voxel_table, voxel_title

_VOXELS = (("Not drawn", None), ("By validity", VoxelColor.VALIDITY), ("By AO", VoxelColor.AO))


class VolumeGroup(QGroupBox):
    """Edits the volume's part of the document's `DecoratorView`; hidden where there is no volume."""

    def __init__(self, document: Document, parent: QWidget | None = None) -> None:
        super().__init__("Tree volume", parent)
        self._document = document
        self._filling = False
        self._layers = np.zeros(0, np.int64)
        self._layers_of: tuple[TreeVolume | None, int] = (None, -1)
        self.bricks = QCheckBox("Bricks")
        self.bricks.setToolTip("Outlines of the bricks, 8 × 8 × 8 cells each")
        self.bricks.toggled.connect(lambda on: self._change(bricks=on))
        self.voxels = choice(_VOXELS, "Voxels of the volume; click on one to see its harmonics")
        self.voxels.currentIndexChanged.connect(lambda: self._change(voxels=self.voxels.currentData()))
        self._column = choice((), "Distance at which voxels are evaluated")
        self._column.currentIndexChanged.connect(lambda: self._change(column=max(self._column.currentIndex(), 0)))
        self._direction = choice(
            [(text, number) for number, (text, _) in enumerate(DIRECTIONS)],
            "AO of a surface that faces this way: harmonics convolved with the clamped cosine; or their mean",
        )
        self._direction.currentIndexChanged.connect(lambda: self._change(direction=self._direction.currentData()))
        self.slice = QCheckBox("One slice")
        self.slice.setToolTip("Only the voxels at one height, as a plane of squares")
        self.slice.toggled.connect(self._on_slice)
        self.layer = QSlider(Qt.Orientation.Horizontal)
        self.layer.setToolTip("Height of the slice")
        self.layer.valueChanged.connect(lambda _: self._on_slice(self.slice.isChecked()))
        self._height = QLabel()
        self._volume_note = note("Memory is that of bricks and harmonics")
        self._voxel = note("The voxel clicked: AO of a surface there by the way it faces, and its mean")
        self._voxel.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._forget = QPushButton("Forget the voxel")
        self._forget.setToolTip("Takes the voxel's sphere out of the view")
        self._forget.clicked.connect(lambda: self._change(voxel=-1))
        form = group_form(self)
        form.addRow(self._volume_note)
        form.addRow("Voxels", self.voxels)
        form.addRow("Distance", self._column)
        form.addRow("Facing", self._direction)
        form.addRow(self.slice, in_row(self.layer, self._height))
        form.addRow(self.bricks)
        form.addRow(self._voxel)
        form.addRow(self._forget)

    def refresh(self) -> None:
        """Follows the document."""
        document = self._document
        volume = None if document.values is None else document.values.decorators.volume
        self.setVisible(volume is not None)
        if volume is not None and document.result is not None:
            self._filling = True
            self._fill(volume, tuple(map(distance_label, document.result.settings.column_distances)))
            self._filling = False

    def _fill(self, volume: TreeVolume, labels: tuple[str, ...]) -> None:
        document, view = self._document, self._document.decorators
        self.bricks.setChecked(view.bricks)
        self.voxels.setCurrentIndex(self.voxels.findData(view.voxels))
        if [self._column.itemText(row) for row in range(self._column.count())] != list(labels):
            self._column.clear()
            self._column.addItems(labels)
        self._column.setCurrentIndex(view.column)
        self._direction.setCurrentIndex(view.direction)
        self._direction.setEnabled(view.voxels is VoxelColor.AO)
        if self._layers_of[0] is not volume or self._layers_of[1] != document.up_axis:
            self._layers, self._layers_of = layers(volume, document.up_axis), (volume, document.up_axis)
            self.layer.setRange(0, max(len(self._layers) - 1, 0))
        is_sliced = view.layer != ALL_LAYERS
        self.slice.setChecked(is_sliced)
        for widget in (self.slice, self.layer):
            widget.setEnabled(view.voxels is not None)
        if is_sliced:
            self.layer.setValue(int(np.searchsorted(self._layers, view.layer)))
        self.layer.setEnabled(is_sliced and view.voxels is not None)
        world = document.world
        lift = float(volume.origin[document.up_axis]) + (
            0.0 if world is None else float(world.origin[document.up_axis])
        )
        self._height.setText(f"{lift + view.layer * volume.spacing:.2f} m" if is_sliced else "")
        filled = int((np.asarray(volume.valid) == 0).sum())
        self._volume_note.setText(
            f"{len(volume.voxel):,} voxels every {volume.spacing:.3g} m, {filled:,} filled; "
            f"{len(volume.brick_voxels):,} bricks; {volume.memory_bytes / 2**20:.1f} MB"
        )
        has_voxel = 0 <= view.voxel < len(volume.voxel) and world is not None
        self._voxel.setVisible(has_voxel or view.voxels is not None)
        self._forget.setVisible(has_voxel)
        if has_voxel and world is not None:
            title = voxel_title(volume, view.voxel, np.asarray(world.origin))
            rows = [
                [text, *(f"{value:.3f}" for value in column)]
                for (text, _), column in zip(DIRECTIONS, voxel_table(volume, view.voxel).T, strict=True)
            ]
            self._voxel.setText(title + small_table(["facing", *(f"at {label}" for label in labels)], rows))
        else:
            self._voxel.setText("Click on a voxel, or on a tree, to see a voxel's harmonics.")

    def _change(self, **changes: object) -> None:
        if not self._filling:
            self._document.set_decorators(self._document.decorators.replaced(**changes))

    def _on_slice(self, on: bool) -> None:
        if not self._filling:
            row = self.layer.value() if self._document.decorators.layer != ALL_LAYERS else len(self._layers) // 2
            self._change(layer=int(self._layers[row]) if on and len(self._layers) else ALL_LAYERS)
