"""Regions as marks over the surface: boxes, links as bars through their centre, grid points, centres of models."""

from __future__ import annotations

import numpy as np

from bake.region_types import GRID, PointState, Regions
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array, UInt8Array
from viewer.colormaps import CIVIDIS
from viewer.fog_view import box_corners, box_edges, box_sides
from viewer.overlays import MOST_POINTS, OverlayPoints
from viewer.region_values import CENTRE_COLORS, POINTS, link_mismatch, link_top, used_models
from viewer.region_view import PointSet, RegionView

Shapes = tuple[Float32Array, Int32Array, UInt8Array]
"""Positions (n, 3), cells and colours (n, 3)."""

VALID_COLOR = (240, 228, 66)
UNREACHABLE_COLOR = (0, 114, 178)
DROPPED_COLOR = (213, 94, 0)
PENDING_COLOR = (0, 158, 115)
PENDING = 3
"""State of a point that was switched on but never traced; above the codes of `PointState`."""
STATE_COLORS = np.array([VALID_COLOR, UNREACHABLE_COLOR, DROPPED_COLOR, PENDING_COLOR], np.uint8)
STATE_WORDS = ("valid", "unreachable", "too many back faces", "on, wait for the bake")
SELECTED_COLOR = (255, 158, 31)

_SHADOW_COLOR = (22, 24, 28)
_THINNEST, _THICKEST = 0.02, 0.2  # metres, half the width of a link's bar
_HALF_WIDTH = 0.03  # of a link, in metres for every metre of the edge of its area


def box_lines(regions: Regions, colors: UInt8Array, chosen: Int64Array | None = None) -> Shapes:
    """Edges of all boxes, or of those chosen; `colors` has a row for each of them."""
    low, high = _bounds(regions, chosen)
    return box_corners(low, high), box_edges(len(low)), np.repeat(colors, 8, axis=0)


def box_faces(regions: Regions, chosen: Int64Array, color: tuple[int, int, int] = SELECTED_COLOR) -> Shapes:
    """Sides of some boxes in one colour."""
    low, high = _bounds(regions, chosen)
    return box_corners(low, high), box_sides(len(low)), _uniform(color, 8 * len(low))


def box_shadows(regions: Regions) -> Shapes:
    """Edges of all boxes in near black: drawn wider below the coloured ones, they part these from a bright surface."""
    return box_lines(regions, _uniform(_SHADOW_COLOR, len(regions.graph)))


def selected_lines(regions: Regions, chosen: Int64Array) -> Shapes:
    """Edges of the selected boxes."""
    return box_lines(regions, _uniform(SELECTED_COLOR, len(chosen)), chosen)


def highlighted(regions: Regions, view: RegionView) -> Int64Array:
    """The selected region, or both regions of the selected boundary."""
    if 0 <= view.link < len(regions.graph.link):
        return np.asarray(regions.graph.link[view.link], np.int64)
    if 0 <= view.region < len(regions.graph):
        return np.array([view.region], np.int64)
    return np.zeros(0, np.int64)


def link_bars(regions: Regions, view: RegionView) -> Shapes:
    """Links as bars from region to region through the middle of their boundary, coloured by mismatch.

    A bar is as thick as its boundary is wide, to scale; the diamond in its middle marks the boundary's centre.
    """
    graph = regions.graph
    a, b = graph.link[:, 0], graph.link[:, 1]
    middle = (graph.minimum + graph.maximum) / 2.0
    half = np.clip(_HALF_WIDTH * np.sqrt(graph.link_area), _THINNEST, _THICKEST)
    starts = np.concatenate([middle[a], graph.link_centre])
    ends = np.concatenate([graph.link_centre, middle[b]])
    colors = CIVIDIS.colors(link_mismatch(regions, view), 0.0, link_top(regions, view))
    chosen = np.arange(len(graph.link)) == view.link
    colors[chosen] = SELECTED_COLOR
    rods = bars(starts, ends, np.tile(half, 2), np.tile(colors, (2, 1)))
    return _joined(rods, diamonds(graph.link_centre, 2.5 * half, colors))


def point_states(regions: Regions, pending: BoolArray | None = None) -> np.ndarray:
    """Index into `STATE_COLORS` of every grid point, shape (r · 512,), int64."""
    states = np.asarray(regions.points.state).astype(np.int64)
    if pending is not None:
        states[pending] = PENDING
    return states


