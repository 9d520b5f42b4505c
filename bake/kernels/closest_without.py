"""Closest hits as if some primitives were not there, over the very Warp mesh that the bake traces.

Embree's closest hit takes a mask by itself.
"""

from __future__ import annotations

import warp as wp

from bake.kernels.closest import BVH_WALK, Hit, unpack, vec5d

wp.set_module_options({"enable_backward": False, "fast_math": False})

_BVH = BVH_WALK.replace(
    "const int face = mesh.bvh.primitive_indices[k];",
    "const int face = mesh.bvh.primitive_indices[k];\nif (((const unsigned char*)entry)[face]) continue;",
)


@wp.func_native(_BVH)
def _bvh(entry: wp.uint64, scene: wp.uint64, o: wp.vec3, d: wp.vec3, t_min: wp.float32, t_max: wp.float32) -> vec5d: ...


@wp.func
def bvh_closest_without(
    entry: wp.uint64, scene: wp.uint64, origin: wp.vec3, direction: wp.vec3, t_min: wp.float32, t_max: wp.float32
) -> Hit:
    """As `bvh_closest`; `entry` is the address of a byte per primitive, not 0 where it is to be passed over."""
    return unpack(_bvh(entry, scene, origin, direction, t_min, t_max))
