"""What a device can do at most, beside which the bake's own kernels are held: bare queries, and arithmetic alone."""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False, "fast_math": False})

FLOPS_A_THREAD = 2 * 4 * 4096
"""Floating-point operations of one thread of `multiply_add`: four chains of 4,096 multiply-adds."""


@wp.kernel(enable_backward=False)
def bare_query(
    mesh: wp.uint64,
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    t_max: wp.float32,
    distance: wp.array(dtype=wp.float32),
):
    i = wp.tid()
    query = wp.mesh_query_ray(mesh, origins[i], directions[i], t_max)
    distance[i] = wp.where(query.result, query.t, -1.0)


@wp.kernel(enable_backward=False)
def multiply_add(factor: wp.float32, out: wp.array(dtype=wp.float32)):
    i = wp.tid()
    a = wp.float32(i)
    b = a + 1.0
    c = a + 2.0
    d = a + 3.0
    for _ in range(4096):
        a = a * factor + 0.5
        b = b * factor + 0.5
        c = c * factor + 0.5
        d = d * factor + 0.5
    out[i] = a + b + c + d
