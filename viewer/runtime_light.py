"""The ambient light of a day, and the surface in it: what AO does to the picture while a game runs."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from bake.types import Float64Array
from viewer.colormaps import ColorMap

ALBEDO = 0.5
"""Share of the light that the neutral surface gives back."""

DAY = 24.0
_STOPS = 33

# Linear RGB by hour. Chosen to be told apart at a glance: no measurement of a sky.
_HOURS = (0.0, 4.5, 6.0, 7.5, 10.0, 14.0, 17.0, 18.5, 20.0, 21.5, 24.0)
_LIGHTS = (
    (0.045, 0.075, 0.170),
    (0.050, 0.080, 0.180),
    (0.560, 0.360, 0.420),
    (0.950, 0.800, 0.720),
    (1.350, 1.480, 1.650),
    (1.400, 1.520, 1.700),
    (1.250, 1.180, 1.100),
    (1.000, 0.520, 0.280),
    (0.300, 0.200, 0.340),
    (0.060, 0.090, 0.200),
    (0.045, 0.075, 0.170),
)
_NAMES = ((4.75, "night"), (7.5, "dawn"), (10.5, "morning"), (14.5, "noon"), (17.5, "afternoon"), (20.0, "dusk"))


def ambient_light(hour: float) -> Float64Array:
    """The colour of the ambient light, shape (3,), linear RGB from 0, at an hour of the day (any real number)."""
    lights = np.array(_LIGHTS)
    return np.array([np.interp(hour % DAY, _HOURS, lights[:, channel]) for channel in range(3)])


def name_of_hour(hour: float) -> str:
    """What people call that time of day."""
    return next((name for until, name in _NAMES if hour % DAY < until), "night")


def clock(hour: float) -> str:
    """A time as on a clock: `06:30`."""
    minutes = round((hour % DAY) * 60.0) % (24 * 60)
    return f"{minutes // 60:02d}:{minutes % 60:02d}"


def displayed(linear: Float64Array) -> Float64Array:
    """Linear light as a screen wants it, any shape, in [0, 1] (IEC 61966-2-1); what is brighter is cut off."""
    value = np.clip(linear, 0.0, 1.0)
    return np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1.0 / 2.4) - 0.055)


@lru_cache(maxsize=256)
def ambient_map(hour: float) -> ColorMap:
    """Colours of a neutral surface by its AO, 0 to 1: ambient light × AO × albedo, as the screen shows it.

    Between the stops the map is straight in sRGB; they lie closest where the curve bends most, near black.
    """
    share = np.linspace(0.0, 1.0, _STOPS) ** 1.8
    positions = np.unique(np.round(255.0 * share).astype(int))
    colors = displayed(ALBEDO * ambient_light(hour) * (positions[:, None] / 255.0))
    stops = tuple(
        (int(position), bytes(np.round(255.0 * color).astype(np.uint8).tolist()).hex())
        for position, color in zip(positions, colors, strict=True)
    )
    return ColorMap("ambient", f"Ambient light at {clock(hour)}", stops)
