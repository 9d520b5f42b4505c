"""A surface drawn as a display asks for: plain, by colours, or as a game stores its values."""

from __future__ import annotations

from bake.types import Float32Array
from viewer.actors import SurfaceActor
from viewer.colormaps import GEOMETRY_COLOR
from viewer.display import Display
from viewer.fields import SurfaceField

_SHADING = 0.45


def draw_surface(
    surface: SurfaceActor, field: SurfaceField | None, display: Display, relief: Float32Array | None
) -> None:
    """Colours a surface.

    Args:
        surface: What is coloured.
        field: Its values; None for plain geometry.
        display: How.
        relief: Shape (n,), brightness of vertices that have no values because of their role.
    """
    surface.set_edges(display.edges)
    surface.set_back_faces(display.back_faces)
    if field is None:
        surface.set_uniform_color(GEOMETRY_COLOR)
        surface.set_shading(1.0)
        return
    color_map, (low, high) = display.map_for(field), display.range_for(field)
    shaped = display.shading or field.rgb is not None  # categories alone would show no shapes
    surface.set_shading(_SHADING if shaped else 0.0)
    if display.game and not color_map.diverging and not field.inspected:
        surface.set_game_values(field.values, field.not_baked, color_map, low, high, relief)
    else:
        surface.set_colors(field.colors(color_map, low, high, relief))
