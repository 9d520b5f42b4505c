"""Which of several faces in one place a ray meets, whatever the tree.

Cards of leaves are often there twice, walls may be two faces back to back, and some levels have an opaque face where a
partly open one is. Only one of the faces in one place counts, and Embree reports any, by the way its tree is built and
walked; a scene with one object more or less would stop other rays, or take other samples for buried. An opaque face
wins, then one that does not prove that the ray came from behind, then that of the lowest number. So what Embree reports
is settled only where it is partly open or struck from behind. Warp's walk breaks ties by itself, by the lowest number
alone.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from bake import geometry
from bake.kernels.closest import Hit, bvh_closest, embree_closest, unpack, vec5d
from bake.kernels.closest_without import bvh_closest_without

wp.set_module_options({"enable_backward": False, "fast_math": False})

# `scene` and the structs are those of `closest`; the scene's last three numbers lead to the face and the openness of
# each primitive, and to whether it has two sides. `behind` is `follow.strikes_back`. Word 8 of a ray is the candidate's
# distance. All candidates about a known hit are turned down after a look, so that Embree goes on to the next.
_EMBREE = """
    struct alignas(16) RayHit {
        float org[3]; float tnear; float dir[3]; float time; float tfar; unsigned mask; unsigned id; unsigned flags;
        float ng[3]; float u; float v; unsigned prim; unsigned geom; unsigned inst; unsigned inst_prim;
    } r;
    struct Context {
        unsigned instances[8]; const unsigned char* gone; const int* face; const float* open;
        const unsigned char* two_sided; const float* d;
        unsigned first; float t; unsigned prim; float ng[3]; float u; float v;
        bool behind(unsigned p, const float* n, float a, float b) const {
            const float cosine = (n[0] * d[0] + n[1] * d[1] + n[2] * d[2])
                / wp::sqrt(wp::max(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1e-37f));
            return cosine > GRAZING && wp::min(1.0f - a - b, wp::min(a, b)) > EDGE && !two_sided[p];
        }
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
    context.two_sided = (const unsigned char*)held[6];
    const float along_ray[3] = {d[0], d[1], d[2]};
    context.d = along_ray;
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
            const float* other = (const float*)candidate->hit;
            const bool open = best.open[prim] > 0.0f, best_open = best.open[best.prim] > 0.0f;
            const bool behind = best.behind(prim, other, other[3], other[4]);
            const bool best_behind = best.behind(best.prim, best.ng, best.u, best.v);
            const bool later = best.face[prim] > best.face[best.prim];
            if (open != best_open ? open : behind != best_behind ? behind : later) return;
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
""".replace("GRAZING", f"{geometry.GRAZING_COSINE}f").replace("EDGE", f"{geometry.EDGE_BARYCENTRIC:f}f")


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
    """The device function that settles which of the faces in the place of a hit counts, for one of `CLOSEST`'s.

    `f(entry, scene, origin, direction, t_min, hit) -> Hit`, with the `t_min` that the hit was found with.
    """
    return _SETTLED[closest_hit]
