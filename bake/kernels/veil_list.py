"""The walks of `bake/kernels/veil.py` once more, putting down what they cross instead of adding it up.

Each is run twice: without room (`write` negative) it only counts.
"""

from __future__ import annotations

import warp as wp

from bake import geometry

wp.set_module_options({"enable_backward": False, "fast_math": False})

_LIMIT = float(geometry.MAX_OPTICAL_DEPTH)

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


_LEAVES = """
    using namespace wp;
    const Mesh& mesh = *(const Mesh*)trees;
    const float tiny = 1e-20f;
    const float rx = 1.0f / (wp::abs(d[0]) < tiny ? tiny : d[0]);
    const float ry = 1.0f / (wp::abs(d[1]) < tiny ? tiny : d[1]);
    const float rz = 1.0f / (wp::abs(d[2]) < tiny ? tiny : d[2]);
    int count = 0;
    int stack[64];
    int size = 0;
    stack[size++] = *mesh.bvh.root;
    while (size > 0) {
        const int node = stack[--size];
        const BVHPackedNodeHalf lo = bvh_load_node(mesh.bvh.node_lowers, node);
        const BVHPackedNodeHalf hi = bvh_load_node(mesh.bvh.node_uppers, node);
        const float x0 = (lo.x - o[0]) * rx, x1 = (hi.x - o[0]) * rx;
        const float y0 = (lo.y - o[1]) * ry, y1 = (hi.y - o[1]) * ry;
        const float z0 = (lo.z - o[2]) * rz, z1 = (hi.z - o[2]) * rz;
        const float near_t = wp::max(wp::max(wp::min(x0, x1), wp::min(y0, y1)), wp::max(wp::min(z0, z1), 0.0f));
        const float far_t = wp::min(wp::min(wp::max(x0, x1), wp::max(y0, y1)), wp::min(wp::max(z0, z1), t_max));
        if (near_t * 0.9999996f > far_t * 1.0000004f + 1e-30f) continue;
        if (!lo.b) {
            stack[size++] = lo.i;
            stack[size++] = hi.i;
            continue;
        }
        for (int k = lo.i; k < hi.i; ++k) {
            const int face = mesh.bvh.primitive_indices[k];
            const int i = mesh.indices[3 * face], j = mesh.indices[3 * face + 1], l = mesh.indices[3 * face + 2];
            float t, u, v, sign;
            if (!intersect_ray_tri_woop(o, d, mesh.points[i], mesh.points[j], mesh.points[l], t, u, v, sign, (vec3*)0)
                || t < 0.0f || t > t_max) continue;
            if (write >= 0) {
                float crossing = tree_depth.data[first + face];
                if (tree_texture.shape[0] > 0 && tree_texture.data[first + face] >= 0) {
                    const int texture = tree_texture.data[first + face];
                    const vec2 at = u * uvs.data[i] + v * uvs.data[j] + (1.0f - u - v) * uvs.data[l];
                    const int width = texture_width.data[texture], height = texture_height.data[texture];
                    const int x = wp::min((int)((at[0] - wp::floor(at[0])) * width), width - 1);
                    const int y = wp::min((int)((at[1] - wp::floor(at[1])) * height), height - 1);
                    const float open = texels.data[texture_first.data[texture] + (int64)y * width + x];
                    const float passes = open + (1.0f - open) * tree_transmission.data[first + face];
                    crossing = passes > 0.0f ? wp::min(-wp::log(passes), LIMIT) : LIMIT;
                }
                place.data[write + count] = -1 - first - face;
                depth.data[write + count] = crossing;
            }
            ++count;
        }
    }
    return count;
""".replace("LIMIT", f"{_LIMIT}f")


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
