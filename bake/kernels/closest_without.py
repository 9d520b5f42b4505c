"""Closest hits as if some primitives were not there, over the very structures that the bake traces.

Primitives `first` to `last` - 1, which are those of one object, are passed over while the structure is walked, so that
what lies behind them, or in the same plane, is found as if it had been built without them.
"""

from __future__ import annotations

import warp as wp

from bake.kernels.closest import BVH_WALK, Hit, unpack, vec5d

wp.set_module_options({"enable_backward": False, "fast_math": False})

# Embree asks the filter about every candidate. The structs are RTCRayQueryContext (with room to spare, and our range
# behind it), RTCFilterFunctionNArguments and RTCIntersectArguments of Embree 4; word 5 of a hit is its primitive.
_EMBREE = """
    struct alignas(16) RayHit {
        float org[3]; float tnear; float dir[3]; float time; float tfar; unsigned mask; unsigned id; unsigned flags;
        float ng[3]; float u; float v; unsigned prim; unsigned geom; unsigned inst; unsigned inst_prim;
    } r;
    struct Context { unsigned instances[8]; unsigned first; unsigned last; } context;
    struct Candidate {
        int* valid; void* user; const Context* context; void* ray; const unsigned* hit; unsigned count;
    };
    struct Arguments {
        unsigned flags; unsigned features; void* context; void (*filter)(const Candidate*);
        void* intersect; float width;
    } arguments;
    const unsigned long long* held = (const unsigned long long*)scene;
    for (int i = 0; i < 8; ++i) context.instances[i] = 0xffffffffu;
    context.first = (unsigned)held[1];
    context.last = (unsigned)held[2];
    arguments.flags = 2u;
    arguments.features = 0xffffffffu;
    arguments.context = &context;
    arguments.filter = [](const Candidate* candidate) {
        const unsigned prim = candidate->hit[5];
        if (prim >= candidate->context->first && prim < candidate->context->last) candidate->valid[0] = 0;
    };
    arguments.intersect = nullptr;
    arguments.width = 0.0f;
    r.org[0] = o[0]; r.org[1] = o[1]; r.org[2] = o[2]; r.tnear = t_min;
    r.dir[0] = d[0]; r.dir[1] = d[1]; r.dir[2] = d[2]; r.time = 0.0f; r.tfar = t_max;
    r.mask = 0xffffffffu; r.id = 0; r.flags = 0;
    r.geom = 0xffffffffu; r.inst = 0xffffffffu; r.inst_prim = 0xffffffffu;
    ((void (*)(void*, void*, void*))entry)((void*)held[0], &r, &arguments);
    wp::vec_t<5, wp::float64> result;
    if (r.geom == 0xffffffffu) { result[1] = -1.0; return result; }
    float length = wp::sqrt(r.ng[0] * r.ng[0] + r.ng[1] * r.ng[1] + r.ng[2] * r.ng[2]);
    float along = r.ng[0] * d[0] + r.ng[1] * d[1] + r.ng[2] * d[2];
    result[0] = r.tfar;
    result[1] = r.prim;
    result[2] = length > 0.0f ? along / length : 0.0f;
    result[3] = 1.0f - r.u - r.v;
    result[4] = r.u;
    return result;
"""

_BVH = BVH_WALK.replace(
    "const int face = mesh.bvh.primitive_indices[k];",
    "const int face = mesh.bvh.primitive_indices[k];\n"
    "if (face >= (int)(entry & 0xffffffffu) && face < (int)(entry >> 32)) continue;",
)


@wp.func_native(_EMBREE)
def _embree(
    entry: wp.uint64, scene: wp.uint64, o: wp.vec3, d: wp.vec3, t_min: wp.float32, t_max: wp.float32
) -> vec5d: ...


@wp.func_native(_BVH)
def _bvh(entry: wp.uint64, scene: wp.uint64, o: wp.vec3, d: wp.vec3, t_min: wp.float32, t_max: wp.float32) -> vec5d: ...


@wp.func
def embree_closest_without(
    entry: wp.uint64, scene: wp.uint64, origin: wp.vec3, direction: wp.vec3, t_min: wp.float32, t_max: wp.float32
) -> Hit:
    """As `embree_closest`; `scene` is the address of three 64-bit numbers: the RTCScene, first and last."""
    return unpack(_embree(entry, scene, origin, direction, t_min, t_max))


@wp.func
def bvh_closest_without(
    entry: wp.uint64, scene: wp.uint64, origin: wp.vec3, direction: wp.vec3, t_min: wp.float32, t_max: wp.float32
) -> Hit:
    """As `bvh_closest`; `entry` holds first in its lower and last in its upper half."""
    return unpack(_bvh(entry, scene, origin, direction, t_min, t_max))
