"""The Walk menu."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from app.actions import Action, ActionSpec
from app.region_state import Tool
from app.walk_state import WalkState

MENU = "Walk"

NEED_PATH = ("walk-truth", "walk-clear")
NEED_WALK = ("walk-play", "walk-back", "walk-on", "walk-next-pop", "walk-last-pop", "walk-start", "walk-csv")
NEED_REGIONS = ("walk-tour", "walk-pick", "walk-file")


def walk_actions(
    state: WalkState,
    *,
    show: Callable[[], object],
    tour: Callable[[], object],
    file: Callable[[], object],
    truth: Callable[[], object],
    unpick: Callable[[], object],
    pop: Callable[[int], object],
    csv: Callable[[], object],
) -> Sequence[Action]:
    """What can be done with a walk by menu and key.

    Args:
        state: The walk.
        show: Shows its panels.
        tour: Asks for a tour.
        file: Asks for a path's file.
        truth: Asks for the truth along the path.
        unpick: Takes the last picked point back.
        pop: Goes to the next (1) or the last (-1) pop.
        csv: Asks where to write the table.
    """

    def spec(
        name: str, text: str, tip: str, keys: tuple[str, ...] = (), *, check: bool = False, group: int = 0
    ) -> ActionSpec:
        return ActionSpec(f"walk-{name}", MENU, text, tip, keys, check, group)

    def step(frames: int) -> None:
        state.set_frame(state.frame + frames)

    return [
        (spec("panel", "&Panels", "Show the panels of the walk", ("Ctrl+W",)), show),
        (spec("tour", "&Tour of the regions", "Walk through all regions that hang together on foot", group=1), tour),
        (
            spec("pick", "Pick &points", "Click on the floor to lay a path", ("Shift+K",), check=True, group=1),
            lambda on: state.regions.use_tool(Tool.PATH, on),
        ),
        (spec("unpick", "Take last point &back", "Remove the last picked point", ("Backspace",), group=1), unpick),
        (spec("file", "Path from &file …", "Open a path in world metres, JSON or CSV", group=1), file),
        (spec("clear", "&Clear", "Start over without a path", group=1), lambda: state.set_picked(())),
        (spec("truth", "Trace the t&ruth", "Trace what the figure should look like along the path", group=2), truth),
        (
            spec("play", "Pla&y or stop", "Let the figure walk, or stop it", ("K",), group=3),
            lambda: state.set_playing(not state.is_playing),
        ),
        (spec("start", "To the &start", "Go to the first frame", ("Ctrl+Home",), group=3), lambda: state.set_frame(0)),
        (
            spec("back", "One frame bac&k", "Go one frame back", (",",), group=3),
            lambda: step(-1),
        ),
        (spec("on", "One frame &on", "Go one frame on", (".",), group=3), lambda: step(1)),
        (spec("next-pop", "&Next pop", "Go to the next pop", ("J",), group=4), lambda: pop(1)),
        (spec("last-pop", "Pre&vious pop", "Go to the pop before", ("Shift+J",), group=4), lambda: pop(-1)),
        (spec("csv", "&Export CSV …", "Write a row a frame", group=5), csv),
    ]
