"""Closest hits on the device: Embree on the CPU and Warp's BVH anywhere, behind one signature.

`f(entry, scene, origin, direction, t_min, t_max) -> Hit`; the two handles are addresses that the tracer passes through.
"""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False, "fast_math": False})

vec5d = wp.types.vector(length=5, dtype=wp.float64)  # float64 holds the primitive's number exactly


@wp.struct
class Hit:
    """A closest hit; `primitive` is -1 for a miss.

    `cosine` is that of direction and geometric normal, positive where the back is struck; `weights` belong to corners
    0 and 1.
    """

    distance: wp.float32
    primitive: wp.int32
    cosine: wp.float32
    weights: wp.vec2


# Embree's C interface through the address of rtcIntersect1: the JIT-compiled kernel calls the library directly, so
# that no ray ever exists in an array. The structs are RTCRayHit, RTCRayQueryContext (with room to spare, and our mask
# behind it), RTCFilterFunctionNArguments and RTCIntersectArguments of Embree 4; word 5 of a hit is its primitive.
#
# `scene` leads to seven numbers: an RTCScene, how many primitives it has, a second one or 0, a mask or 0, and for
# `coincident` the primitives' faces, their openness and whether they have two sides. The second scene holds what was
# added since the first was built; its primitives are counted on from those of the first. A primitive whose byte in the
# mask is not 0 is passed over while the structures are walked: what lies behind it, or in the same plane, is found as
# if it had never been there.
_EMBREE = """
    struct alignas(16) RayHit {
        float org[3]; float tnear; float dir[3]; float time; float tfar; unsigned mask; unsigned id; unsigned flags;
        float ng[3]; float u; float v; unsigned prim; unsigned geom; unsigned inst; unsigned inst_prim;
    } r;
    struct Context { unsigned instances[8]; const unsigned char* gone; } context;
    struct Candidate {
        int* valid; void* user; const Context* context; void* ray; const unsigned* hit; unsigned count;
    };
    struct Arguments {
        unsigned flags; unsigned features; void* context; void (*filter)(const Candidate*);
        void* intersect; float width;
    } arguments;
    typedef void (*Intersect)(void*, void*, void*);
    const unsigned long long* held = (const unsigned long long*)scene;
    const unsigned char* gone = (const unsigned char*)held[3];
    void* asked = nullptr;
    if (gone) {
        for (int i = 0; i < 8; ++i) context.instances[i] = 0xffffffffu;
        arguments.flags = 2u;
        arguments.features = 0xffffffffu;
        arguments.context = &context;
        arguments.filter = [](const Candidate* candidate) {
            if (candidate->context->gone[candidate->hit[5]]) candidate->valid[0] = 0;
        };
        arguments.intersect = nullptr;
        arguments.width = 0.0f;
        asked = &arguments;
    }
    r.org[0] = o[0]; r.org[1] = o[1]; r.org[2] = o[2]; r.tnear = t_min;
    r.dir[0] = d[0]; r.dir[1] = d[1]; r.dir[2] = d[2]; r.time = 0.0f; r.tfar = t_max;
    r.mask = 0xffffffffu; r.id = 0; r.flags = 0;
    r.geom = 0xffffffffu; r.inst = 0xffffffffu; r.inst_prim = 0xffffffffu;
    bool struck = false;
    if (held[2]) {
        context.gone = gone + held[1];
        ((Intersect)entry)((void*)held[2], &r, asked);
        struck = r.geom != 0xffffffffu;
        r.prim += (unsigned)held[1];
        r.geom = 0xffffffffu;
    }
    context.gone = gone;
    ((Intersect)entry)((void*)held[0], &r, asked);  // writes what is nearer
    wp::vec_t<5, wp::float64> result;
    if (!struck && r.geom == 0xffffffffu) { result[1] = -1.0; return result; }
    float length = wp::sqrt(r.ng[0] * r.ng[0] + r.ng[1] * r.ng[1] + r.ng[2] * r.ng[2]);
    float along = r.ng[0] * d[0] + r.ng[1] * d[1] + r.ng[2] * d[2];
    result[0] = r.tfar;
    result[1] = r.prim;
    result[2] = length > 0.0f ? along / length : 0.0f;
    result[3] = 1.0f - r.u - r.v;
    result[4] = r.u;
    return result;
"""


@wp.func_native(_EMBREE)
def _embree(
    entry: wp.uint64, scene: wp.uint64, o: wp.vec3, d: wp.vec3, t_min: wp.float32, t_max: wp.float32
) -> vec5d: ...


