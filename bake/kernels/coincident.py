"""Which of several faces in one place a ray meets: an opaque one, or else that of the lowest number, whatever the tree.

Cards of leaves are often there twice, and some levels have an opaque face where a partly open one is. Only one of the
faces in one place counts, and Embree reports any, by the way its tree is built and walked; a scene with one object more
or less would stop other rays. What it reports is settled only where it is partly open, since an opaque one wins in any
case. Warp's walk breaks ties by itself, by the lowest number alone.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from bake.kernels.closest import Hit, bvh_closest, embree_closest, unpack, vec5d
from bake.kernels.closest_without import bvh_closest_without

wp.set_module_options({"enable_backward": False, "fast_math": False})

# `scene` and the structs are those of `closest`; the scene's last two numbers lead to the face and the openness of each
# primitive. Word 8 of a ray is the candidate's distance. All candidates about a known hit are turned down after a look,
# so that Embree goes on to the next.
_EMBREE = """
    struct alignas(16) RayHit {
        float org[3]; float tnear; float dir[3]; float time; float tfar; unsigned mask; unsigned id; unsigned flags;
        float ng[3]; float u; float v; unsigned prim; unsigned geom; unsigned inst; unsigned inst_prim;
    } r;
    struct Context {
        unsigned instances[8]; const unsigned char* gone; const int* face; const float* open;
        unsigned first; float t; unsigned prim; float ng[3]; float u; float v;
    } context;
    struct Candidate {
        int* valid; void* user; Context* context; const float* ray; const unsigned* hit; unsigned count;
    };
    struct Arguments {
        unsigned flags; unsigned features; void* context; void (*filter)(const Candidate*);
        void* intersect; float width;
    } arguments;
    const unsigned long long* held = (const unsigned long long*)scene;
    for (int i = 0; i < 8; ++i) context.instances[i] = 0xffffffffu;
    context.gone = (const unsigned char*)held[3];
    context.face = (const int*)held[4];
    context.open = (const float*)held[5];
    context.t = 3.4e38f;
    context.prim = 0xffffffffu;
    arguments.flags = 2u;
    arguments.features = 0xffffffffu;
    arguments.context = &context;
    arguments.filter = [](const Candidate* candidate) {
        Context& best = *candidate->context;
        candidate->valid[0] = 0;
        const unsigned prim = candidate->hit[5] + best.first;
        const float t = candidate->ray[8];
        if (best.gone && best.gone[prim]) return;
        if (t > best.t) return;
        if (t == best.t) {
            const bool open = best.open[prim] > 0.0f, best_open = best.open[best.prim] > 0.0f;
            if (open != best_open ? open : best.face[prim] > best.face[best.prim]) return;
        }
        const float* hit = (const float*)candidate->hit;
        best.t = t; best.prim = prim; best.ng[0] = hit[0]; best.ng[1] = hit[1]; best.ng[2] = hit[2];
        best.u = hit[3]; best.v = hit[4];
    };
    arguments.intersect = nullptr;
    arguments.width = 0.0f;
    r.org[0] = o[0]; r.org[1] = o[1]; r.org[2] = o[2]; r.tnear = wp::max(t_min, distance * 0.9999998f);
    r.dir[0] = d[0]; r.dir[1] = d[1]; r.dir[2] = d[2]; r.time = 0.0f; r.tfar = distance * 1.0000002f;
    r.mask = 0xffffffffu; r.id = 0; r.flags = 0;
    r.geom = 0xffffffffu; r.inst = 0xffffffffu; r.inst_prim = 0xffffffffu;
    for (int part = 0; part < 2; ++part) {
        void* tree = (void*)held[part == 0 ? 0 : 2];
        context.first = part == 0 ? 0u : (unsigned)held[1];
        if (tree) ((void (*)(void*, void*, void*))entry)(tree, &r, &arguments);
    }
    wp::vec_t<5, wp::float64> result;
    if (context.prim == 0xffffffffu) { result[1] = -1.0; return result; }
    const float* ng = context.ng;
    float length = wp::sqrt(ng[0] * ng[0] + ng[1] * ng[1] + ng[2] * ng[2]);
    float along = ng[0] * d[0] + ng[1] * d[1] + ng[2] * d[2];
    result[0] = context.t;
    result[1] = context.prim;
    result[2] = length > 0.0f ? along / length : 0.0f;
    result[3] = 1.0f - context.u - context.v;
    result[4] = context.u;
    return result;
"""


@wp.func_native(_EMBREE)
def _embree(
    entry: wp.uint64, scene: wp.uint64, o: wp.vec3, d: wp.vec3, t_min: wp.float32, distance: wp.float32
) -> vec5d: ...


@wp.func
def _settled(
    entry: wp.uint64, scene: wp.uint64, origin: wp.vec3, direction: wp.vec3, t_min: wp.float32, hit: Hit
) -> Hit:
    found = unpack(_embree(entry, scene, origin, direction, t_min, hit.distance))
    if found.primitive < 0:  # the hit is that of a nudged ray
        return hit
    return found


@wp.func
def _as_found(
    entry: wp.uint64, scene: wp.uint64, origin: wp.vec3, direction: wp.vec3, t_min: wp.float32, hit: Hit
) -> Hit:
    return hit


_SETTLED: dict[Any, Any] = {
    embree_closest: _settled,
    bvh_closest: _as_found,
    bvh_closest_without: _as_found,
}


def settler(closest_hit: Any) -> Any:
    """The device function that settles which of the faces at a partly open hit counts, for one of `CLOSEST`'s.

    `f(entry, scene, origin, direction, t_min, hit) -> Hit`, with the `t_min` that the hit was found with.
    """
    return _SETTLED[closest_hit]
