"""A watch tower in three levels of detail, and its door."""

from __future__ import annotations

import numpy as np

from assets.sample_level.cells import SOLID, Block, surfaces
from assets.sample_level.level import Level, turned
from assets.sample_level.mesh import Part, Points, Solid, faces_where, joined, painted, shaded
from assets.sample_level.shapes import box, warped

PLACE = (-30.0, 1.5, -22.0)
FINEST = "Level/Tower/Tower_LOD0"
RADIUS = 3.0


def add_tower(level: Level) -> None:
    """The tower, its two lower levels of detail at the same place, and a door that stands ajar."""
    level.place("Tower/Tower_LOD0", _tower(32, 0.5, details=True), translation=PLACE)
    coarser = {"obscura": {"role": "lod", "of": FINEST}}
    level.place("Tower/Tower_LOD1", _tower(16, 1.6, details=True), translation=PLACE, extras=coarser)
    level.place("Tower/Tower_LOD2", _tower(8, 8.0, details=False), translation=PLACE)  # its role: in the side file
    door = (shaded(box((0.0, 0.0, -0.04), (1.1, 2.05, 0.04), 0.35, 0.2), "Wood"),)
    hinge = (PLACE[0] + 2.93, PLACE[1] + 0.165, PLACE[2] + 0.5)
    level.place("Tower/Door", door, translation=hinge, rotation=turned(-38.0))


def _tower(segments: int, step: float, *, details: bool) -> tuple[Part, ...]:
    """The tower cut from a block in the space (angle, height, radius); `step` is one segment wide in that space."""
    around = segments * step

    def block(space: str, first: float, last: float, bottom: float, top: float, inner: float, outer: float) -> Block:
        """From `first` to `last` in thirty-seconds of the way round."""
        return Block(space, (first * around / 32, bottom, inner), (last * around / 32, top, outer))

    blocks = [block(SOLID, 0, 32, -0.6, 0.0, 0.0, 3.25), block(SOLID, 0, 32, 0.0, 0.4, 0.0, 3.25)]
    blocks += [block(SOLID, 0, 32, 0.4, 8.0, 0.0, RADIUS), block(SOLID, 0, 32, 7.3, 8.7, 0.0, 3.35)]
    blocks.append(block("Outside", 0, 32, 8.0, 8.7, 0.0, 2.8))
    if details:
        blocks.append(block("Room", 0, 32, 0.15, 3.0, 0.0, 2.3))
        blocks.append(block("Room", 30, 32, 0.15, 2.3, 2.3, 3.25))
        for first in (6, 14, 22):
            blocks.append(block("Outside", first, first + 2, 4.6, 6.0, 2.5, RADIUS))
        for first in range(0, 32, 4):
            blocks.append(block(SOLID, first, first + 2, 8.7, 9.4, 2.8, 3.35))
    found = surfaces(blocks, "Outside", step, step)
    solid = faces_where(joined(*found.values()), lambda c: (c[:, 0] > 1e-6) & (c[:, 0] < around - 1e-6))

    def bent(points: Points) -> Points:
        # The eighth of a turn brings the doorway to face +X, where the house is.
        angle = 2 * np.pi * (points[:, 0] / around + 1 / 32)
        flare = 1.0 + 0.05 * np.clip(1.0 - points[:, 1] / 4.0, 0.0, 1.0) ** 2
        radius = points[:, 2] * np.where(points[:, 2] > 2.9, flare, 1.0)
        return np.stack([radius * np.cos(angle), points[:, 1], -radius * np.sin(angle)], axis=1)

    return painted(_without_underside(warped(solid, bent)), "Rock", "Stone", 0.45, crease=50.0)


def _without_underside(solid: Solid) -> Solid:
    return faces_where(solid, lambda c: c[:, 1] > -0.59)
