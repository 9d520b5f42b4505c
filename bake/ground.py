"""The ground plane that a bake can put under a scene (NVIDIA OptiX Prime baking sample)."""

from __future__ import annotations

import math
import typing
from dataclasses import dataclass

from bake.errors import SettingsError


@dataclass(frozen=True, slots=True)
class Ground:
    """A two-sided quad that blocks but receives nothing, against one side of the scene's bounding box.

    Attributes:
        axis: 0 to 5: +x, -x, +y, -y, +z, -z is the side that faces up, away from the ground
            (the quad lies on the opposite side of the box).
        scale: Its edges in units of the scene's extents.
        offset: Its distance from the box in units of the scene's extent along the axis.
    """

    axis: int = 2
    scale: float = 100.0
    offset: float = 0.03

    AXES: typing.ClassVar[tuple[str, ...]] = ("+x", "-x", "+y", "-y", "+z", "-z")

    @staticmethod
    def parse(text: str) -> Ground:
        """Reads `AXIS[:SCALE[:OFFSET]]`, the axis as 0-5 or as +x, -x, +y, -y, +z, -z."""
        parts = text.split(":")
        try:
            name = parts[0].strip().lower()
            axis = Ground.AXES.index(name) if name in Ground.AXES else int(name)
            scale = float(parts[1]) if len(parts) > 1 else 100.0
            offset = float(parts[2]) if len(parts) > 2 else 0.03
        except ValueError:
            axis, scale, offset = -1, 0.0, 0.0
        if len(parts) > 3 or not 0 <= axis <= 5 or not scale > 0 or not math.isfinite(scale + offset):
            raise SettingsError(
                f"{text!r} is no ground plane",
                where="--ground",
                remedy="write AXIS[:SCALE[:OFFSET]] with AXIS one of +x -x +y -y +z -z and a positive scale",
            )
        return Ground(axis, scale, offset)

    def __str__(self) -> str:
        return f"{self.AXES[self.axis]}:{_exact(self.scale)}:{_exact(self.offset)}"


def _exact(number: float) -> str:
    """The shortest text that reads back as the same number."""
    short = f"{number:g}"
    return short if float(short) == number else repr(number)
