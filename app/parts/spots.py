"""Suspicious spots: found when their table is looked at, stepped through by key, marked in the view."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np

from app.actions import Action, ActionSpec
from app.region_flight import free_eye, looking
from app.spot_table import ListedSpots, SpotTable, listed_spots
from app.window_parts import DockSpec, Part, Side, Workbench
from bake.errors import DeviceError, ObscuraError
from bake.explain.spots import Spots, find_spots
from bake.types import BakeResult
from viewer.fields import distance_label
from viewer.picking import Pick
from viewer.spot_rows import spot_marks, spot_view

PANEL = "Spots"
_LOOKS = "Spots seen"
_MARKS = "spots"
_PIXELS = 6.0
_TOO_NEAR = 0.4

logger = logging.getLogger(__name__)


class SpotsPart(Part):
    """The table of spots and what follows from choosing one.

    Attributes:
        spots: Of the result in view, once they were asked for.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.table = SpotTable()
        self.spots: Spots | None = None
        self._of: BakeResult | None = None
        self._column = 0

    def docks(self) -> Sequence[DockSpec]:
        """The table, below."""
        return [DockSpec(PANEL, self.table, Side.BOTTOM)]

    def actions(self) -> Sequence[Action]:
        """Stepping through the spots."""
        return [
            (_spec("spots", "Find &spots", "List what is suspiciously dark", "F7"), self.show),
            (_spec("spot-next", "Ne&xt spot", "Fly to the next suspicious spot", "F8"), lambda: self._step(1)),
            (
                _spec("spot-previous", "Pre&vious spot", "Fly to the suspicious spot before", "Shift+F8"),
                lambda: self._step(-1),
            ),
        ]

    def connect(self) -> None:
        """Follows the document; looks for spots only while their table is in sight."""
        self.bench.document.result_changed.connect(self._on_result)
        self.bench.docks[PANEL].visibilityChanged.connect(lambda _seen: self._find())
        self.table.distance_chosen.connect(self._on_distance)
        self.table.marks_toggled.connect(lambda _on: self._mark())
        self.table.spot_chosen.connect(self.fly)
        self.table.spot_activated.connect(self._explain)
        self._on_result()

    def show(self) -> None:
        """Brings the table to the front, which finds the spots."""
        self.bench.show_panel(PANEL)
        self._find()

    def fly(self, spot: int) -> None:
        """Selects the spot's object, keeps its vertex as the clicked point and looks at it."""
        world, spots = self.bench.document.world, self.spots
        if world is None or spots is None or not 0 <= spot < len(spots):
            return
        vertex, owner = int(spots.vertex[spot]), int(spots.object[spot])
        first, last = (int(world.first_face[owner + end]) for end in (0, 1))
        faces = np.asarray(world.faces[first:last])
        touching = np.flatnonzero((faces == vertex).any(axis=1))
        point, outward, distance = spot_view(world, spots, spot)
        if len(touching):
            face = int(touching[0])
            weights = tuple(float(corner == vertex) for corner in faces[face])
            pick = Pick(first + face, weights, tuple(point.tolist()), distance)  # type: ignore[arg-type]
            self.bench.readouts.click(pick)
        main = self.bench.area.main
        side = outward + 0.5 * main.camera.up + 0.35 * main.camera.right
        wanted = point + side / float(np.linalg.norm(side)) * distance
        eye = free_eye(self.bench.picker, point + 0.02 * distance * outward, wanted)
        if float(np.linalg.norm(eye - point)) < _TOO_NEAR * distance:
            eye = wanted  # what buries the spot is worth seeing too
        main.navigation.fly_to(looking(main.camera, eye, point))
        self._mark()

    def _explain(self, spot: int) -> None:
        """Flies to a spot and brings what explains the clicked point to the front."""
        self.fly(spot)
        self.bench.registry["explain"].trigger()

    def _step(self, step: int) -> None:
        self.bench.show_panel(PANEL)
        if self.spots is None:
            self._find()
        else:
            self.table.step(step)

    def _on_result(self) -> None:
        result = self.bench.document.result
        self.spots, self._of = None, None
        self._mark()
        for job in (PANEL, _LOOKS):  # what was found in another result means nothing in this one
            self.bench.jobs.drop(job)
        if result is None:
            self.table.set_message("No result.")
            return
        distances = result.settings.column_distances
        self._column = min(self._column, len(distances) - 1)
        self.table.set_distances([distance_label(metres) for metres in distances], self._column)
        self.table.set_message("Not looked for yet.")
        self._find()

    def _on_distance(self, column: int) -> None:
        self._column, self._of = column, None
        self._find()

    def _find(self) -> None:
        result = self.bench.document.result
        if result is None or result is self._of or not self.table.isVisible():
            return
        self._of = result
        self.bench.jobs.drop(_LOOKS)
        self.table.set_message("Looking …")
        distance = result.settings.column_distances[self._column]
        self.bench.jobs.run(
            PANEL, lambda: _listed(result, find_spots(result, distance=distance)), self._on_found, self._on_failed
        )

    def _on_found(self, found: tuple[Spots, ListedSpots]) -> None:
        result = self.bench.document.result
        if result is not None:
            self._set(*found)
            self.bench.jobs.run(
                _LOOKS, lambda: _listed(result, _looked_at(result, found[0])), self._on_looked, self._on_failed
            )

    def _on_looked(self, looked: tuple[Spots, ListedSpots]) -> None:
        if self.table.chosen() < 0:  # rows do not move once somebody works with them
            self._set(*looked)

    def _set(self, spots: Spots, listed: ListedSpots) -> None:
        if self.bench.document.world is not None:
            self.spots = spots
            self.table.set_spots(spots, listed)
            self._mark()

    def _on_failed(self, error: ObscuraError) -> None:
        self.table.set_message("Could not look for spots; see the log.")
        self.bench.banner.show_message(logging.ERROR, str(error))

    def _mark(self) -> None:
        world, spots = self.bench.document.world, self.spots
        chosen, marks = self.table.chosen(), None
        if world is not None and spots is not None and (self.table.marks.isChecked() or chosen >= 0):
            marks = spot_marks(world, spots, chosen, everything=self.table.marks.isChecked())
        for viewport in self.bench.area.viewports:
            viewport.set_points(_MARKS, marks, _PIXELS)


def _listed(result: BakeResult, spots: Spots) -> tuple[Spots, ListedSpots]:
    return spots, listed_spots(spots, result.world.object_paths)


def _looked_at(result: BakeResult, spots: Spots) -> Spots:
    """The spots by what some rays from each of them see; as they are if nothing here can trace."""
    from bake.explain.spot_looks import look_at_spots  # a tracer need not be loaded before anybody asks

    try:
        return look_at_spots(result, spots)
    except DeviceError as error:
        logger.warning("spots are listed without being looked at: %s", error)
        return spots


def _spec(name: str, text: str, tip: str, key: str) -> ActionSpec:
    return ActionSpec(name, "View", text, tip, (key,), group=3, needs=("result",))
