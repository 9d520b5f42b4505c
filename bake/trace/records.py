"""Rays on record: what explains a sample, instead of the sums that a bake keeps."""

from __future__ import annotations

from dataclasses import dataclass

from bake.types import BoolArray, Float32Array, Int32Array, Int64Array


@dataclass(frozen=True, slots=True)
class RayRecords:
    """The rays of n samples, r each, as `Tracer.accumulate` sends them.

    Attributes:
        origin: Shape (n, 3), float32, relative to `World.origin`.
        direction: Shape (n, r, 3), float32, unit.
        distance: Shape (n, r), float32, metres: to the face that stopped the ray; the longest distance if none did.
        face: Shape (n, r), int32, index into `World.faces`: the face that stopped it, -1 if none did.
        first_face: Shape (n, r), int32: the first face it met, which may have let it through; -1 if none.
        back: Shape (n, r), bool: the first face counts as struck from behind.
        mirrored: Shape (n, r), bool: it was drawn below the face and mirrored in its plane.
        passes: Shape (n, r), float32: share that fog and trees let through.
        crossed_ray: Shape (c,), int64: flat number of a ray that crosses fog or a leaf.
        crossed_object: Shape (c,), int32: whose.
        crossed_depth: Shape (c,), float32: optical depth of the crossing.
    """

    origin: Float32Array
    direction: Float32Array
    distance: Float32Array
    face: Int32Array
    first_face: Int32Array
    back: BoolArray
    mirrored: BoolArray
    passes: Float32Array
    crossed_ray: Int64Array
    crossed_object: Int32Array
    crossed_depth: Float32Array
