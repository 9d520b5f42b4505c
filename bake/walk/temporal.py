"""Blending in time, the same at every frame rate."""

from __future__ import annotations

import numpy as np

from bake.types import BoolArray, Float64Array


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
    from scipy.signal import lfilter

    share = -np.expm1(-np.log(2.0) * frame_time / half_life)
    blended = np.empty_like(values)
    firsts = np.union1d([0], np.flatnonzero(teleported))
    for begin, end in zip(firsts, np.append(firsts[1:], len(values)), strict=True):
        start = (1.0 - share) * values[begin][None]
        blended[begin:end] = lfilter([share], [1.0, share - 1.0], values[begin:end], axis=0, zi=start)[0]
    return blended
