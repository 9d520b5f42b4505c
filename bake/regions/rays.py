"""What this stage asks of a tracer: closest hits of plain rays."""

from __future__ import annotations

from typing import Protocol

from bake.arrays import Float32Array, Int32Array


class NearestHits(Protocol):
    """Closest hits, as a tracer gives them.

    Attributes:
        distance: Shape (n,), float32, metres; inf for a miss.
        face: Shape (n,), int32, index into `World.faces`; -1 for a miss.
        cosine: Shape (n,), float32: of direction and geometric normal; positive where the back is struck.
    """

    @property
    def distance(self) -> Float32Array:
        """Metres to the hit."""
        ...

    @property
    def face(self) -> Int32Array:
        """Which face."""
        ...

    @property
    def cosine(self) -> Float32Array:
        """Which side."""
        ...


class Nearest(Protocol):
    """A tracer's `nearest`, lent by the pipeline: stages do not import each other."""

    def __call__(self, origins: Float32Array, directions: Float32Array, t_max: float, /) -> NearestHits:
        """Closest hits within `t_max` metres of rays, shape (n, 3) each, relative to `World.origin`."""
        ...
