"""The walk's part of the window: panels, plot, figure in the view, and what the engine traces for it."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PyQt6.QtCore import Qt, QTimer
from PyQt6.QtWidgets import QFileDialog

from app.actions import Action
from app.region_flight import free_eye, looking
from app.region_part import RegionsPart
from app.region_state import Tool
from app.walk_actions import NEED_PATH, NEED_REGIONS, NEED_WALK, walk_actions
from app.walk_list import WalkList
from app.walk_live import WalkLive
from app.walk_panel import WalkPanel
from app.walk_player import WalkPlayer
from app.walk_presenter import WalkPresenter
from app.walk_state import Follow, WalkState
from app.window_parts import DockSpec, Part, Side, Workbench
from bake.regions.floor_below import HEIGHT
from bake.types import Float64Array
from bake.walk import Pop
from viewer.picking import Pick

PANEL, PLOT = "Walk", "Walk plot"
_PLOT_HEIGHT = 260
_LOOK_FROM = 6.0  # metres from which a pop is looked at


class WalkPart(Part):
    """Everything about the walk. It needs the regions' part, which is made before it."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.regions = bench.part(RegionsPart).state
        self.state = WalkState(self.regions)
        self.panel = WalkPanel(self.state)
        self.list = WalkList(self.state)
        self.live = WalkLive(self.state, bench.engine, bench.jobs, bench.window)
        self.player = WalkPlayer(self.state, bench.window)
        self.presenter = WalkPresenter(
            self.state, lambda: bench.area.viewports, lambda start, wanted: free_eye(bench.picker, start, wanted)
        )

    def docks(self) -> Sequence[DockSpec]:
        """Panel to the right, plot and pops below; both stay away until they are asked for."""
        return [
            DockSpec(PANEL, self.panel, Side.RIGHT, scrolled=True, shown=False),
            DockSpec(PLOT, self.list, Side.BOTTOM, shown=False),
        ]

    def actions(self) -> Sequence[Action]:
        """The Walk menu."""
        return walk_actions(
            self.state,
            show=self.show,
            tour=self.tour,
            file=self.ask_for_path,
            truth=self.trace_truth,
            unpick=self.unpick,
            pop=self.go_to_pop,
            csv=self.ask_for_csv,
        )

    def connect(self) -> None:
        """Joins panels, view, engine and walk."""
        bench, state, panel = self.bench, self.state, self.panel
        bench.area.main.ray_clicked.connect(self._on_click)
        bench.registry["compare"].toggled.connect(lambda _on: QTimer.singleShot(0, self.presenter.draw))
        panel.path.tour_asked.connect(self.tour)
        panel.path.file_asked.connect(self.ask_for_path)
        panel.path.truth_asked.connect(self.trace_truth)
        panel.path.cancel_asked.connect(self.live.cancel)
        panel.csv_asked.connect(self.ask_for_csv)
        panel.plot_asked.connect(lambda: bench.show_panel(PLOT))
        self.live.tracing.connect(panel.path.set_tracing)
        self.live.progressed.connect(panel.path.set_progress)
        self.live.failed.connect(bench.banner.show_message)
        self.list.pop_chosen.connect(self.show_pop)
        bench.part(RegionsPart).panel.walk_asked.connect(self.show)
        # The needle of the probe is the normal that the walk looks at besides the axes.
        for event in (self.regions.view_changed, bench.document.display_changed):
            event.connect(self._take_needle)
        for event in (state.path_changed, state.walk_changed):
            event.connect(self._enable)
        for event in (self.regions.opened, self.regions.tool_changed):
            event.connect(self._enable)
        self._take_needle()
        self._enable()

    def close(self) -> None:
        """Stops the clock and follows no longer."""
        self.player.stop()
        self.presenter.close()
        self.state.close()

    # What the user asks for

    def show(self) -> None:
        """Brings the panels of the walk to the front."""
        self.bench.show_panel(PANEL)
        self.bench.show_panel(PLOT)
        dock = self.bench.docks[PLOT]
        if dock.height() < _PLOT_HEIGHT:
            self.bench.window.resizeDocks([dock], [_PLOT_HEIGHT], Qt.Orientation.Vertical)

    def tour(self) -> None:
        """Asks for a tour of the regions."""
        self.show()
        self.live.trace(None, with_truth=self.panel.path.with_truth.isChecked())

    def trace_truth(self) -> None:
        """Asks for the truth along the path in view."""
        if self.state.path is not None:
            self.live.trace(self.state.path, with_truth=True)

    def unpick(self) -> None:
        """Takes the last picked point back."""
        if self.state.picked:
            self.state.set_picked(self.state.picked[:-1])

    def go_to_pop(self, step: int) -> None:
        """Goes to the next or the last pop, shows its boundary and looks at it."""
        pop = self.state.go_to_pop(step)
        if pop is not None:
            self.show_pop(pop)

    def show_pop(self, pop: Pop) -> None:
        """Goes to a pop and shows its boundary."""
        self.state.set_playing(False)
        self.state.set_frame(pop.frame)
        self._highlight(pop)
        place = self.state.place()
        if place is not None and self.state.view.follow is Follow.STAY:
            main, up = self.bench.area.main, np.eye(3)[self.bench.document.up_axis]
            back = main.camera.backward * _LOOK_FROM
            eye = free_eye(self.bench.picker, place, place + back + 0.3 * up)
            main.navigation.fly_to(looking(main.camera, eye, place))

    def ask_for_path(self) -> None:
        """Opens a path."""
        name, _ = QFileDialog.getOpenFileName(
            self.bench.window, "Open path", str(self._folder()), "Paths (*.json *.csv);;All files (*)"
        )
        if name:
            self.show()
            self.live.read_file(Path(name))

    def ask_for_csv(self) -> None:
        """Writes the table where the user wants it."""
        name, _ = QFileDialog.getSaveFileName(
            self.bench.window, "Export walk", str(self._folder() / "walk.csv"), "Tables (*.csv)"
        )
        if name:
            path = Path(name)
            self.export_csv(path if path.suffix else path.with_suffix(".csv"))

    def export_csv(self, path: Path) -> None:
        """Writes a row a frame."""
        from bake.walk.table import write_csv

        walk, regions, world = self.state.walk, self.regions.regions, self.bench.document.world
        if walk is None or regions is None or world is None:
            return
        names, origin, banner = regions.graph.names, world.origin, self.bench.banner
        self.bench.jobs.run(
            "walk table",
            lambda: write_csv(path, walk, names, origin=origin),
            lambda _none: banner.show_message(logging.INFO, f"{len(walk):,} frames written to {path}"),
            lambda error: banner.show_message(logging.ERROR, str(error)),
        )

    # What follows from what happened

    def _on_click(self, _origin: Float64Array, _direction: Float64Array, pick: Pick | None) -> None:
        if self.regions.tool is Tool.PATH and pick is not None:
            x, y, z = (float(v) for v in np.array(pick.position) + HEIGHT * np.eye(3)[self.bench.document.up_axis])
            self.state.set_picked((*self.state.picked, (x, y, z)))

    def _take_needle(self) -> None:
        self.state.set_options(normal=self.regions.view.normal(self.bench.document.up_axis))

    def _highlight(self, pop: Pop) -> None:
        """Selects the boundary of a pop, or the region that it is inside of."""
        regions = self.regions.regions
        if regions is None:
            return
        ends = {pop.before, pop.after}
        links = [row for row, link in enumerate(regions.graph.link.tolist()) if set(link) == ends]
        region = pop.after if not links else -1
        self.regions.set_view(self.regions.view.replaced(link=links[0] if links else -1, region=region))

    def _enable(self) -> None:
        registry, state = self.bench.registry, self.state
        registry["walk-pick"].setChecked(self.regions.tool is Tool.PATH)
        has = self.regions.regions is not None
        for name in NEED_REGIONS:
            registry.enable(name, has, "bake with regions first")
        for name in NEED_PATH:
            registry.enable(name, state.path is not None, "lay a path first")
        for name in NEED_WALK:
            registry.enable(name, state.walk is not None, "lay a path first")
        registry.enable("walk-unpick", bool(state.picked), "no points are picked")

    def _folder(self) -> Path:
        path = self.bench.document.result_path
        return path.parent if path is not None else Path.home()
