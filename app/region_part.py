"""The regions' part of the window: panel, list, marks, tools, and what of it goes into the next bake."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PyQt6.QtCore import QTimer
from PyQt6.QtWidgets import QFileDialog

from app.actions import Action
from app.region_actions import TOGGLES, WITHOUT_REGIONS, region_actions
from app.region_brush import ProbeDrag, RegionBrush, switch
from app.region_flight import fly_to_link, fly_to_region, free_eye, looking
from app.region_list import RegionList
from app.region_live import RegionLive
from app.region_panel import RegionPanel
from app.region_presenter import RegionPresenter
from app.region_state import RegionState, Tool
from app.window_parts import DockSpec, Part, Side, Workbench
from bake.types import Float64Array
from viewer.picking import Pick
from viewer.region_marks import region_at
from viewer.region_view import PointSet

PANEL, LIST = "Regions", "Region list"
_NO_REGIONS = "bake with regions first"


class RegionsPart(Part):
    """Everything about dynamic regions but the walk."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.state = RegionState(bench.document)
        self.panel = RegionPanel(self.state)
        self.table = RegionList(self.state)
        self.live = RegionLive(self.state, bench.jobs, bench.window)
        self.presenter = RegionPresenter(self.state, lambda: bench.area.viewports)

    def docks(self) -> Sequence[DockSpec]:
        """Panel to the right, tables below."""
        return [DockSpec(PANEL, self.panel, Side.RIGHT, scrolled=True), DockSpec(LIST, self.table, Side.BOTTOM)]

    def actions(self) -> Sequence[Action]:
        """The Regions menu."""
        return region_actions(
            self.state,
            self.table,
            bake=self.bake_automatic,
            panel=lambda: self.bench.show_panel(PANEL),
            fly=self.fly,
            probe_here=self.probe_selected,
            save=self.ask_for_file,
        )

    def connect(self) -> None:
        """Joins view, panel, list and models."""
        bench, state, main = self.bench, self.state, self.bench.area.main
        main.navigation.gestures += [RegionBrush(state, main, bench.undo), ProbeDrag(state, main)]
        main.ray_clicked.connect(self._on_click)
        bench.registry["compare"].toggled.connect(lambda _on: QTimer.singleShot(0, self.presenter.redraw))
        bench.registry["cancel"].triggered.connect(lambda: state.set_tool(Tool.NONE))
        bench.controller.baking.connect(self.panel.set_baking)
        self.panel.bake_asked.connect(self.bake_automatic)
        self.panel.models.kept.connect(self.keep_settings)
        self.panel.validity.switch_asked.connect(lambda bits, text: switch(state, bench.undo, bits, text))
        self.panel.validity.save_asked.connect(self.ask_for_file)
        self.table.region_chosen.connect(self._on_region_chosen)
        self.table.link_chosen.connect(self._on_link_chosen)
        self.live.failed.connect(bench.banner.show_message)
        bench.docks[PANEL].visibilityChanged.connect(lambda _shown: self._get_ready())
        state.opened.connect(self._get_ready)
        for event in (state.opened, state.view_changed, state.tool_changed):
            event.connect(self._on_state)
        self._on_state()

    def close(self) -> None:
        """Stops following."""
        self.presenter.close()
        self.state.close()

    # What the user asks for

    def bake_automatic(self) -> None:
        """Bakes again with regions found in the scene's free space."""
        form = self.bench.panels.bake.form
        form.editor("regions").set_value("auto")
        self.bench.panels.bake.refresh()
        self.bench.panels.bake.request_bake()

    def keep_settings(self) -> None:
        """Puts the regularisation in view into the bake's settings."""
        settings, panel = self.state.settings, self.bench.panels.bake
        if settings is None:
            return
        for name in ("region_beta", "region_sweeps", "region_tolerance", "optimise_centre"):
            panel.form.editor(name).set_value(getattr(settings, name))
        panel.refresh()
        self.bench.show_panel("Bake")

    def fly(self) -> None:
        """Flies to the selected boundary or region."""
        regions, view = self.state.regions, self.state.view
        main, picker = self.bench.area.main, self.bench.picker
        if regions is None:
            return
        if 0 <= view.link < len(regions.graph.link):
            fly_to_link(main, picker, regions, view.link)
        elif 0 <= view.region < len(regions.graph):
            fly_to_region(main, picker, regions, view.region)

    def probe_selected(self) -> None:
        """Puts the probe into the selected region, at its seed, which lies in free space, and looks at it."""
        regions, view = self.state.regions, self.state.view
        if regions is None:
            return
        chosen = max(view.region, 0)
        low, high = regions.graph.minimum[chosen], regions.graph.maximum[chosen]
        radius = float(np.clip(0.15 * np.min(high - low), 0.05, 1.0))
        place, main = regions.graph.seed[chosen], self.bench.area.main
        self._set_probe(place, radius)
        eye = free_eye(self.bench.picker, place, place + 6.0 * radius * main.camera.backward)
        main.navigation.fly_to(looking(main.camera, eye, place))

    def ask_for_file(self) -> None:
        """Writes the region file where the user wants it."""
        document = self.state.document
        if self.state.regions is None or document.scene_path is None:
            return
        named = self.bench.panels.bake.settings()
        given = Path(named.regions) if named is not None and named.regions.endswith(".json") else None
        suggestion = given or document.scene_path.with_suffix(".regions.json")
        name, _ = QFileDialog.getSaveFileName(
            self.bench.window, "Save region file", str(suggestion), "Region files (*.json)"
        )
        if name:
            path = Path(name)
            self.save_file(path if path.suffix else path.with_suffix(".json"))

    def save_file(self, path: Path) -> None:
        """Writes boxes, links and validity, and lets the next bake use them."""
        from bake.regions.region_file import write_region_file

        state, world = self.state, self.state.document.world
        regions, bits = state.regions, state.bits
        if regions is None or bits is None or world is None:
            return
        graph, origin = regions.graph, world.origin
        self.bench.jobs.run(
            "region file",
            lambda: write_region_file(path, graph, origin=origin, valid=bits),
            lambda _none: self._on_saved(path),
            lambda error: self.bench.banner.show_message(logging.ERROR, str(error)),
        )

    # What follows from what happened

    def _on_saved(self, path: Path) -> None:
        panel = self.bench.panels.bake
        panel.form.editor("regions").set_value(str(path))
        panel.refresh()
        self.bench.banner.show_message(logging.INFO, f"Regions saved to {path}; the next bake uses them.")

    def _on_state(self) -> None:
        registry, state = self.bench.registry, self.state
        has = state.regions is not None
        for name, is_on in TOGGLES.items():
            registry[name].setChecked(has and is_on(state))
        for name in registry.actions:
            if name.startswith("region-") and name not in WITHOUT_REGIONS:
                registry.enable(name, has, _NO_REGIONS)

    def _get_ready(self) -> None:
        if self.panel.isVisible():
            self.live.get_ready()

    def _on_region_chosen(self, region: int) -> None:
        self.state.set_view(self.state.view.replaced(region=region, link=-1))
        self.fly()

    def _on_link_chosen(self, link: int) -> None:
        self.state.set_view(self.state.view.replaced(link=link, region=-1))
        self.fly()

    def _on_click(self, _origin: Float64Array, direction: Float64Array, pick: Pick | None) -> None:
        """Places the probe, or selects the region before the surface that was clicked."""
        regions, view = self.state.regions, self.state.view
        if regions is None or pick is None:
            return
        before = np.array(pick.position) - 0.02 * direction
        if self.state.tool is Tool.PROBE:
            self._set_probe(np.array(pick.position) - 1.2 * view.probe_size * direction, view.probe_size)
        elif self.state.tool is Tool.NONE and (
            view.boxes is not None or view.links or view.points is PointSet.SELECTED
        ):
            self.state.set_view(view.replaced(region=region_at(regions, before), link=-1))

    def _set_probe(self, place: Float64Array, radius: float) -> None:
        x, y, z = (float(value) for value in place)
        self.state.set_view(self.state.view.replaced(probe=(x, y, z), probe_size=radius))
