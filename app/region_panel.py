"""The regions' panel: what is shown of them, their models made again live, the probe and the validity brush."""

from __future__ import annotations

from PyQt6.QtCore import pyqtSignal
from PyQt6.QtWidgets import QLabel, QPushButton, QVBoxLayout, QWidget

from app.region_brush_group import RegionBrushGroup
from app.region_model_group import RegionModelGroup
from app.region_probe_group import RegionProbeGroup
from app.region_shown_group import RegionShownGroup
from app.region_state import RegionState

_NO_SCENE = "Open a scene first. Regions are the boxes in which objects move; each has a model of the AO inside it."
_NO_RESULT = (
    "No result yet. Regions are the boxes in which objects move; each has a model of the AO inside it. They are baked "
    "along with the surface."
)
_NO_REGIONS = (
    "This result was baked without regions. They are the boxes in which objects move; each has a model of the AO "
    "inside it, for every point and normal.\n\n"
    "Automatic regions are found in the free space above the floors. Boxes of your own stand in the scene's side file, "
    "or in a JSON file that the bake setting “Regions” names."
)


class RegionPanel(QWidget):
    """Groups over one `RegionState`; says how to bake regions where there are none."""

    bake_asked = pyqtSignal()
    walk_asked = pyqtSignal()

    def __init__(self, state: RegionState, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._state = state
        self._baking = False
        self._none = QLabel()
        self._none.setWordWrap(True)
        self.bake = QPushButton("Bake with automatic regions")
        self.bake.setToolTip("Bake again with the settings of the Bake panel, regions found in the scene's free space")
        self.bake.clicked.connect(self.bake_asked)
        self.shown = RegionShownGroup(state)
        self.models = RegionModelGroup(state)
        self.probe = RegionProbeGroup(state)
        self.validity = RegionBrushGroup(state)
        self.walk = QPushButton("Walk through the regions …")
        self.walk.setToolTip("Let a figure walk through the level, and find where it pops (Ctrl+W)")
        self.walk.clicked.connect(self.walk_asked)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(6, 6, 6, 6)
        layout.setSpacing(6)
        for widget in (self._none, self.bake, self.shown, self.models, self.probe, self.validity, self.walk):
            layout.addWidget(widget)
        layout.addStretch(1)
        for event in (state.opened, state.document.opened, state.document.result_changed):
            event.connect(self.refresh)
        self.refresh()

    def set_baking(self, baking: bool) -> None:
        """While a bake runs no other can be asked for."""
        self._baking = baking
        self.refresh()

    def refresh(self) -> None:
        """Follows the state."""
        document, has = self._state.document, self._state.regions is not None
        for group in (self.shown, self.models, self.probe, self.validity, self.walk):
            group.setVisible(has)
        self._none.setVisible(not has)
        self.bake.setVisible(not has and document.scene_path is not None)
        self.bake.setEnabled(not self._baking)
        if document.scene_path is None:
            self._none.setText(_NO_SCENE)
        else:
            self._none.setText(_NO_RESULT if document.result is None else _NO_REGIONS)
