"""Where the character is on each frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.errors import InputError
from bake.types import BoolArray, Float64Array, Int32Array
from bake.walk.path import piece_at, places
from bake.walk.types import WalkPath

MOST_FRAMES = 2_000_000


@dataclass(frozen=True, slots=True)
class Frames:
    """One row a frame.

    Attributes:
        time: Shape (n,), float64, s.
        distance: Shape (n,), float64: metres walked.
        piece: Shape (n,), int32: piece of the path.
        position: Shape (n, 3), float64, metres relative to `World.origin`.
        teleported: Shape (n,), bool: first frame of a piece.
    """

    time: Float64Array
    distance: Float64Array
    piece: Int32Array
    position: Float64Array
    teleported: BoolArray

    def __len__(self) -> int:
        return len(self.time)


def frames_along(path: WalkPath, *, speed: float, frame_rate: float) -> Frames:
    """Frames of a walk at constant speed, from the path's beginning to the last frame before its end.

    Raises:
        InputError: more frames than anyone could look at.
    """
    count = int(path.length / speed * frame_rate * (1.0 + 1e-12)) + 1
    if count > MOST_FRAMES:
        raise InputError(
            f"{path.length:,.0f} m at {speed:g} m/s and {frame_rate:g} Hz make {count:,} frames",
            where="walk",
            remedy=f"walk faster, at a lower frame rate or not so far: {MOST_FRAMES:,} is the limit",
        )
    time = np.arange(count) / frame_rate
    distance = np.minimum(time * speed, path.length)
    piece = piece_at(path, distance)
    teleported = np.diff(piece, prepend=-1) != 0
    return Frames(time, distance, piece, places(path, distance, piece), teleported)
