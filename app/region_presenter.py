"""Draws regions into the viewports: boxes, links, points, models and the probe; each only when it changed."""

from __future__ import annotations

from collections.abc import Callable

from app.region_state import RegionState
from app.viewport import Shapes, Viewport
from bake.region_types import Regions
from viewer.colormaps import CIVIDIS, GREY
from viewer.fields import Scale, distance_label
from viewer.overlays import OverlayPoints
from viewer.region_glyph import model_spheres, probe_needle, probe_sphere
from viewer.region_marks import (
    box_faces,
    box_lines,
    box_shadows,
    grid_points,
    highlighted,
    link_bars,
    model_centres,
    selected_lines,
    state_swatches,
)
from viewer.region_values import link_scale, region_colors, region_scale
from viewer.region_view import PointSet, RegionView

POINT_PIXELS, ALL_PIXELS = 6.0, 3.0
MANY = 60
"""Regions from which on their boxes are drawn in fine lines."""
_SHAPES = (
    "shadows", "boxes", "fine boxes", "links", "centres", "chosen edges", "chosen sides", "models", "probe", "needle",
)  # fmt: skip
_IN_FRONT = " in front"


class RegionPresenter:
    """Keeps marks of viewports in step with the regions in view; builds nothing where there are none.

    Args:
        state: What is shown.
        viewports: Where.
    """

    def __init__(self, state: RegionState, viewports: Callable[[], list[Viewport]]) -> None:
        self._state, self._viewports = state, viewports
        self._drawn: dict[str, tuple[object, ...]] = {}
        self._events = (
            state.opened, state.regions_changed, state.view_changed, state.bits_changed, state.document.display_changed,
        )  # fmt: skip
        for event in self._events:
            event.connect(self.draw)
        state.document.world_changed.connect(self.redraw)

    def close(self) -> None:
        """Stops following."""
        for event in self._events:
            event.disconnect(self.draw)
        self._state.document.world_changed.disconnect(self.redraw)

    def redraw(self) -> None:
        """Draws everything anew: the viewports forgot it, or there is a new one."""
        self._drawn.clear()
        self.draw()

    def draw(self) -> None:
        """Draws what changed."""
        regions, view, up = self._state.regions, self._state.view, self._state.document.up_axis
        if regions is None:
            if self._drawn:
                self._clear()
            return
        models, chosen, front = (view.as_fitted, view.column), (view.region, view.link), view.through_walls
        self._step("boxes", (view.boxes, *models, front), lambda: self._draw_boxes(regions, view))
        self._step("chosen", (*chosen, front), lambda: self._draw_chosen(regions, view))
        self._step("links", (view.links, *models, view.link, front), lambda: self._draw_links(regions, view))
        points = (view.points, *(chosen if view.points is PointSet.SELECTED else ()), front)
        self._step("points", points, lambda: self._draw_points(regions, view))
        self._step("centres", (view.centres, *models, front), lambda: self._draw_centres(regions, view))
        self._step("models", (view.models, *models, view.deformed), lambda: self._draw_models(regions, view))
        probe = (view.probe, view.probe_region, view.probe_size, *view.normal(up), view.deformed, *models)
        self._step("probe", probe, lambda: self._draw_probe(regions, view))
        self._step("scales", (view,), lambda: self._draw_scales(regions, view))

    def _step(self, name: str, key: tuple[object, ...], draw: Callable[[], None]) -> None:
        full = (self._state.version, *key)
        if self._drawn.get(name) != full:
            self._drawn[name] = full
            draw()

    def _clear(self) -> None:
        self._drawn.clear()
        for viewport in self._viewports():
            for name in _SHAPES:
                viewport.set_shapes(f"region {name}", None)
                viewport.set_shapes(f"region {name}{_IN_FRONT}", None)
            viewport.set_points("region points", None)
            viewport.set_points(f"region points{_IN_FRONT}", None)
        self._set_scales(None, None, None, None)

    def _draw_boxes(self, regions: Regions, view: RegionView) -> None:
        shapes, shadows = None, None
        if view.boxes is not None:
            shapes = box_lines(regions, region_colors(regions, view, view.boxes, self._state.region_bytes))
            shadows = box_shadows(regions)
        many = len(regions.graph) > MANY  # then lines are fine, lest they hide each other
        self._put("shadows", None if many else shadows, front=view.through_walls, width=2.8)
        self._put("boxes", None if many else shapes, front=view.through_walls, width=1.6)
        self._put("fine boxes", shapes if many else None, front=view.through_walls, width=1.0)

    def _draw_chosen(self, regions: Regions, view: RegionView) -> None:
        chosen = highlighted(regions, view)
        some = len(chosen) > 0
        self._put(
            "chosen edges", selected_lines(regions, chosen) if some else None, front=view.through_walls, width=3.0
        )
        self._put("chosen sides", box_faces(regions, chosen) if some else None, opacity=0.08)

    def _draw_links(self, regions: Regions, view: RegionView) -> None:
        shapes = link_bars(regions, view) if view.links and len(regions.graph.link) else None
        self._put("links", shapes, front=view.through_walls, lit=True)

    def _draw_points(self, regions: Regions, view: RegionView) -> None:
        points: OverlayPoints | None = grid_points(regions, view, self._state.pending)
        size = ALL_PIXELS if view.points is PointSet.ALL else POINT_PIXELS
        for viewport in self._viewports():
            for in_front in (False, True):
                shown = points if in_front is view.through_walls else None
                viewport.set_points(f"region points{_IN_FRONT if in_front else ''}", shown, size, in_front=in_front)

    def _draw_centres(self, regions: Regions, view: RegionView) -> None:
        shapes = model_centres(regions, view) if view.centres else None
        self._put("centres", shapes, front=view.through_walls, lit=True)

    def _draw_models(self, regions: Regions, view: RegionView) -> None:
        self._put("models", model_spheres(regions, view) if view.models else None)

    def _draw_probe(self, regions: Regions, view: RegionView) -> None:
        self._put("probe", probe_sphere(regions, view))
        self._put("needle", probe_needle(regions, view, self._state.document.up_axis), lit=True)

    def _put(
        self,
        name: str,
        shapes: Shapes | None,
        *,
        front: bool = False,
        opacity: float = 1.0,
        width: float = 1.5,
        lit: bool = False,
    ) -> None:
        for viewport in self._viewports():
            for in_front in (False, True):
                viewport.set_shapes(
                    f"region {name}{_IN_FRONT if in_front else ''}",
                    shapes if in_front == front else None,
                    opacity=opacity,
                    width=width,
                    lit=lit,
                    in_front=in_front,
                )

    def _draw_scales(self, regions: Regions, view: RegionView) -> None:
        result = self._state.document.result
        if result is None:
            return
        distance, boxes, links, points, models = result.settings.column_distances[view.column], None, None, None, None
        if view.boxes is not None:
            boxes = region_scale(regions, view, view.boxes, self._state.region_bytes, distance_label(distance))
        if view.links and len(regions.graph.link):
            links = link_scale(regions, view, distance)
        swatches = state_swatches(regions, view, self._state.pending)
        if swatches:
            points = Scale("Grid points", swatches=swatches)
        if view.models or view.probe is not None:
            state = "as fitted" if view.as_fitted else "regularised"
            note = f"at {distance_label(distance)}, {state}"
            models = Scale("AO of the models", CIVIDIS if view.deformed else GREY, note=note)
        self._set_scales(boxes, links, points, models)

    def _set_scales(self, boxes: Scale | None, links: Scale | None, points: Scale | None, models: Scale | None) -> None:
        for viewport in self._viewports():
            viewport.set_scale("region boxes", boxes)
            viewport.set_scale("region links", links)
            viewport.set_scale("region points", points)
            viewport.set_scale("region models", models)
