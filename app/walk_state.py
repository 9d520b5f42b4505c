"""The walk in view: its path, how it is walked, what came of it, and the frame that is shown."""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Mapping

import numpy as np

from app.events import Event
from app.region_state import RegionState
from app.walk_task import TracedWalk
from bake.types import BoolArray, Float32Array, Float64Array
from bake.walk import CHOSEN, Course, PathTruth, Pop, Variant, Walk, WalkOptions, WalkPath, path_through


class Follow(enum.StrEnum):
    """What the camera does while the figure walks."""

    STAY = "stay"
    BESIDE = "beside"
    BEHIND = "behind"


@dataclasses.dataclass(frozen=True, slots=True)
class WalkView:
    """What is shown of a walk.

    Attributes:
        variants: Which curves are drawn and whose pops are listed.
        normal: Column of `Walk.ao` in the plot.
        lit: Which variant lights the figure.
        follow: What the camera does.
        rate: How fast it is played: 1 is the walk's own time.
        marks: Whether path, figure and pops are drawn in the view.
    """

    variants: frozenset[Variant] = frozenset(Variant)
    normal: int = CHOSEN
    lit: Variant = Variant.BLENDED
    follow: Follow = Follow.STAY
    rate: float = 1.0
    marks: bool = True


class WalkState:
    """State of one window's walk. Setters emit the event of what they changed, after the change.

    Attributes:
        regions: Those that are walked through.
        path: Where it leads; None without one.
        source: Where the path comes from, for people.
        visited: Regions that a tour visits, shape (r,), bool; None for other paths.
        truth: What was traced along the path.
        options: How it is walked.
        course, walk: What came of it; None while there is nothing.
        steps: How far AO steps to each frame, by variant, the largest over all normals, shape (n,).
        view: What of it is shown.
        frame: The frame that is shown.
        is_playing: Whether it goes on by itself.
        picked: Points picked in the view so far, metres from the world's origin.
    """

    def __init__(self, regions: RegionState) -> None:
        self.regions = regions
        self.path: WalkPath | None = None
        self.source = ""
        self.visited: BoolArray | None = None
        self.truth: PathTruth | None = None
        self.options = WalkOptions()
        self.course: Course | None = None
        self.walk: Walk | None = None
        self.steps: Mapping[Variant, Float32Array] = {}
        self.view = WalkView()
        self.frame = 0
        self.is_playing = False
        self.picked: tuple[tuple[float, float, float], ...] = ()
        self._level: tuple[object, object] = (None, None)

        self.path_changed: Event[[]] = Event()
        self.truth_changed: Event[[]] = Event()
        self.options_changed: Event[[]] = Event()
        self.walk_changed: Event[[]] = Event()
        self.view_changed: Event[[]] = Event()
        self.frame_changed: Event[[]] = Event()
        self.playing_changed: Event[[]] = Event()
        regions.opened.connect(self._on_regions)

    def close(self) -> None:
        """Stops following."""
        self.regions.opened.disconnect(self._on_regions)
        for event in (
            self.path_changed, self.truth_changed, self.options_changed, self.walk_changed, self.view_changed,
            self.frame_changed, self.playing_changed,
        ):  # fmt: skip
            event.clear()

    @property
    def time(self) -> float:
        """Time of the frame that is shown, s."""
        return float(self.walk.time[self.frame]) if self.walk is not None else 0.0

    @property
    def pops(self) -> tuple[Pop, ...]:
        """Pops of the variants that are shown, the worst first."""
        return () if self.walk is None else tuple(pop for pop in self.walk.pops if pop.variant in self.view.variants)

    def set_path(self, path: WalkPath | None, source: str, visited: BoolArray | None = None) -> None:
        """Walks along another path; what was traced along the last one is gone."""
        self.path, self.source, self.visited = path, source, visited
        self.truth, self.course, self.walk = None, None, None
        self.frame = 0
        self.set_playing(False)
        self.path_changed.emit()
        self.walk_changed.emit()

    def take(self, traced: TracedWalk) -> None:
        """Takes over what the engine traced: a tour and perhaps its truth, or the truth of the path in view."""
        if traced.request.path is None:
            self.set_path(traced.path, "tour", traced.visited)
        if self.path is not None and traced.truth is not None and _same(self.path, traced.path):
            self.truth = traced.truth
            self.truth_changed.emit()

    def set_options(self, **changes: object) -> None:
        """Walks in another way; the walk follows by `set_walk`.

        Raises:
            SettingsError: a value is out of its bounds.
        """
        options = dataclasses.replace(self.options, **changes)  # type: ignore[arg-type]
        if options != self.options:
            self.options = options
            self.options_changed.emit()

    def set_walk(self, walk: Walk, course: Course, steps: Mapping[Variant, Float32Array]) -> None:
        """Shows what came of the path; the moment in view stays."""
        moment = self.time
        self.walk, self.course, self.steps = walk, course, steps
        self.frame = int(np.clip(np.searchsorted(walk.time, moment + 1e-9, side="right") - 1, 0, len(walk) - 1))
        self.walk_changed.emit()

    def set_frame(self, frame: int) -> None:
        """Goes to a frame."""
        if self.walk is not None:
            frame = min(max(frame, 0), len(self.walk) - 1)
            if frame != self.frame:
                self.frame = frame
                self.frame_changed.emit()

    def set_playing(self, on: bool) -> None:
        """Plays, or stops; at its end a walk begins again."""
        on = on and self.walk is not None
        if on and self.walk is not None and self.frame >= len(self.walk) - 1:
            self.set_frame(0)
        if on != self.is_playing:
            self.is_playing = on
            self.playing_changed.emit()

    def set_view(self, **changes: object) -> None:
        """Changes what is shown."""
        view = dataclasses.replace(self.view, **changes)  # type: ignore[arg-type]
        if view != self.view:
            self.view = view
            self.view_changed.emit()

    def set_picked(self, points: tuple[tuple[float, float, float], ...]) -> None:
        """Takes the points picked in the view; from the second one on they are the path."""
        self.picked = points
        distinct = len(set(points)) > 1
        self.set_path(path_through(np.array(points)) if distinct else None, "points")

    def go_to_pop(self, step: int) -> Pop | None:
        """Goes to the next pop after the frame in view, or to the last before it; returns it."""
        frames = sorted({pop.frame for pop in self.pops})
        after = [frame for frame in frames if frame > self.frame]
        before = [frame for frame in frames if frame < self.frame]
        wanted = after[:1] if step > 0 else before[-1:]
        if not wanted:
            return None
        self.set_frame(wanted[0])
        return next(pop for pop in self.pops if pop.frame == wanted[0])

    def place(self) -> Float64Array | None:
        """Where the figure is, shape (3,)."""
        return self.walk.position[self.frame] if self.walk is not None else None

    def _on_regions(self) -> None:
        """Another result: a path stays where it is the same level's, what was traced of the last one is gone."""
        document = self.regions.document
        columns = 1 if document.result is None else document.result.settings.distance_count
        self.options = dataclasses.replace(self.options, column=columns - 1)
        origin = None if document.world is None else tuple(document.world.origin.tolist())
        level = (document.scene_path, origin)
        same, self._level = level == self._level and self.regions.regions is not None, level
        if not same:
            self.picked = ()
        self.set_path(self.path if same else None, self.source if same else "", self.visited if same else None)


def _same(a: WalkPath, b: WalkPath) -> bool:
    return a is b or (np.array_equal(a.points, b.points) and np.array_equal(a.piece, b.piece))
