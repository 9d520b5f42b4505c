"""Shrubs as boxes of fog: which number colours them, and what overlap took from it."""

from __future__ import annotations

import numpy as np

from bake.decorator_types import FogBoxes
from bake.types import Float32Array, Float64Array, Int32Array, UInt8Array
from viewer.colormaps import WARNING
from viewer.decorator_view import FogColor
from viewer.fields import Scale

_EDGES = np.array(
    [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)], np.int32
)
_SIDES = np.array([(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)], np.int32)


def lost_share(fog: FogBoxes) -> Float32Array:
    """Share of the given density that overlap took, shape (b,), in [0, 1]."""
    given = np.asarray(fog.given_density)
    return np.where(given > 0.0, 1.0 - fog.density / np.where(given > 0.0, given, 1.0), 0.0).astype(np.float32)


def fog_values(fog: FogBoxes, color: FogColor) -> Float32Array:
    """What colours the boxes, shape (b,): 1/m, or per cent for what was lost."""
    if color is FogColor.LOST:
        return 100.0 * lost_share(fog)
    return np.asarray(fog.density if color is FogColor.USED else fog.given_density)


def fog_scale(fog: FogBoxes, color: FogColor) -> Scale:
    """What the colours mean; both densities share a range, so that they can be compared."""
    if color is FogColor.LOST:
        return Scale("Fog density lost to overlap", WARNING, 0.0, 100.0, "%")
    most = float(np.asarray(fog.given_density).max(initial=0.0)) or 1.0
    title = "Fog density as traced" if color is FogColor.USED else "Fog density as given"
    return Scale(title, WARNING, 0.0, most, "1/m")


def fog_colors(fog: FogBoxes, color: FogColor) -> UInt8Array:
    """A colour a box, shape (b, 3)."""
    scale = fog_scale(fog, color)
    return WARNING.colors(fog_values(fog, color), scale.low, scale.high)


def box_corners(low: Float32Array | Float64Array, high: Float32Array | Float64Array) -> Float32Array:
    """The eight corners of boxes, shape (b, 3) twice, as (8 b, 3); x runs fastest."""
    bits = np.array([[bit & 1, bit >> 1 & 1, bit >> 2 & 1] for bit in range(8)], bool)
    return np.where(bits, high[:, None, :], low[:, None, :]).reshape(-1, 3).astype(np.float32)


def box_edges(count: int) -> Int32Array:
    """Edges of boxes as pairs of corners, shape (12 count, 2)."""
    return _repeated(_EDGES, count)


def box_sides(count: int) -> Int32Array:
    """Sides of boxes as four corners, shape (6 count, 4)."""
    return _repeated(_SIDES, count)


def _repeated(cells: Int32Array, count: int) -> Int32Array:
    begins = (8 * np.arange(count, dtype=np.int32))[:, None, None]
    return (cells + begins).reshape(-1, cells.shape[1])