def grid_points(regions: Regions, view: RegionView, pending: BoolArray | None = None) -> OverlayPoints | None:
    """Grid points of the selected region, or of all of them (then thinned where they are too many)."""
    chosen = shown_points(regions, view)
    if chosen is None:
        return None
    total = len(chosen)
    chosen = chosen[:: max(1, -(-total // MOST_POINTS))]
    colors = STATE_COLORS[point_states(regions, pending)[chosen]]
    return OverlayPoints(np.asarray(regions.points.position)[chosen].astype(np.float32), colors, total)


def shown_points(regions: Regions, view: RegionView) -> Int64Array | None:
    """Which grid points a view asks for; None for none."""
    if view.points is PointSet.ALL:
        return np.arange(POINTS * len(regions.graph), dtype=np.int64)
    if view.points is PointSet.SELECTED:
        owners = highlighted(regions, view)
        return (owners[:, None] * POINTS + np.arange(POINTS)).ravel() if len(owners) else None
    return None


def state_swatches(
    regions: Regions, view: RegionView, pending: BoolArray | None = None
) -> tuple[tuple[tuple[int, int, int], str], ...]:
    """Colours and counts of the states among the points that are drawn."""
    chosen = shown_points(regions, view)
    if chosen is None:
        return ()
    counts = np.bincount(point_states(regions, pending)[chosen], minlength=len(STATE_WORDS))
    colors = (VALID_COLOR, UNREACHABLE_COLOR, DROPPED_COLOR, PENDING_COLOR)
    return tuple(
        (color, f"{count:,} {word}") for color, word, count in zip(colors, STATE_WORDS, counts, strict=True) if count
    )


def model_centres(regions: Regions, view: RegionView) -> Shapes:
    """The centre of each model as a diamond, coloured by which one was chosen."""
    models, graph = used_models(regions, view), regions.graph
    size = 0.04 * np.min(graph.maximum - graph.minimum, axis=1)
    kinds = np.asarray(models.centre_kind).astype(np.int64)
    table = np.array(list(CENTRE_COLORS.values()), np.uint8)
    return diamonds(np.asarray(models.centre), np.clip(size, 0.02, 0.2), table[kinds])


def region_at(regions: Regions, point: Float64Array) -> int:
    """The region that a point lies in; -1 for none.

    Of several, one whose nearest grid point is reachable goes before one whose is not, then the smaller one.
    """
    graph = regions.graph
    inside = np.flatnonzero(((point >= graph.minimum) & (point <= graph.maximum)).all(axis=1))
    if not len(inside):
        return -1
    size = np.maximum(graph.maximum[inside] - graph.minimum[inside], 1e-9)
    cell = np.clip((point - graph.minimum[inside]) / size * GRID, 0, GRID - 1).astype(np.int64)
    nearest = inside * POINTS + cell @ np.array([GRID * GRID, GRID, 1])
    closed = np.asarray(regions.points.state)[nearest] == PointState.UNREACHABLE
    return int(inside[np.lexsort((np.prod(size, axis=1), closed))[0]])


def bars(starts: Float64Array, ends: Float64Array, half: Float64Array, colors: UInt8Array) -> Shapes:
    """Square bars between points, shape (n, 3) twice, of half a width and a colour each."""
    along = ends - starts
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along = along / np.where(length > 0.0, length, 1.0)
    helper = np.eye(3)[np.argmin(np.abs(along), axis=1)]
    side = np.cross(along, helper)
    norm = np.linalg.norm(side, axis=1, keepdims=True)
    side = side / np.where(norm > 0.0, norm, 1.0) * half[:, None]
    other = np.cross(along, side)
    around = np.stack([side + other, side - other, -side - other, -side + other], axis=1)
    corners = np.concatenate([starts[:, None] + around, ends[:, None] + around], axis=1).reshape(-1, 3)
    quads = np.array([(i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4) for i in range(4)] + [(3, 2, 1, 0), (4, 5, 6, 7)])
    cells = quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    return corners.astype(np.float32), _for_each(cells, 8, len(starts)), np.repeat(colors, 8, axis=0)


def diamonds(centres: Float64Array, radius: Float64Array, colors: UInt8Array) -> Shapes:
    """Octahedra of a radius and a colour each, shape (n, 3), (n,) and (n, 3)."""
    tips = np.concatenate([np.eye(3), -np.eye(3)])
    positions = (centres[:, None] + radius[:, None, None] * tips).reshape(-1, 3)
    cells = np.array([(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)])
    return positions.astype(np.float32), _for_each(cells, 6, len(centres)), np.repeat(colors, 6, axis=0)


def _bounds(regions: Regions, chosen: Int64Array | None) -> tuple[Float64Array, Float64Array]:
    graph = regions.graph
    return (graph.minimum, graph.maximum) if chosen is None else (graph.minimum[chosen], graph.maximum[chosen])


def _uniform(color: tuple[int, int, int], count: int) -> UInt8Array:
    colors = np.empty((count, 3), np.uint8)
    colors[:] = color
    return colors


def _for_each(cells: np.ndarray, step: int, count: int) -> Int32Array:
    return (cells + step * np.arange(count)[:, None, None]).reshape(-1, cells.shape[1]).astype(np.int32)


def _joined(first: Shapes, second: Shapes) -> Shapes:
    cells = np.concatenate([first[1], second[1] + np.int32(len(first[0]))])
    return np.concatenate([first[0], second[0]]), cells, np.concatenate([first[2], second[2]])
