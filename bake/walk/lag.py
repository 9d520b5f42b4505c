"""How long a region that was left still counts."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bake.types import BoolArray, Float64Array, Int32Array, Int64Array
from bake.walk.spatial import Weights
from bake.walk.temporal import blend_in_time

ARRIVED = 0.1
"""A step has arrived when no more than this is left of what was there before."""

_BEFORE_S, _AFTER_S = 1.0, 3.0
_MOST_CROSSINGS = 256


@dataclass(frozen=True, slots=True)
class Leavings:
    """What regions count around the moments at which they are left, shape (window, c) each.

    Attributes:
        tagged: 1 while the character is tagged with the region.
        spatial: The region's weight in the spatial blend.
        before: How many of the window's frames come before the crossing.
    """

    tagged: Float64Array
    spatial: Float64Array
    before: int


def crossings(region: Int32Array, teleported: BoolArray) -> Int64Array:
    """Frames on which the character has a new region without having teleported, shape (c,)."""
    return np.flatnonzero((np.diff(region, prepend=region[:1]) != 0) & ~teleported)


def leavings(region: Int32Array, teleported: BoolArray, weights: Weights, *, frame_rate: float) -> Leavings:
    """Follows the regions that are left; of very many crossings some hundred, evenly chosen.

    Args:
        region: Shape (n,): the region of each frame.
        teleported: Shape (n,).
        weights: Of the spatial blend.
        frame_rate: Hz.
    """
    crossed = crossings(region, teleported)
    if len(crossed) > _MOST_CROSSINGS:
        crossed = crossed[np.linspace(0, len(crossed) - 1, _MOST_CROSSINGS).astype(np.int64)]
    before, after = round(_BEFORE_S * frame_rate), round(_AFTER_S * frame_rate)
    # Beyond its ends, and beyond a teleport, the walk stands still.
    piece = np.cumsum(teleported)
    first = np.searchsorted(piece, piece[crossed], side="left")
    last = np.searchsorted(piece, piece[crossed], side="right") - 1
    frames = np.clip(crossed + np.arange(-before, after + 1)[:, None], first, last)
    left = np.broadcast_to(region[crossed - 1], frames.shape)
    tagged = (region[frames] == left).astype(np.float64)
    count = int(max(weights.region.max(), region.max())) + 1
    rows = np.repeat(np.arange(len(region)), np.diff(weights.first))
    key = rows * count + weights.region  # ascending: rows are sorted by frame and region
    wanted = frames * count + left
    found = np.minimum(np.searchsorted(key, wanted), len(key) - 1)
    return Leavings(tagged, np.where(key[found] == wanted, weights.weight[found], 0.0), before)


def lag(counts: Float64Array, before: int, *, frame_rate: float, half_life: float) -> float:
    """Median seconds from a crossing until the region that was left counts a tenth or less; NaN without crossings.

    Args:
        counts: Shape (window, c), one of the arrays of `Leavings`.
        before: Frames of the window before the crossing.
        frame_rate: Hz.
        half_life: Of the blending in time, s; 0 for none.
    """
    if not counts.shape[1]:
        return math.nan
    begun = np.zeros(len(counts), np.bool_)
    blended = blend_in_time(counts, begun, frame_time=1.0 / frame_rate, half_life=half_life)[before:]
    arrived = blended <= ARRIVED + 1e-9
    frames = np.where(arrived.any(axis=0), arrived.argmax(axis=0), len(blended))
    return float(np.median(frames)) / frame_rate
