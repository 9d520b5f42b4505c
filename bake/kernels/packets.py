"""The first hits of the rays of sixteen samples, in an order that suits the processor.

Three things cost time when each ray is made, traced and weighed by itself: its direction is some sixty operations that
wait for one another; the walks through the tree of successive rays of a sequence have nothing in common; and Embree has
instructions for sixteen rays to spare. So sixteen samples share a scratch memory. A vectorised loop makes all
directions of one sample and sorts them by cells of the unit square, 8 × 8: an aligned block of a (0, 2)-sequence has
equally many points in each, so that rays in the same place of all sixteen fans point the same way about their normals.
Sixteen such rays may make a packet, if packets are asked for. What it finds is what each of its rays would find; but
where two faces meet at an edge, it may be the other one, a last bit farther.

Scratch, in words of four bytes, for up to `RAYS` rays of `LANES` samples: origins [3][LANES]; by place in the order,
directions [RAYS][3][LANES], distance, cosine and two weights [4][RAYS][LANES]. In whole numbers: primitives
[RAYS][LANES], -1 for a miss; each ray's place [LANES][RAYS].
"""

from __future__ import annotations

import warp as wp

from bake.kernels.closest import Hit
from bake.kernels.work import Fan

wp.set_module_options({"enable_backward": False, "fast_math": False})

LANES = 16
"""Samples that share a scratch memory, and rays in a packet."""

RAYS = 64
"""Rays of each that it has room for."""

REALS = LANES * (3 + 7 * RAYS)
WHOLES = LANES * 2 * RAYS

_LANES, _RAYS = wp.constant(LANES), wp.constant(RAYS)
_FOUND = wp.constant(LANES * (3 + 3 * RAYS))
_FIELD = wp.constant(LANES * RAYS)

# The formulas of `rays` and `work`, in a loop that the compiler turns into vector instructions; a test holds them equal
# to the bit, and so nothing may be contracted to a fused multiply-add that is not there.
_SPREAD = """
    #pragma clang fp contract(off)
    {
    const int LANES = 16, RAYS = 64;
    float* const out = reals.data;
    int* const place = wholes.data + LANES * RAYS + lane * RAYS;
    float x[RAYS], y[RAYS], z[RAYS];
    wp::uint32 cell[RAYS];
    for (int j = 0; j < count; ++j) {
        wp::uint32 s = first + (wp::uint32)j, t = s;
        s ^= s * 0x3D20ADEAu; s += first_seed; s *= (first_seed >> 16) | 1u; s ^= s * 0x05526C56u; s ^= s * 0x53A22864u;
        t ^= (t & 0xFFFF0000u) >> 16; t ^= (t & 0xFF00FF00u) >> 8; t ^= (t & 0xF0F0F0F0u) >> 4;
        t ^= (t & 0xCCCCCCCCu) >> 2; t ^= (t & 0xAAAAAAAAu) >> 1;
        t ^= t * 0x3D20ADEAu; t += second_seed; t *= (second_seed >> 16) | 1u; t ^= t * 0x05526C56u;
        t ^= t * 0x53A22864u;
        s = ((s >> 1) & 0x55555555u) | ((s & 0x55555555u) << 1);
        t = ((t >> 1) & 0x55555555u) | ((t & 0x55555555u) << 1);
        s = ((s >> 2) & 0x33333333u) | ((s & 0x33333333u) << 2);
        t = ((t >> 2) & 0x33333333u) | ((t & 0x33333333u) << 2);
        s = ((s >> 4) & 0x0F0F0F0Fu) | ((s & 0x0F0F0F0Fu) << 4);
        t = ((t >> 4) & 0x0F0F0F0Fu) | ((t & 0x0F0F0F0Fu) << 4);
        s = ((s >> 8) & 0x00FF00FFu) | ((s & 0x00FF00FFu) << 8);
        t = ((t >> 8) & 0x00FF00FFu) | ((t & 0x00FF00FFu) << 8);
        s = (s >> 16) | (s << 16); t = (t >> 16) | (t << 16);
        cell[j] = (s >> 31 << 5) | (t >> 31 << 4) | ((s >> 30 & 1u) << 3) | ((t >> 30 & 1u) << 2)
            | ((s >> 29 & 1u) << 1) | (t >> 29 & 1u);
        const float u = ((float)(int)(s >> 9) + 0.5f) * 1.1920928955078125e-07f;
        const float v = ((float)(int)(t >> 9) + 0.5f) * 1.1920928955078125e-07f;
        const float a = 2.0f * u - 1.0f, b = 2.0f * v - 1.0f;
        const bool wide = (a < 0.0f ? -a : a) > (b < 0.0f ? -b : b);
        const float radius = wide ? a : b, other = wide ? b : a;
        const float phi = 0.7853981633974483f * other / (radius == 0.0f ? 1.0f : radius), q = phi * phi;
        const float sine = phi * (1.0f + q * (-1.6666667e-1f + q * (8.3333333e-3f + q * (-1.9841270e-4f
            + q * 2.7557319e-6f))));
        const float cosine = 1.0f + q * (-0.5f + q * (4.1666667e-2f + q * (-1.3888889e-3f + q * (2.4801587e-5f
            + q * -2.7557319e-7f))));
        const float p = radius * (wide ? cosine : sine), r = radius * (wide ? sine : cosine);
        const float square = 1.0f - p * p - r * r, height = __builtin_elementwise_sqrt(square > 0.0f ? square : 0.0f);
        const wp::vec3 d(
            (p * tangent[0] + r * bitangent[0]) + height * normal[0],
            (p * tangent[1] + r * bitangent[1]) + height * normal[1],
            (p * tangent[2] + r * bitangent[2]) + height * normal[2]);
        const float under = wp::dot(d, face_normal), twice = 2.0f * (under < 0.0f ? under : 0.0f);
        x[j] = d[0] - twice * face_normal[0];
        y[j] = d[1] - twice * face_normal[1];
        z[j] = d[2] - twice * face_normal[2];
    }
    for (int axis = 0; axis < 3; ++axis) out[axis * LANES + lane] = point[axis];
    int before[65] = {0};
    for (int j = 0; j < count; ++j) before[cell[j] + 1]++;
    for (int c = 0; c < 64; ++c) before[c + 1] += before[c];
    for (int j = 0; j < count; ++j) {
        const int at = before[cell[j]]++;
        float* const d = out + (3 + 3 * at) * LANES + lane;
        place[j] = at;
        d[0] = x[j]; d[LANES] = y[j]; d[2 * LANES] = z[j];
    }
    }
"""

