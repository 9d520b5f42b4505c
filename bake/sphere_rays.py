"""What stages need of a tracer that sends rays in all directions from points; `bake.trace.Tracer` fits.

Stages never import each other, so the pipeline lends them one.
"""

from __future__ import annotations

from typing import Protocol

from bake.arrays import BoolArray, Float32Array, UInt16Array, UInt32Array


class SphereCounts(Protocol):
    """What the rays around some points found; `bake.trace.SphereTally` fits.

    Attributes:
        sh: Shape (n, 9, k), float32: (4π/N) Σ ρ Y over N directions, not convolved.
        hits, back_faces: Shape (n,), uint16, as in `Tally`.
    """

    @property
    def sh(self) -> Float32Array: ...  # noqa: D102
    @property
    def hits(self) -> UInt16Array: ...  # noqa: D102
    @property
    def back_faces(self) -> UInt16Array: ...  # noqa: D102
    def valid(self, threshold: float) -> BoolArray:
        """Which points see at most that share of back faces among their hits, shape (n,)."""
        ...


class SphereTracer(Protocol):
    """Sends rays in all directions from points."""

    def gather_sphere(self, points: Float32Array, seeds: UInt32Array, directions: int) -> SphereCounts:
        """Points, shape (n, 3), are relative to `World.origin`; each seed, shape (n,), scrambles its directions."""
        ...

    def points_at_once(self, directions: int) -> int:
        """Points that a call handles well."""
        ...
