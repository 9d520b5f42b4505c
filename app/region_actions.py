"""The Regions menu."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from app.actions import Action, ActionSpec
from app.region_list import RegionList
from app.region_state import RegionState, Tool
from viewer.region_view import PointSet, RegionColor

MENU = "Regions"

TOGGLES: dict[str, Callable[[RegionState], bool]] = {
    "region-boxes": lambda state: state.view.boxes is not None,
    "region-links": lambda state: state.view.links,
    "region-points": lambda state: state.view.points is not PointSet.NONE,
    "region-centres": lambda state: state.view.centres,
    "region-models": lambda state: state.view.models,
    "region-walls": lambda state: state.view.through_walls,
    "region-fitted": lambda state: state.view.as_fitted,
    "region-place": lambda state: state.tool is Tool.PROBE,
    "region-brush": lambda state: state.tool is Tool.BRUSH,
}
"""Checkable actions, and whether each is on."""

WITHOUT_REGIONS = ("region-bake", "region-panel")
"""Actions that need no regions."""


def region_actions(
    state: RegionState,
    table: RegionList,
    *,
    bake: Callable[[], object],
    panel: Callable[[], object],
    fly: Callable[[], object],
    probe_here: Callable[[], object],
    save: Callable[[], object],
) -> Sequence[Action]:
    """What can be done with regions by menu and key.

    Args:
        state: What is shown.
        table: The list of boundaries and regions.
        bake: Bakes with automatic regions.
        panel: Shows the panel.
        fly: Flies to what is selected.
        probe_here: Puts the probe into the selected region.
        save: Writes the region file.
    """

    def show(**changes: object) -> None:
        state.set_view(state.view.replaced(**changes))

    def boxes(on: bool) -> None:
        show(boxes=RegionColor.ERROR if on else None)

    def points(on: bool) -> None:
        show(points=PointSet.SELECTED if on else PointSet.NONE)

    def swap_brush() -> None:
        state.set_brush(on=not state.brush_on)

    def spec(
        name: str, text: str, tip: str, keys: tuple[str, ...] = (), *, check: bool = False, group: int = 0
    ) -> ActionSpec:
        return ActionSpec(f"region-{name}", MENU, text, tip, keys, check, group)

    return [
        (spec("panel", "&Panel", "Show the panel of the regions", ("Ctrl+R",)), panel),
        (spec("bake", "Bake with &automatic regions", "Find regions in the free space and bake their models"), bake),
        (spec("boxes", "&Boxes", "Draw the boxes of the regions", ("Shift+B",), check=True, group=1), boxes),
        (
            spec("links", "&Links", "Draw which regions touch, by mismatch", ("Shift+L",), check=True, group=1),
            lambda on: show(links=on),
        ),
        (
            spec("points", "&Grid points", "Draw the points of the selected region", ("Shift+G",), check=True, group=1),
            points,
        ),
        (
            spec("centres", "&Centres", "Draw the point about which each model bends", check=True, group=1),
            lambda on: show(centres=on),
        ),
        (
            spec("models", "&Models", "Draw each model as a small sphere", ("Shift+M",), check=True, group=1),
            lambda on: show(models=on),
        ),
        (
            spec(
                "walls",
                "Through &walls",
                "Draw all of these before the surface",
                ("Shift+W",),
                check=True,
                group=1,
            ),
            lambda on: show(through_walls=on),
        ),
        (
            spec("fitted", "As &fitted", "Models and mismatch before regularisation", ("R",), check=True, group=2),
            lambda on: show(as_fitted=on),
        ),
        (
            spec("next", "&Next in the list", "Fly to the next row of the region list", ("]",), group=3),
            lambda: table.select_next(1),
        ),
        (
            spec("previous", "&Previous in the list", "Fly to the row before in the region list", ("[",), group=3),
            lambda: table.select_next(-1),
        ),
        (spec("fly", "&Show selected", "Fly to the selected region or boundary", ("Shift+R",), group=3), fly),
        (
            spec("deselect", "&Deselect", "Let go of the selected region or boundary", group=3),
            lambda: show(region=-1, link=-1),
        ),
        (
            spec("place", "P&lace probe by click", "A click puts the probe there", ("P",), check=True, group=4),
            lambda on: state.use_tool(Tool.PROBE, on),
        ),
        (
            spec(
                "probe",
                "Probe in selected &region",
                "Put the probe into the middle of the selected region",
                ("Shift+P",),
                group=4,
            ),
            probe_here,
        ),
        (
            spec("brush", "&Validity brush", "Drag over points to switch them", ("V",), check=True, group=5),
            lambda on: state.use_tool(Tool.BRUSH, on),
        ),
        (spec("brush-swap", "Brush &switches on / off", "Turn the brush around", ("Shift+X",), group=5), swap_brush),
        (spec("file", "Save region f&ile …", "Write boxes, links and validity as JSON", group=6), save),
    ]
