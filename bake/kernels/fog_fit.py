"""Plain rays through many meshes at once: the optical depth of all that each ray crosses."""

from __future__ import annotations

import warp as wp

from bake.kernels.veil import MAX_DEPTH, crossed_depth

wp.set_module_options({"enable_backward": False, "fast_math": False})


@wp.kernel(enable_backward=False)
def crossed(
    mesh: wp.uint64,
    face_depth: wp.array(dtype=wp.float32),
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    length: wp.array(dtype=wp.float32),
    # Never looked at without texture look-up:
    no_numbers: wp.array(dtype=wp.int32),
    no_places: wp.array(dtype=wp.int64),
    no_uvs: wp.array(dtype=wp.vec2),
    # Out:
    depth: wp.array(dtype=wp.float32),
):
    """Sums the depths of the faces within `length` of each origin, clamped."""
    i = wp.tid()
    depth[i] = crossed_depth(
        mesh,
        0,
        face_depth,
        face_depth,
        no_numbers,
        no_uvs,
        no_places,
        no_numbers,
        no_numbers,
        face_depth,
        origins[i],
        directions[i],
        length[i],
        MAX_DEPTH,
    )
