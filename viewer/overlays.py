"""Marks that explain a bake: samples and vertices worth looking at, as points with colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.types import Float32Array, Int64Array, SampleSet, Tally, UInt8Array, VertexField, VertexState, World
from viewer.colormaps import GREY, WARNING

MOST_POINTS = 400_000
"""Points drawn at most; above it every n-th is, and the overlay says so."""

FILLED_COLOR = (0, 176, 240)
UNREFERENCED_COLOR = (255, 0, 255)


@dataclass(frozen=True, slots=True)
class OverlayPoints:
    """Points to draw.

    Attributes:
        positions: Shape (n, 3), float32, metres from the world's origin.
        colors: Shape (n, 3), uint8.
        total: How many there are, of which n are drawn.
    """

    positions: Float32Array
    colors: UInt8Array
    total: int


def sample_positions(world: World, samples: SampleSet, chosen: Int64Array) -> Float32Array:
    """Where samples lie, shape (len(chosen), 3), float32, metres from the world's origin."""
    corners = np.asarray(world.faces)[np.asarray(samples.face)[chosen]]
    first, second = np.asarray(samples.barycentric, np.float64)[chosen].T
    a, b, c = (np.asarray(world.positions)[corners[:, corner]] for corner in range(3))
    points = first[:, None] * a + second[:, None] * b + (1.0 - first - second)[:, None] * c
    return points.astype(np.float32)


def invalid_sample_points(world: World, samples: SampleSet, tally: Tally, threshold: float) -> OverlayPoints:
    """Samples above the threshold, coloured by their back-face share from the threshold to 1."""
    invalid = np.flatnonzero(~tally.valid(threshold))
    chosen = _thinned(invalid)
    share = (tally.back_faces[chosen] / np.maximum(tally.hits[chosen], 1)).astype(np.float32)
    colors = WARNING.colors(share, min(threshold, 0.999), 1.0)
    return OverlayPoints(sample_positions(world, samples, chosen), colors, len(invalid))


def all_sample_points(world: World, samples: SampleSet, tally: Tally, column: int) -> OverlayPoints:
    """Every sample, coloured by its AO at one distance."""
    chosen = _thinned(np.arange(len(samples)))
    colors = GREY.colors(np.asarray(tally.ao)[chosen, column], 0.0, 1.0)
    return OverlayPoints(sample_positions(world, samples, chosen), colors, len(samples))


def vertices_in_state(world: World, field: VertexField, state: VertexState) -> OverlayPoints:
    """Vertices of one state, in the state's colour."""
    found = np.flatnonzero(np.asarray(field.state) == state)
    chosen = _thinned(found)
    color = FILLED_COLOR if state is VertexState.FILLED else UNREFERENCED_COLOR
    colors = np.empty((len(chosen), 3), np.uint8)
    colors[:] = color
    return OverlayPoints(np.asarray(world.positions)[chosen].astype(np.float32), colors, len(found))


def invalid_count(tally: Tally, threshold: float) -> int:
    """Samples whose back-face share is above the threshold."""
    return len(tally) - int(np.count_nonzero(tally.valid(threshold)))


def _thinned(indices: Int64Array) -> Int64Array:
    stride = -(-len(indices) // MOST_POINTS) if len(indices) else 1
    return indices[::stride]