# `entry` is the address of rtcIntersect1; `scene` leads to the seven numbers of `closest` and to the address of
# rtcIntersect16. Neither a second scene nor a mask may be there. Without packets each ray goes by itself.
_TRACE = """
    struct alignas(16) RayHit {
        float org[3]; float tnear; float dir[3]; float time; float tfar; unsigned mask; unsigned id; unsigned flags;
        float ng[3]; float u; float v; unsigned prim; unsigned geom; unsigned inst; unsigned inst_prim;
    };
    struct alignas(64) Packet {
        float org[3][16]; float tnear[16]; float dir[3][16]; float time[16]; float tfar[16]; unsigned mask[16];
        unsigned id[16]; unsigned flags[16]; float ng[3][16]; float u[16]; float v[16]; unsigned prim[16];
        unsigned geom[16]; unsigned inst[16]; unsigned inst_prim[16];
    } p;
    struct Context { unsigned instances[16]; } context;
    struct Arguments {
        unsigned flags; unsigned features; void* context; void* filter; void* intersect; float width;
    } arguments;
    const int LANES = 16, RAYS = 64;
    const unsigned long long* held = (const unsigned long long*)scene;
    void* const tree = (void*)held[0];
    const float* const in = reals.data;
    float* const found = reals.data + (3 + 3 * RAYS) * LANES;
    int* const prims = wholes.data;
    alignas(64) int valid[16];
    for (int k = 0; k < 16; ++k) {
        context.instances[k] = 0xffffffffu;
        valid[k] = k < lanes ? -1 : 0;
        for (int axis = 0; axis < 3; ++axis) p.org[axis][k] = k < lanes ? in[axis * LANES + k] : 0.0f;
    }
    arguments.flags = 1u << 16;  // coherent
    arguments.features = 0xffffffffu;
    arguments.context = &context;
    arguments.filter = nullptr;
    arguments.intersect = nullptr;
    arguments.width = 0.0f;
    if (!packets) {
        for (int k = 0; k < lanes; ++k) for (int s = 0; s < count; ++s) {
            const int at = s * LANES + k;
            const float* const d = in + (3 + 3 * s) * LANES + k;
            RayHit r;
            for (int axis = 0; axis < 3; ++axis) { r.org[axis] = p.org[axis][k]; r.dir[axis] = d[axis * LANES]; }
            r.tnear = 0.0f; r.time = 0.0f; r.tfar = t_max; r.mask = 0xffffffffu; r.id = 0; r.flags = 0;
            r.geom = r.inst = r.inst_prim = 0xffffffffu;
            ((void (*)(void*, void*, void*))entry)(tree, &r, nullptr);
            prims[at] = r.geom == 0xffffffffu ? -1 : (int)r.prim;
            if (r.geom == 0xffffffffu) continue;
            float length = wp::sqrt(r.ng[0] * r.ng[0] + r.ng[1] * r.ng[1] + r.ng[2] * r.ng[2]);
            float along = r.ng[0] * r.dir[0] + r.ng[1] * r.dir[1] + r.ng[2] * r.dir[2];
            found[at] = r.tfar;
            found[RAYS * LANES + at] = length > 0.0f ? along / length : 0.0f;
            found[2 * RAYS * LANES + at] = 1.0f - r.u - r.v;
            found[3 * RAYS * LANES + at] = r.u;
        }
        return;
    }
    for (int s = 0; s < count; ++s) {
        for (int k = 0; k < 16; ++k) {
            for (int axis = 0; axis < 3; ++axis) p.dir[axis][k] = k < lanes ? in[(3 + 3 * s + axis) * LANES + k] : 0.0f;
            p.tnear[k] = 0.0f; p.time[k] = 0.0f; p.tfar[k] = t_max; p.mask[k] = 0xffffffffu;
            p.id[k] = 0; p.flags[k] = 0; p.geom[k] = p.inst[k] = p.inst_prim[k] = 0xffffffffu;
        }
        ((void (*)(const int*, void*, void*, void*))held[7])(valid, tree, &p, &arguments);
        for (int k = 0; k < 16; ++k) {
            const int at = s * LANES + k;
            float length = __builtin_elementwise_sqrt(
                p.ng[0][k] * p.ng[0][k] + p.ng[1][k] * p.ng[1][k] + p.ng[2][k] * p.ng[2][k]);
            float along = p.ng[0][k] * p.dir[0][k] + p.ng[1][k] * p.dir[1][k] + p.ng[2][k] * p.dir[2][k];
            prims[at] = p.geom[k] == 0xffffffffu ? -1 : (int)p.prim[k];
            found[at] = p.tfar[k];
            found[RAYS * LANES + at] = length > 0.0f ? along / length : 0.0f;
            found[2 * RAYS * LANES + at] = 1.0f - p.u[k] - p.v[k];
            found[3 * RAYS * LANES + at] = p.u[k];
        }
    }
"""