# Our own walk over Warp's BVH: Warp's query tests boxes without padding, so that rays aimed at a vertex can slip
# between two of them. Widening each far slab by two units in the last place closes the gaps (Ize 2013, "Robust BVH Ray
# Traversal"). It also takes a t_min and leaves the normal to the one hit that is kept. Triangles are tested by Warp's
# watertight routine.
BVH_WALK = """
    using namespace wp;
    const Mesh& mesh = *(const Mesh*)scene;
    const float tiny = 1e-20f;
    const vec3 safe(
        wp::abs(d[0]) < tiny ? (d[0] < 0.0f ? -tiny : tiny) : d[0],
        wp::abs(d[1]) < tiny ? (d[1] < 0.0f ? -tiny : tiny) : d[1],
        wp::abs(d[2]) < tiny ? (d[2] < 0.0f ? -tiny : tiny) : d[2]);
    const vec3 rcp(1.0f / safe[0], 1.0f / safe[1], 1.0f / safe[2]);
    vec_t<5, float64> result;
    result[1] = -1.0;
    float best = t_max;
    float best_u = 0.0f, best_v = 0.0f, best_sign = 0.0f;
    int best_face = -1;
    int stack[64];
    int size = 0;
    stack[size++] = *mesh.bvh.root;
    while (size > 0) {
        const int node = stack[--size];
        const BVHPackedNodeHalf lower = bvh_load_node(mesh.bvh.node_lowers, node);
        const BVHPackedNodeHalf upper = bvh_load_node(mesh.bvh.node_uppers, node);
        if (lower.b) {
            for (int k = lower.i; k < upper.i; ++k) {
                const int face = mesh.bvh.primitive_indices[k];
                const vec3 p = mesh.points[mesh.indices[3 * face]];
                const vec3 q = mesh.points[mesh.indices[3 * face + 1]];
                const vec3 r = mesh.points[mesh.indices[3 * face + 2]];
                float t, u, v, sign;
                if (intersect_ray_tri_woop(o, d, p, q, r, t, u, v, sign, (vec3*)0) && t >= t_min && t <= best) {
                    // Equal distances go to the lower number, whatever the order of the walk.
                    if (t == best && best_face >= 0 && face > best_face) continue;
                    best = t; best_u = u; best_v = v; best_sign = sign; best_face = face;
                }
            }
            continue;
        }
        const int left = lower.i;
        const int right = upper.i;
        float entry_t[2];
        bool struck[2];
        for (int side = 0; side < 2; ++side) {
            const int child = side ? right : left;
            const BVHPackedNodeHalf lo = bvh_load_node(mesh.bvh.node_lowers, child);
            const BVHPackedNodeHalf hi = bvh_load_node(mesh.bvh.node_uppers, child);
            const float x0 = (lo.x - o[0]) * rcp[0], x1 = (hi.x - o[0]) * rcp[0];
            const float y0 = (lo.y - o[1]) * rcp[1], y1 = (hi.y - o[1]) * rcp[1];
            const float z0 = (lo.z - o[2]) * rcp[2], z1 = (hi.z - o[2]) * rcp[2];
            const float near_t = wp::max(wp::max(wp::min(x0, x1), wp::min(y0, y1)), wp::min(z0, z1));
            const float far_t = wp::min(wp::min(wp::max(x0, x1), wp::max(y0, y1)), wp::max(z0, z1));
            // Relative widening alone is no use where both slabs are at distance 0.
            const float reach = far_t * 1.0000004f + 1e-30f;
            entry_t[side] = near_t;
            struck[side] = reach >= t_min && near_t * 0.9999996f <= reach && near_t * 0.9999996f <= best;
        }
        if (struck[0] && struck[1]) {
            const bool left_first = entry_t[0] <= entry_t[1];
            stack[size++] = left_first ? right : left;
            stack[size++] = left_first ? left : right;
        } else if (struck[0]) {
            stack[size++] = left;
        } else if (struck[1]) {
            stack[size++] = right;
        }
    }
    if (best_face < 0) return result;
    const vec3 p = mesh.points[mesh.indices[3 * best_face]];
    const vec3 q = mesh.points[mesh.indices[3 * best_face + 1]];
    const vec3 r = mesh.points[mesh.indices[3 * best_face + 2]];
    const vec3 n = cross(q - p, r - p);
    const float length = wp::sqrt(dot(n, n));
    result[0] = best;
    result[1] = best_face;
    result[2] = length > 0.0f ? dot(n, d) / length : 0.0f;
    result[3] = best_u;
    result[4] = best_v;
    return result;
"""


@wp.func_native(BVH_WALK)
def _bvh(entry: wp.uint64, scene: wp.uint64, o: wp.vec3, d: wp.vec3, t_min: wp.float32, t_max: wp.float32) -> vec5d: ...


@wp.func
def unpack(packed: vec5d) -> Hit:
    """A hit from distance, primitive, cosine and two weights."""
    hit = Hit()
    hit.distance = wp.float32(packed[0])
    hit.primitive = wp.int32(packed[1])
    hit.cosine = wp.float32(packed[2])
    hit.weights = wp.vec2(wp.float32(packed[3]), wp.float32(packed[4]))
    return hit


NUDGE = wp.constant(1.0e-5)


@wp.func
def nudged(direction: wp.vec3) -> wp.vec3:
    """The direction turned by a hundred-thousandth: past rounding, far below what AO can tell."""
    side = wp.where(wp.abs(direction[0]) < 0.5, wp.vec3(1.0, 0.0, 0.0), wp.vec3(0.0, 1.0, 0.0))
    return wp.normalize(direction + NUDGE * wp.normalize(wp.cross(direction, side)))


@wp.func
def embree_closest(
    entry: wp.uint64, scene: wp.uint64, origin: wp.vec3, direction: wp.vec3, t_min: wp.float32, t_max: wp.float32
) -> Hit:
    """Closest hit by Embree; `entry` is the address of rtcIntersect1, `scene` that of seven 64-bit numbers."""
    return unpack(_embree(entry, scene, origin, direction, t_min, t_max))


@wp.func
def bvh_closest(
    entry: wp.uint64, scene: wp.uint64, origin: wp.vec3, direction: wp.vec3, t_min: wp.float32, t_max: wp.float32
) -> Hit:
    """Closest hit in a Warp mesh; `scene` is the mesh's id, `entry` is not used."""
    return unpack(_bvh(entry, scene, origin, direction, t_min, t_max))
