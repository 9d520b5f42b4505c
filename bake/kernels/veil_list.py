"""The walks of `bake/kernels/veil.py` once more, putting down what they cross instead of adding it up.

Each is run twice: without room (`write` negative) it only counts.
"""

from __future__ import annotations

import warp as wp

from bake import geometry
from bake.kernels.leaf_walk import leaf_walk

wp.set_module_options({"enable_backward": False, "fast_math": False})

_BOXES = """
    using namespace wp;
    const float tiny = 1e-20f;
    const float rx = 1.0f / (wp::abs(d[0]) < tiny ? tiny : d[0]);
    const float ry = 1.0f / (wp::abs(d[1]) < tiny ? tiny : d[1]);
    const float rz = 1.0f / (wp::abs(d[2]) < tiny ? tiny : d[2]);
    const int near_x = rx < 0.0f ? 24 : 0, near_y = ry < 0.0f ? 32 : 8, near_z = rz < 0.0f ? 40 : 16;
    int count = 0;
    int stack[192];
    int size = 0;
    stack[size++] = 0;
    while (size > 0) {
        const int* const at = node.data + 3 * stack[--size];
        const int first = at[2];
        for (int c = 0; c < 8 * at[1]; ++c) {
            const float* box = bounds.data + 48 * ((int64)at[0] + c / 8) + c % 8;
            const float x0 = (box[near_x] - o[0]) * rx, x1 = (box[24 - near_x] - o[0]) * rx;
            const float y0 = (box[near_y] - o[1]) * ry, y1 = (box[40 - near_y] - o[1]) * ry;
            const float z0 = (box[near_z] - o[2]) * rz, z1 = (box[56 - near_z] - o[2]) * rz;
            float enter = x0 > y0 ? x0 : y0;
            enter = enter > z0 ? enter : z0;
            enter = enter > 0.0f ? enter : 0.0f;
            float leave = x1 < y1 ? x1 : y1;
            leave = leave < z1 ? leave : z1;
            leave = leave < t_max ? leave : t_max;
            if (!(leave - enter > 0.0f)) continue;
            if (first >= 0) {
                stack[size++] = first + c;
                continue;
            }
            if (write >= 0) {
                place.data[write + count] = -1 - first + c;
                depth.data[write + count] = density.data[-1 - first + c] * (leave - enter);
            }
            ++count;
        }
    }
    return count;
"""


@wp.func_native(_BOXES)
def list_boxes(
    bounds: wp.array(dtype=wp.float32),
    node: wp.array(dtype=wp.int32),
    density: wp.array(dtype=wp.float32),
    o: wp.vec3,
    d: wp.vec3,
    t_max: wp.float32,
    place: wp.array(dtype=wp.int32),
    depth: wp.array(dtype=wp.float32),
    write: wp.int64,
) -> wp.int32: ...


_LEAVES = leaf_walk(
    f"const float limit = {float(geometry.MAX_OPTICAL_DEPTH)}f;\n    int count = 0;",
    """if (write >= 0) {
                place.data[write + count] = -1 - first - face;
                depth.data[write + count] = crossing();
            }
            ++count;""",
    "",
    value="count",
)


@wp.func_native(_LEAVES)
def list_leaves(
    trees: wp.uint64,
    first: wp.int32,
    tree_depth: wp.array(dtype=wp.float32),
    tree_transmission: wp.array(dtype=wp.float32),
    tree_texture: wp.array(dtype=wp.int32),
    uvs: wp.array(dtype=wp.vec2),
    texture_first: wp.array(dtype=wp.int64),
    texture_width: wp.array(dtype=wp.int32),
    texture_height: wp.array(dtype=wp.int32),
    texels: wp.array(dtype=wp.float32),
    o: wp.vec3,
    d: wp.vec3,
    t_max: wp.float32,
    place: wp.array(dtype=wp.int32),
    depth: wp.array(dtype=wp.float32),
    write: wp.int64,
) -> wp.int32: ...
