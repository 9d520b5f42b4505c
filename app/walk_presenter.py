"""Draws a walk into the viewports: path, pops, picked points, and the figure as it is lit on the frame in view."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from app.region_flight import looking
from app.region_state import Tool
from app.viewport import Shapes, Viewport
from app.walk_state import Follow, WalkState
from bake.types import Float64Array
from bake.walk import Variant
from viewer.colormaps import GREY
from viewer.fields import Scale, distance_label
from viewer.walk_curves import TITLES
from viewer.walk_figure import figure, heading_at
from viewer.walk_light import light_at, lit
from viewer.walk_marks import lit_figure, path_line, picked_marks, pop_marks, pop_scale

_NAMES = ("walk path", "walk pops", "walk points", "walk figure")
_HEADING_S = 0.25  # how far before and after a frame decides which way the figure faces
_BACK, _ABOVE = 3.4, 0.9  # metres of the camera that walks behind
_EASE = 0.12  # share of the way that it turns each frame


class WalkPresenter:
    """Keeps the marks of viewports in step with a walk.

    Args:
        state: What is shown.
        viewports: Where; the camera follows in the first.
        free_eye: The place nearest to a wanted one that is seen from a start without a wall between.
    """

    def __init__(
        self,
        state: WalkState,
        viewports: Callable[[], list[Viewport]],
        free_eye: Callable[[Float64Array, Float64Array], Float64Array],
    ) -> None:
        self._state, self._viewports, self._free_eye = state, viewports, free_eye
        self._figure = figure()
        self._followed: Float64Array | None = None
        self._eye: Float64Array | None = None
        for event in (state.walk_changed, state.view_changed, state.path_changed):
            event.connect(self.draw)
        state.regions.tool_changed.connect(self.draw)
        state.frame_changed.connect(self._on_frame)
        state.playing_changed.connect(self._forget_camera)

    def draw(self) -> None:
        """Draws everything anew."""
        state, path, pops, points = self._state, None, None, None
        if state.view.marks:
            path = path_line(state.path) if state.path is not None else None
            if state.walk is not None and state.pops:
                pops = pop_marks(state.walk, state.pops)
            if state.picked and (state.source == "points" or state.regions.tool is Tool.PATH):
                points = picked_marks(np.array(state.picked))
        for viewport in self._viewports():
            viewport.set_shapes("walk path", path, width=3.0)
            viewport.set_shapes("walk pops", pops, lit=True)
            viewport.set_shapes("walk points", points, lit=True)
            viewport.set_scale("walk pops", pop_scale() if pops is not None else None)
            viewport.set_scale("walk figure", self._figure_scale())
        self._forget_camera()
        self._draw_figure()
        self._move_camera()

    def _figure_scale(self) -> Scale | None:
        """What lights the figure; its distance need not be that of the surface."""
        walk, result = self._state.walk, self._state.regions.document.result
        if walk is None or result is None or not self._state.view.marks:
            return None
        distance = result.settings.column_distances[walk.options.column]
        return Scale("AO of the figure", GREY, note=f"at {distance_label(distance)}, {TITLES[self._lit].lower()}")

    @property
    def _lit(self) -> Variant:
        """The variant that lights the figure: the truth only where it was traced."""
        walk, lit = self._state.walk, self._state.view.lit
        return lit if walk is not None and lit in walk.ao else Variant.BLENDED

    def close(self) -> None:
        """Stops following."""
        self._state.regions.tool_changed.disconnect(self.draw)

    def _on_frame(self) -> None:
        self._draw_figure()
        self._move_camera()

    def _draw_figure(self) -> None:
        shapes = self._lit_figure() if self._state.view.marks else None
        for viewport in self._viewports():
            viewport.set_shapes("walk figure", shapes)

    def _lit_figure(self) -> Shapes | None:
        state = self._state
        walk, course, regions = state.walk, state.course, state.regions.regions
        if walk is None or course is None or regions is None:
            return None
        variant = self._lit
        light = light_at(regions, course, state.frame, variant, walk.options, state.truth)
        place = walk.position[state.frame]
        positions, normals = self._figure.placed(place, self._heading(), np.eye(3)[state.regions.document.up_axis])
        if light is None:
            ao = np.full(len(positions), np.nan, np.float32)  # magenta: the truth is not known here
        else:
            models = regions.fitted if variant is Variant.RAW else regions.regularised
            ao = lit(light, models, walk.options.column, place, positions, normals)
        return lit_figure(self._figure, positions, ao)

    def _heading(self) -> Float64Array:
        walk = self._state.walk
        if walk is None:
            return np.zeros(3)
        return heading_at(walk.position, self._state.frame, max(round(_HEADING_S * walk.options.frame_rate), 1))

    def _forget_camera(self) -> None:
        self._followed = self._eye = None

    def _move_camera(self) -> None:
        state, place = self._state, self._state.place()
        if place is None or state.view.follow is Follow.STAY:
            return
        navigation = self._viewports()[0].navigation
        if state.view.follow is Follow.BESIDE:
            moved = place - self._followed if self._followed is not None else place - np.array(navigation.camera.focal)
            x, y, z = (float(value) for value in np.array(navigation.camera.focal) + moved)
            navigation.set_camera(navigation.camera.aimed((x, y, z), navigation.camera.distance))
        else:
            up = np.eye(3)[state.regions.document.up_axis]
            forward = self._heading()
            forward = forward - (forward @ up) * up
            length = float(np.linalg.norm(forward))
            wanted = place + _ABOVE * up - _BACK * (forward / length if length > 1e-6 else 0.0 * up)
            eye = self._free_eye(place + 0.5 * up, wanted)
            self._eye = eye if self._eye is None else self._eye + _EASE * (eye - self._eye)
            if not state.is_playing:
                self._eye = eye
            navigation.set_camera(looking(navigation.camera, self._eye, place + 0.35 * up))
        self._followed = place
