"""A walk in the view: its path, its pops, the points picked for it, and the figure."""

from __future__ import annotations

import numpy as np

from bake.types import Float32Array, Float64Array, Int32Array, UInt8Array
from bake.walk import Pop, Walk, WalkPath
from viewer.colormaps import GREY, WARNING
from viewer.fields import Scale
from viewer.region_marks import SELECTED_COLOR, diamonds
from viewer.walk_figure import Figure

Shapes = tuple[Float32Array, Int32Array, UInt8Array]

PATH_COLOR = (64, 160, 255)
_POP_RADIUS = 0.09
_MOST_CODES = 32.0


def path_line(path: WalkPath) -> Shapes:
    """The path as a line, not drawn where the character teleports."""
    joined = np.flatnonzero(np.diff(path.piece) == 0)
    cells = np.stack([joined, joined + 1], axis=1).astype(np.int32)
    return path.points.astype(np.float32), cells, _uniform(PATH_COLOR, len(path.points))


def pop_marks(walk: Walk, pops: tuple[Pop, ...]) -> Shapes:
    """A diamond where each pop shows, darker the worse it is."""
    places = walk.position[[pop.frame for pop in pops]] if pops else np.zeros((0, 3))
    codes = np.array([pop.codes for pop in pops], np.float32)
    colors = WARNING.colors(np.log2(np.maximum(codes, 1.0)), 0.0, float(np.log2(_MOST_CODES)))
    return diamonds(places, np.full(len(places), _POP_RADIUS), colors)


def pop_scale() -> Scale:
    """What the colours of pops mean."""
    low, middle, high = (tuple(int(c) for c in WARNING.table()[index]) for index in (0, 128, 255))
    swatches = (
        ((low[0], low[1], low[2]), "1 code"),
        ((middle[0], middle[1], middle[2]), f"{_MOST_CODES**0.5:.0f} codes"),
        ((high[0], high[1], high[2]), f"{_MOST_CODES:.0f} codes and more"),
    )
    return Scale("Pops", swatches=swatches)


def picked_marks(points: Float64Array) -> Shapes:
    """Diamonds at picked points."""
    return diamonds(points, np.full(len(points), 0.12), _uniform(SELECTED_COLOR, len(points)))


def lit_figure(figure: Figure, positions: Float64Array, ao: Float32Array) -> Shapes:
    """The figure in the grey of its AO."""
    return positions.astype(np.float32), figure.faces, GREY.colors(ao, 0.0, 1.0)


def _uniform(color: tuple[int, int, int], count: int) -> UInt8Array:
    colors = np.empty((count, 3), np.uint8)
    colors[:] = color
    return colors
