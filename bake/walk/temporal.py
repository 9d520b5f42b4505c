"""Blending in time, the same at every frame rate."""

from __future__ import annotations

import math

import numpy as np

from bake.types import BoolArray, Float64Array

_LARGEST_POWER = 500.0  # e to it is still far from what float64 cannot hold


def blend_in_time(values: Float64Array, teleported: BoolArray, *, frame_time: float, half_life: float) -> Float64Array:
    """Exponential decay toward each frame's value: y += (x - y) (1 - 2^(-dt / h)).

    Half of a jump is left after each half-life, however many frames that takes. AO is linear in a model's harmonics
    as long as the normal stays, so blending AO about a fixed normal is blending the models.

    Args:
        values: Shape (n, m): x on each frame.
        teleported: Shape (n,): frames that take their value as it is, as the first one does.
        frame_time: dt, s.
        half_life: h, s; 0 blends nothing.

    Returns:
        y, shape (n, m).
    """
    if half_life <= 0.0 or not len(values):
        return values
    decay = math.log(2.0) * frame_time / half_life
    # y_t = q^t (y_0 + (1 - q) Σ q^-s x_s), in parts short enough for q^-s; the largest terms are the latest, so that
    # nothing is lost to rounding.
    size = max(1, int(_LARGEST_POWER / decay))
    blended = np.empty_like(values)
    firsts = np.union1d([0], np.flatnonzero(teleported))
    for first, end in zip(firsts.tolist(), [*firsts[1:].tolist(), len(values)], strict=True):
        blended[first] = values[first]
        for begin in range(first + 1, end, size):
            part = values[begin : min(begin + size, end)]
            grown = np.exp(decay * np.arange(1, len(part) + 1))[:, None]
            summed = np.cumsum(part * grown, axis=0) * -math.expm1(-decay)
            blended[begin : begin + len(part)] = (blended[begin - 1] + summed) / grown
    return blended
