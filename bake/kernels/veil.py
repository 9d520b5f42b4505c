"""What dims a ray without stopping it: boxes of fog and the leaves of trees, as one optical depth.

Walks of our own, the same on CPU and CUDA: Warp's queries keep their stack in one place, so that two of them in a
kernel overwrite each other, and its box query multiplies zero by infinity on rays along a face.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from bake import geometry
from bake.kernels.leaf_walk import leaf_walk

wp.set_module_options({"enable_backward": False, "fast_math": False})

MAX_DEPTH = wp.constant(geometry.MAX_OPTICAL_DEPTH)


@wp.struct
class Veil:
    """Fog boxes and tree triangles; a kernel made for a scene without one of them never looks at its fields.

    `bounds` and `node` are those of `bake/trace/wide_bvh.py`, `density` is that of the box at each place. `trees` is
    the id of a `wp.Mesh`, `tree_uvs` belong to its points, and the arrays below are per triangle: `tree_depth` is the
    optical depth of a crossing, 0 where the leaf is gone, `tree_transmission` what a closed leaf lets through. Leaves
    that were added since the mesh was built are in a second one, `added`; they are counted from `first_added` on.
    """

    bounds: wp.array(dtype=wp.float32)
    node: wp.array(dtype=wp.int32)
    density: wp.array(dtype=wp.float32)
    trees: wp.uint64
    tree_uvs: wp.array(dtype=wp.vec2)
    added: wp.uint64
    first_added: wp.int32
    tree_depth: wp.array(dtype=wp.float32)
    # Openness maps of leaves; `tree_texture` is empty without look-up at the hit:
    tree_transmission: wp.array(dtype=wp.float32)
    tree_texture: wp.array(dtype=wp.int32)


# Along an axis that the ray does not move on, the tiny positive step puts the origin inside [low, high): two boxes that
# share a face count once for a ray within it, and a box without thickness never counts. No zero ever meets an infinity.
# The loops over eight lanes become vector instructions on the CPU. What they find is gathered by hand there: Clang's
# own way from eight comparisons to a mask, and its ordered sum, take as long as all the rest.
FOG_WALK = """
    using namespace wp;
    const float tiny = 1e-20f;
    const float rx = 1.0f / (wp::abs(d[0]) < tiny ? tiny : d[0]);
    const float ry = 1.0f / (wp::abs(d[1]) < tiny ? tiny : d[1]);
    const float rz = 1.0f / (wp::abs(d[2]) < tiny ? tiny : d[2]);
    const float ox = o[0], oy = o[1], oz = o[2];
    // Where a group keeps the sides that a ray of these signs enters by: low x, y, z at 0, 8, 16, high ones 24 further.
    const int near_x = rx < 0.0f ? 24 : 0, near_y = ry < 0.0f ? 32 : 8, near_z = rz < 0.0f ? 40 : 16;
    float depth = 0.0f;
    int stack[192];
    int size = 0;
    stack[size++] = 0;
    while (size > 0) {
        const int* const at = node.data + 3 * stack[--size];
        const int groups = at[1], first = at[2];
        const float* box = bounds.data + 48 * (int64)at[0];
        for (int g = 0; g < groups; ++g, box += 48) {
            float length[8];
            for (int c = 0; c < 8; ++c) {
                const float x0 = (box[near_x + c] - ox) * rx, x1 = (box[24 - near_x + c] - ox) * rx;
                const float y0 = (box[near_y + c] - oy) * ry, y1 = (box[40 - near_y + c] - oy) * ry;
                const float z0 = (box[near_z + c] - oz) * rz, z1 = (box[56 - near_z + c] - oz) * rz;
                float enter = x0 > y0 ? x0 : y0;
                enter = enter > z0 ? enter : z0;
                enter = enter > 0.0f ? enter : 0.0f;
                float leave = x1 < y1 ? x1 : y1;
                leave = leave < z1 ? leave : z1;
                leave = leave < t_max ? leave : t_max;
                const float inside = leave - enter;
                length[c] = inside > 0.0f ? inside : 0.0f;
            }
            const int here = 8 * g;
#if defined(__CUDA_ARCH__)
            if (first < 0) {
                const float* const held = density.data + (-1 - first) + here;
                float sum = 0.0f;
                for (int c = 0; c < 8; ++c) sum += held[c] * length[c];
                depth += sum;
            } else {
                for (int c = 0; c < 8; ++c) {
                    stack[size] = first + here + c;
                    size += length[c] > 0.0f ? 1 : 0;
                }
            }
#else
            typedef float lanes __attribute__((ext_vector_type(8), aligned(4)));
            typedef bool flags __attribute__((ext_vector_type(8)));
            const lanes crossed = *(const lanes*)length;
            if (first < 0) {
                const lanes part = *(const lanes*)(density.data + (-1 - first) + here) * crossed;
                const auto four = part.lo + part.hi;
                const auto two = four.lo + four.hi;
                depth += two.x + two.y;
            } else {
                const flags met = __builtin_convertvector(crossed > 0.0f, flags);
                unsigned char bits;
                __builtin_memcpy(&bits, &met, 1);
                for (unsigned left = bits; left != 0; left &= left - 1) {
                    stack[size++] = first + here + __builtin_ctz(left);
                }
            }
#endif
        }
        if (depth >= limit) return limit;
    }
    return depth;
"""


@wp.func_native(FOG_WALK)
def _fog_depth(
    bounds: wp.array(dtype=wp.float32),
    node: wp.array(dtype=wp.int32),
    density: wp.array(dtype=wp.float32),
    o: wp.vec3,
    d: wp.vec3,
    t_max: wp.float32,
    limit: wp.float32,
) -> wp.float32: ...


_TREES = leaf_walk("float depth = 0.0f;", "depth += crossing();", "if (depth >= limit) return limit;", value="depth")


@wp.func_native(_TREES)
def crossed_depth(
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
    limit: wp.float32,
) -> wp.float32: ...


@wp.func
def _leaves_depth(
    veil: Veil,
    surface: Any,
    mesh: wp.uint64,
    first: wp.int32,
    uvs: wp.array(dtype=wp.vec2),
    origin: wp.vec3,
    direction: wp.vec3,
    distance: wp.float32,
):
    return crossed_depth(
        mesh,
        first,
        veil.tree_depth,
        veil.tree_transmission,
        veil.tree_texture,
        uvs,
        surface.texture_first,
        surface.texture_width,
        surface.texture_height,
        surface.texels,
        origin,
        direction,
        distance,
        MAX_DEPTH,
    )


def dimmer(fog: bool, trees: bool) -> Any:
    """The device function that says what share of light passes along a ray up to a distance, by fog, trees or both."""

    @wp.func
    def dimmed(veil: Veil, surface: Any, origin: wp.vec3, direction: wp.vec3, distance: wp.float32) -> wp.float32:
        depth = wp.float32(0.0)
        if fog:  # noqa: SIM102  # decided when compiling, the inner one when running
            if veil.node.shape[0] > 0:
                depth += _fog_depth(veil.bounds, veil.node, veil.density, origin, direction, distance, MAX_DEPTH)
        if trees:
            if depth < MAX_DEPTH and veil.trees != wp.uint64(0):
                depth += _leaves_depth(veil, surface, veil.trees, 0, veil.tree_uvs, origin, direction, distance)
            if depth < MAX_DEPTH and veil.added != wp.uint64(0):
                added, first = veil.added, veil.first_added
                depth += _leaves_depth(veil, surface, added, first, surface.uvs, origin, direction, distance)
        return wp.exp(-wp.min(depth, MAX_DEPTH))

    return dimmed
