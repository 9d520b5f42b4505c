"""The digits 1 to 9 as blocks that stand on the ground."""

from __future__ import annotations

from assets.sample_level.cells import SOLID, Block, surfaces
from assets.sample_level.mesh import Part, joined, shaded

HEIGHT = 0.6

# Bars of a seven-segment digit: x0, x1, y0, y1 in units of a bar's thickness.
_BARS = {
    "top": (0, 4, 6, 7),
    "middle": (0, 4, 3, 4),
    "bottom": (0, 4, 0, 1),
    "upper left": (0, 1, 3, 7),
    "upper right": (3, 4, 3, 7),
    "lower left": (0, 1, 0, 4),
    "lower right": (3, 4, 0, 4),
}
_LIT = {
    1: "upper right,lower right",
    2: "top,upper right,middle,lower left,bottom",
    3: "top,upper right,middle,lower right,bottom",
    4: "upper left,middle,upper right,lower right",
    5: "top,upper left,middle,lower right,bottom",
    6: "top,upper left,middle,lower left,lower right,bottom",
    7: "top,upper right,lower right",
    8: "top,upper left,upper right,middle,lower left,lower right,bottom",
    9: "top,upper left,upper right,middle,lower right,bottom",
}


def digit(number: int) -> Part:
    """A digit 0.6 m high, facing +Z, its foot a little below y = 0."""
    bar = HEIGHT / 7
    bars = [_BARS[name] for name in _LIT[number].split(",")]
    blocks = [
        Block(SOLID, ((x0 - 2) * bar, y0 * bar - 0.01, -0.07), ((x1 - 2) * bar, y1 * bar - 0.01, 0.07))
        for x0, x1, y0, y1 in bars
    ]
    return shaded(joined(*surfaces(blocks, "Outside", 0.3, 0.09).values()), "Marker")
