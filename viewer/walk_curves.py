"""Curves of a walk made ready for a picture of so many pixels: what happens between two of them is kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bake.types import Float32Array, Float64Array
from bake.walk import Variant, Walk
from bake.walk.steps import steps

# Colours that stay apart to colour-blind eyes (Okabe and Ito 2002); the truth takes the colour of text.
COLORS: Mapping[Variant, tuple[int, int, int]] = {
    Variant.RAW: (213, 94, 0),
    Variant.REGULARISED: (230, 159, 0),
    Variant.BLENDED: (0, 114, 178),
    Variant.SPATIAL: (0, 158, 115),
    Variant.SPATIAL_BLENDED: (204, 121, 167),
    Variant.TRUTH: (128, 128, 128),
}
TITLES: Mapping[Variant, str] = {
    Variant.RAW: "Raw",
    Variant.REGULARISED: "Regularised",
    Variant.BLENDED: "Blended in time",
    Variant.SPATIAL: "Blended in space",
    Variant.SPATIAL_BLENDED: "In space and time",
    Variant.TRUTH: "Truth",
}


@dataclass(frozen=True, slots=True)
class Curve:
    """Points of a line from left to right, in pieces where it is not known.

    Attributes:
        pieces: Each of shape (p, 2): time and value.
    """

    pieces: tuple[Float64Array, ...]


def ao_curve(walk: Walk, variant: Variant, normal: int, begin: float, end: float, pixels: int) -> Curve:
    """AO about a normal over time, broken at teleports."""
    return _curve(walk, walk.ao[variant][:, normal], begin, end, pixels, broken=walk.teleported)


def largest_steps(walk: Walk, variant: Variant) -> Float32Array:
    """How far AO steps to each frame, the largest over all normals, shape (n,); 0 after teleports."""
    return np.abs(np.nan_to_num(steps(walk.ao[variant], walk.teleported))).max(axis=1).astype(np.float32)


def step_curve(walk: Walk, values: Float32Array, begin: float, end: float, pixels: int) -> Curve:
    """What `largest_steps` gives, as a line."""
    return _curve(walk, values, begin, end, pixels, broken=np.zeros(len(walk), bool))


def ao_range(walk: Walk, variants: frozenset[Variant], normal: int, begin: float, end: float) -> tuple[float, float]:
    """Lowest and highest AO of some variants about a normal in a span of time, with some room.

    At least a tenth apart, within [0, 1].
    """
    part = slice(int(np.searchsorted(walk.time, begin)), int(np.searchsorted(walk.time, end, side="right")))
    low, high = np.inf, -np.inf
    for variant in variants & walk.ao.keys():
        values = walk.ao[variant][part, normal]
        if not len(values):
            continue
        low = min(low, float(np.fmin.reduce(values)))
        high = max(high, float(np.fmax.reduce(values)))
    if not low <= high:
        return 0.0, 1.0
    room = max(0.05 * (high - low), (0.1 - (high - low)) / 2.0, 0.0)
    return max(low - room, 0.0), min(high + room, 1.0)


def frame_at(walk: Walk, time: float) -> int:
    """The frame shown at a time."""
    return int(np.clip(np.searchsorted(walk.time, time + 1e-9, side="right") - 1, 0, len(walk) - 1))


def _curve(walk: Walk, values: np.ndarray, begin: float, end: float, pixels: int, *, broken: np.ndarray) -> Curve:
    first = max(int(np.searchsorted(walk.time, begin, side="left")) - 1, 0)
    last = min(int(np.searchsorted(walk.time, end, side="right")) + 1, len(walk))
    part = slice(first, last)
    time, value = walk.time[part], values[part]
    known = np.isfinite(value)
    starts = np.flatnonzero(known & (broken[part] | ~np.concatenate([[False], known[:-1]])))
    stops = np.append(starts[1:], len(value))
    edges = np.searchsorted(time, begin + (end - begin) / max(pixels, 1) * np.arange(pixels + 1))
    pieces: list[Float64Array] = []
    for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
        unknown = np.flatnonzero(~known[start:stop])
        own = slice(start, start + int(unknown[0]) if len(unknown) else stop)
        pieces.append(_thinned(time[own], value[own], edges - start))
    return Curve(tuple(pieces))


def _thinned(time: Float64Array, value: np.ndarray, edges: np.ndarray) -> Float64Array:
    """The lowest and the highest value in each pixel; everything where frames are wider than pixels.

    Args:
        time, value: Shape (n,).
        edges: Indices at which pixels begin, ascending; those outside do not count.
    """
    count = len(time)
    first = np.unique(np.concatenate([[0], edges[(edges > 0) & (edges < count)]]))
    if len(first) * 2 >= count:
        return np.stack([time, value.astype(np.float64)], axis=1)
    low, high = np.minimum.reduceat(value, first), np.maximum.reduceat(value, first)
    rising = value[first] <= value[np.append(first[1:], count) - 1]
    pairs = np.where(rising[:, None], np.stack([low, high], axis=1), np.stack([high, low], axis=1))
    points = np.stack([np.repeat(time[first], 2), pairs.ravel().astype(np.float64)], axis=1)
    ends = np.array([[time[0], value[0]]]), np.array([[time[-1], value[-1]]])
    return np.concatenate([ends[0], points, ends[1]])
