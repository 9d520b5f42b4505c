"""The walk over the leaves of trees that a ray crosses, as C++ text that device functions are made of.

As the closest-hit walk over Warp's BVH, but every triangle counts and none ends the ray.
"""

from __future__ import annotations

# `trees`, `first`, `o`, `d`, `t_max`, `limit` and the arrays of a `Veil` and a `Surface` are the function's arguments.
_WALK = """
    const Mesh& mesh = *(const Mesh*)trees;
    const float tiny = 1e-20f;
    const float rx = 1.0f / (wp::abs(d[0]) < tiny ? tiny : d[0]);
    const float ry = 1.0f / (wp::abs(d[1]) < tiny ? tiny : d[1]);
    const float rz = 1.0f / (wp::abs(d[2]) < tiny ? tiny : d[2]);
    const float ox = o[0], oy = o[1], oz = o[2];
    int stack[64];
    int size = 0;
    stack[size++] = *mesh.bvh.root;
    while (size > 0) {
        const int node = stack[--size];
        const BVHPackedNodeHalf lo = bvh_load_node(mesh.bvh.node_lowers, node);
        const BVHPackedNodeHalf hi = bvh_load_node(mesh.bvh.node_uppers, node);
        const float x0 = (lo.x - ox) * rx, x1 = (hi.x - ox) * rx;
        const float y0 = (lo.y - oy) * ry, y1 = (hi.y - oy) * ry;
        const float z0 = (lo.z - oz) * rz, z1 = (hi.z - oz) * rz;
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
            const auto crossing = [&]() {
                if (tree_texture.shape[0] == 0 || tree_texture.data[first + face] < 0) {
                    return tree_depth.data[first + face];
                }
                const int texture = tree_texture.data[first + face];
                const vec2 at = u * uvs.data[i] + v * uvs.data[j] + (1.0f - u - v) * uvs.data[l];
                const int width = texture_width.data[texture], height = texture_height.data[texture];
                const int x = wp::min((int)((at[0] - wp::floor(at[0])) * width), width - 1);
                const int y = wp::min((int)((at[1] - wp::floor(at[1])) * height), height - 1);
                const float open = texels.data[texture_first.data[texture] + (int64)y * width + x];
                const float passes = open + (1.0f - open) * tree_transmission.data[first + face];
                return passes > 0.0f ? wp::min(-wp::log(passes), limit) : limit;
            };
            AT_LEAF
        }
        AFTER_NODE
    }
"""


def leaf_walk(before: str, at_leaf: str, after_node: str, value: str) -> str:
    """The body of a native function.

    Args:
        before: Declares what is gathered.
        at_leaf: What to do where the ray crosses triangle `first + face`; `crossing()` is its optical depth, at most
            `limit` where it is looked up in a texture.
        after_node: What to do after the leaves of a node.
        value: What is returned.
    """
    walk = _WALK.replace("AT_LEAF", at_leaf).replace("AFTER_NODE", after_node)
    return f"\n    using namespace wp;\n    {before}{walk}    return {value};\n"
