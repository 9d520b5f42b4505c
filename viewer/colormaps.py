"""Colour maps that keep their order in grey and to colour-blind eyes; none of them is a rainbow."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from bake.types import Float32Array, UInt8Array, UInt32Array

INVALID_COLOR = (255, 0, 255)
"""Magenta: the value should exist and does not. No colour map contains it."""
NOT_BAKED_COLOR = (104, 116, 132)
"""Slate: the object receives no per-vertex AO because of its role."""
GEOMETRY_COLOR = (196, 194, 190)
"""Warm grey: geometry that has no values yet."""

_BLOCK = 1 << 15
_MISSING = 256


@dataclass(frozen=True, slots=True)
class ColorMap:
    """A named piecewise-linear colour map.

    Attributes:
        name: Stable name, as stored in settings.
        title: Name for people.
        stops: Pairs of position, 0 to 255 and increasing, and sRGB colour as six hex digits.
        diverging: Its middle means zero.
    """

    name: str
    title: str
    stops: tuple[tuple[int, str], ...]
    diverging: bool = False

    def table(self) -> UInt8Array:
        """All 256 colours, shape (256, 3), uint8; read-only and shared."""
        return _table(self)

    def colors(self, values: Float32Array, low: float, high: float) -> UInt8Array:
        """Colours of values, clamped at the ends of the range.

        Args:
            values: Shape (n,), any unit; NaN becomes `INVALID_COLOR`.
            low, high: The values at the two ends of the map; where they coincide, a step.

        Returns:
            Shape (n, 3), uint8.
        """
        colors = np.empty((len(values), 3), np.uint8)
        table, scale = _packed_table(self), np.float32(255.0 / max(high - low, 1e-12))
        offset = np.float32(low)
        for begin in range(0, len(values), _BLOCK):  # a block stays in the processor's cache from step to step
            part = np.asarray(values[begin : begin + _BLOCK], np.float32)
            level = (part - offset) * scale
            level += 0.5
            np.clip(level, 0.0, 255.0, out=level)
            level[np.isnan(part)] = _MISSING
            packed = table[level.astype(np.uint16)]
            colors[begin : begin + _BLOCK] = packed.view(np.uint8).reshape(-1, 4)[:, :3]
        return colors


@lru_cache(maxsize=32)
def _table(color_map: ColorMap) -> UInt8Array:
    positions = [position for position, _ in color_map.stops]
    colors = np.array([list(bytes.fromhex(color)) for _, color in color_map.stops], np.float64)
    channels = [np.interp(np.arange(256), positions, colors[:, channel]) for channel in range(3)]
    table = np.round(np.stack(channels, axis=1)).astype(np.uint8)
    table.setflags(write=False)
    return table


@lru_cache(maxsize=32)
def _packed_table(color_map: ColorMap) -> UInt32Array:
    """The table and the colour of missing values, four bytes each: picked by number faster than three."""
    table = np.zeros((_MISSING + 1, 4), np.uint8)
    table[:_MISSING, :3] = _table(color_map)
    table[_MISSING, :3] = INVALID_COLOR
    return table.view(np.uint32).ravel()


GREY = ColorMap("grey", "Grey", ((0, "000000"), (255, "ffffff")))

# Cividis (Nuñez, Anderton and Renslow 2018, PLOS ONE 13(7)), linear between stops to within 1.6 of 255.
CIVIDIS = ColorMap(
    "cividis",
    "Cividis",
    (
        (0, "00224e"), (19, "00306f"), (21, "003170"), (23, "013271"), (28, "123570"), (34, "1e3a6f"),
        (52, "36466c"), (84, "565c6d"), (126, "7b7a78"), (147, "8f8a78"), (179, "aea371"), (205, "c9b965"),
        (219, "d9c55c"), (232, "e7d150"), (243, "f3db42"), (251, "fde334"), (255, "fee838"),
    ),
)  # fmt: skip

BLUE_WHITE_ORANGE = ColorMap(
    "blue-white-orange",
    "Blue – white – orange",
    ((0, "0b3c75"), (64, "4a8fc7"), (128, "f4f4f2"), (192, "e8963c"), (255, "8a3a05")),
    diverging=True,
)

# For marks on top of a grey surface: from yellow through orange to dark violet, darker is worse.
WARNING = ColorMap("warning", "Warning", ((0, "ffe14a"), (96, "ff9326"), (176, "e0312f"), (255, "6a0a5c")))

VALUE_MAPS: tuple[ColorMap, ...] = (GREY, CIVIDIS)
"""What the user may choose for values."""


def color_map_named(name: str) -> ColorMap:
    """The map of that name; grey if there is none, as after a downgrade."""
    return next((known for known in (*VALUE_MAPS, BLUE_WHITE_ORANGE, WARNING) if known.name == name), GREY)
