"""What a hit at a distance counts for, as kernels see it."""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False, "fast_math": False})

MAX_DISTANCES = 8
vec8 = wp.types.vector(length=MAX_DISTANCES, dtype=wp.float32)


@wp.struct
class Falloff:
    """What a hit counts for: ρ(d) = 1 - exp(rate × d) for each of `count` distances; rate 0: ρ = 0."""

    rates: vec8
    count: wp.int32
    t_max: wp.float32