@wp.func_native(_SPREAD)
def _spread(
    reals: wp.array(dtype=wp.float32),
    wholes: wp.array(dtype=wp.int32),
    lane: wp.int32,
    count: wp.int32,
    point: wp.vec3,
    face_normal: wp.vec3,
    normal: wp.vec3,
    tangent: wp.vec3,
    bitangent: wp.vec3,
    first_seed: wp.uint32,
    second_seed: wp.uint32,
    first: wp.uint32,
): ...


@wp.func_native(_TRACE)
def trace_all(
    entry: wp.uint64,
    scene: wp.uint64,
    reals: wp.array(dtype=wp.float32),
    wholes: wp.array(dtype=wp.int32),
    lanes: wp.int32,
    count: wp.int32,
    t_max: wp.float32,
    packets: wp.int32,
):
    """Finds the first hits of `count` rays of `lanes` samples."""


@wp.func
def spread(
    reals: wp.array(dtype=wp.float32),
    wholes: wp.array(dtype=wp.int32),
    lane: wp.int32,
    fan: Fan,
    begin: wp.int32,
    count: wp.int32,
):
    """Makes rays `begin` and on of a sample, sorted by where they point."""
    first = fan.block + wp.uint32(begin)
    _spread(
        reals, wholes, lane, count, fan.point, fan.face_normal, fan.normal, fan.tangent, fan.bitangent,
        fan.first_seed, fan.second_seed, first,
    )  # fmt: skip


@wp.func
def place_of(wholes: wp.array(dtype=wp.int32), lane: wp.int32, ray: wp.int32) -> wp.int32:
    """Where a ray's numbers lie within each field."""
    return wholes[_FIELD + lane * _RAYS + ray] * _LANES + lane


@wp.func
def direction_at(reals: wp.array(dtype=wp.float32), place: wp.int32, lane: wp.int32) -> wp.vec3:
    """The direction of the ray at a place."""
    at = _LANES * 3 + (place - lane) * 3 + lane
    return wp.vec3(reals[at], reals[at + _LANES], reals[at + 2 * _LANES])


@wp.func
def put_origin(reals: wp.array(dtype=wp.float32), lane: wp.int32, origin: wp.vec3):
    """Writes where the rays of a lane begin."""
    for axis in range(3):
        reals[axis * _LANES + lane] = origin[axis]


@wp.func
def put_direction(reals: wp.array(dtype=wp.float32), place: wp.int32, direction: wp.vec3):
    """Writes the direction of the ray at a place."""
    at = _LANES * 3 + (place - place % _LANES) * 3 + place % _LANES
    for axis in range(3):
        reals[at + axis * _LANES] = direction[axis]


@wp.func
def hit_at(reals: wp.array(dtype=wp.float32), wholes: wp.array(dtype=wp.int32), place: wp.int32) -> Hit:
    """The first hit of the ray at a place."""
    hit = Hit()
    hit.distance = reals[_FOUND + place]
    hit.primitive = wholes[place]
    hit.cosine = reals[_FOUND + _FIELD + place]
    hit.weights = wp.vec2(reals[_FOUND + 2 * _FIELD + place], reals[_FOUND + 3 * _FIELD + place])
    return hit


@wp.func
def put_end(reals: wp.array(dtype=wp.float32), place: wp.int32, end: wp.float32):
    """Writes where a ray ended in the place of its first hit's distance."""
    reals[_FOUND + place] = end


@wp.func
def end_at(reals: wp.array(dtype=wp.float32), place: wp.int32) -> wp.float32:
    """What `put_end` wrote."""
    return reals[_FOUND + place]
