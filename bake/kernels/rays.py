"""Device twins of `bake/geometry.py` and `bake/low_discrepancy.py`; a parity test holds them equal."""

from __future__ import annotations

import warp as wp

from bake import geometry

wp.set_module_options({"enable_backward": False, "fast_math": False})

QUARTER_PI = wp.constant(0.7853981633974483)
# Literals above 2^31 would pass through a signed integer on their way into the kernel.
HASH_2 = wp.constant(wp.uint32(0x846CA68B))
SECOND_DIMENSION = wp.constant(wp.uint32(0x9E3779B9))
GOLDEN = wp.constant(wp.uint32(0x9E3779B9))
THRESHOLD = wp.constant(wp.uint32(0x2545F491))
HIGH_16 = wp.constant(wp.uint32(0xFFFF0000))
HIGH_8 = wp.constant(wp.uint32(0xFF00FF00))
HIGH_4 = wp.constant(wp.uint32(0xF0F0F0F0))
HIGH_2 = wp.constant(wp.uint32(0xCCCCCCCC))
HIGH_1 = wp.constant(wp.uint32(0xAAAAAAAA))
OFFSET_SCALE = wp.constant(wp.float64(geometry.OFFSET_ULPS * 2.0**-24))


@wp.func
def reverse_bits(value: wp.uint32) -> wp.uint32:
    """Reverses 32 bits."""
    x = value
    x = ((x >> wp.uint32(1)) & wp.uint32(0x55555555)) | ((x & wp.uint32(0x55555555)) << wp.uint32(1))
    x = ((x >> wp.uint32(2)) & wp.uint32(0x33333333)) | ((x & wp.uint32(0x33333333)) << wp.uint32(2))
    x = ((x >> wp.uint32(4)) & wp.uint32(0x0F0F0F0F)) | ((x & wp.uint32(0x0F0F0F0F)) << wp.uint32(4))
    x = ((x >> wp.uint32(8)) & wp.uint32(0x00FF00FF)) | ((x & wp.uint32(0x00FF00FF)) << wp.uint32(8))
    return (x >> wp.uint32(16)) | (x << wp.uint32(16))


@wp.func
def scramble_reversed(value: wp.uint32, seed: wp.uint32) -> wp.uint32:
    """Owen scramble of a bit-reversed value (Burley 2020)."""
    x = value ^ (value * wp.uint32(0x3D20ADEA))
    x = x + seed
    x = x * ((seed >> wp.uint32(16)) | wp.uint32(1))
    x = x ^ (x * wp.uint32(0x05526C56))
    return x ^ (x * wp.uint32(0x53A22864))


@wp.func
def second_dimension_reversed(index: wp.uint32) -> wp.uint32:
    """Sobol's second dimension, bits reversed."""
    x = index
    x = x ^ ((x & HIGH_16) >> wp.uint32(16))
    x = x ^ ((x & HIGH_8) >> wp.uint32(8))
    x = x ^ ((x & HIGH_4) >> wp.uint32(4))
    x = x ^ ((x & HIGH_2) >> wp.uint32(2))
    return x ^ ((x & HIGH_1) >> wp.uint32(1))


@wp.func
def hash_u32(value: wp.uint32) -> wp.uint32:
    """Wellons's lowbias32."""
    x = (value ^ (value >> wp.uint32(16))) * wp.uint32(0x7FEB352D)
    x = (x ^ (x >> wp.uint32(15))) * HASH_2
    return x ^ (x >> wp.uint32(16))


@wp.func
def to_unit(x: wp.uint32) -> wp.float32:
    """A value in (0, 1)."""
    return (wp.float32(x >> wp.uint32(9)) + 0.5) * 1.1920928955078125e-07


@wp.func
def owen_sobol(index: wp.uint32, first_seed: wp.uint32, second_seed: wp.uint32) -> wp.vec2:
    """Point `index` of a scrambled sequence; the seeds are already hashed, once a sample."""
    u = to_unit(reverse_bits(scramble_reversed(index, first_seed)))
    v = to_unit(reverse_bits(scramble_reversed(second_dimension_reversed(index), second_seed)))
    return wp.vec2(u, v)


@wp.func
def concentric_disc(uv: wp.vec2) -> wp.vec2:
    """Unit square to unit disc (Shirley and Chiu 1997).

    The angle stays within ±π/4, where short Taylor polynomials are exact to float32 and cheaper than library calls.
    """
    a = 2.0 * uv[0] - 1.0
    b = 2.0 * uv[1] - 1.0
    first = wp.abs(a) > wp.abs(b)
    radius = wp.where(first, a, b)
    other = wp.where(first, b, a)
    phi = QUARTER_PI * other / wp.where(radius == 0.0, 1.0, radius)
    q = phi * phi
    sine = phi * (1.0 + q * (-1.6666667e-1 + q * (8.3333333e-3 + q * (-1.9841270e-4 + q * 2.7557319e-6))))
    cosine = 1.0 + q * (-0.5 + q * (4.1666667e-2 + q * (-1.3888889e-3 + q * (2.4801587e-5 + q * -2.7557319e-7))))
    x = radius * wp.where(first, cosine, sine)
    y = radius * wp.where(first, sine, cosine)
    return wp.vec2(x, y)


@wp.func
def first_tangent(n: wp.vec3) -> wp.vec3:
    """First tangent of the frame about a unit normal (Duff et al. 2017)."""
    sign = wp.where(n[2] >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + n[2])
    return wp.vec3(1.0 + sign * n[0] * n[0] * a, sign * n[0] * n[1] * a, -sign * n[0])


@wp.func
def above_face(direction: wp.vec3, face_normal: wp.vec3) -> wp.vec3:
    """Mirrors a direction below the face plane to above it."""
    return direction - 2.0 * wp.min(wp.dot(direction, face_normal), 0.0) * face_normal


@wp.func
def agreeing(normal: wp.vec3, face_normal: wp.vec3) -> wp.vec3:
    """A vertex normal turned to the side of the face; the face normal where there is none."""
    if wp.dot(normal, normal) == 0.0:
        return face_normal
    return wp.where(wp.dot(normal, face_normal) < 0.0, -normal, normal)
