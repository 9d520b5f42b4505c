"""Which rays of a fan may point at a sphere, without making them all.

The first coordinate of a ray's sample is an Owen-scrambled radical inverse of its number: the strip that it lies in,
one of 64, decides the number's last six bits and is decided by them. So the numbers of the rays in a strip are found
by undoing the scramble, and only the strips that the sphere's cone touches in the unit square are looked at.
"""

from __future__ import annotations

import warp as wp

from bake.kernels.rays import reverse_bits, scramble_reversed
from bake.kernels.work import Fan

wp.set_module_options({"enable_backward": False, "fast_math": False})

STRIPS = wp.constant(64)
PI = wp.constant(3.14159265)
HALF_PI = wp.constant(1.57079633)
FOUR_OVER_PI = wp.constant(1.27323954)
SLACK = wp.constant(1.0e-3)
"""Room for rounding in the unit square, and for the second look, whose ray is turned by 10⁻⁵."""

ALMOST = wp.constant(0.95)
"""Sine of a cone's half angle above which all rays are looked at."""


@wp.struct
class Towards:
    """Strips of the first coordinate, a bit each, and the range of the second."""

    strips: wp.uint64
    low: wp.float32
    high: wp.float32


@wp.func
def everything() -> Towards:
    """All strips."""
    found = Towards()
    found.strips = wp.uint64(0) - wp.uint64(1)
    found.low = -1.0
    found.high = 2.0
    return found


@wp.func
def trapezoid(angle: wp.float32) -> wp.float32:
    """First coordinate of a concentric square over its radius, by an angle within ±2π: a cosine of straight edges."""
    folded = wp.abs(angle)
    folded = wp.where(folded > PI, 2.0 * PI - folded, folded)
    return wp.clamp((HALF_PI - folded) * FOUR_OVER_PI, -1.0, 1.0)


@wp.func
def span(near: wp.float32, far: wp.float32, angle: wp.float32, half: wp.float32) -> wp.vec2:
    """Range of the square's coordinate, in [0, 1], over radii and the angles within `half` of one within ±3π/2."""
    folded = wp.abs(angle)
    folded = wp.where(folded > PI, 2.0 * PI - folded, folded)
    first = trapezoid(folded - half)
    second = trapezoid(folded + half)
    low = wp.where(folded + half >= PI, -1.0, wp.min(first, second))
    high = wp.where(folded <= half, 1.0, wp.max(first, second))
    low = low * wp.where(low < 0.0, far, near)
    high = high * wp.where(high > 0.0, far, near)
    return wp.vec2(0.5 * low + 0.5 - SLACK, 0.5 * high + 0.5 + SLACK)


@wp.func
def cone(fan: Fan, found: Towards, axis: wp.vec3, sine: wp.float32) -> Towards:
    """`found` with the rays added that are drawn within a cone, by the sine of its half angle."""
    x = wp.dot(axis, fan.tangent)
    y = wp.dot(axis, fan.bitangent)
    if wp.dot(axis, fan.normal) < -sine:
        return found
    # Every unit vector within the cone lies within `sine` of the axis shortened to the cosine.
    cosine = wp.sqrt(1.0 - sine * sine)
    middle = cosine * wp.sqrt(x * x + y * y)
    near = wp.max(0.0, middle - sine)
    far = wp.min(1.0, middle + sine)
    half = PI
    angle = wp.float32(0.0)
    if middle > sine:
        half = wp.asin(sine / middle)
        angle = wp.atan2(y, x)
    across = span(near, far, angle, half)
    along = span(near, far, angle - HALF_PI, half)
    first = wp.clamp(wp.int32(wp.floor(across[0] * 64.0)), 0, 63)
    last = wp.clamp(wp.int32(wp.floor(across[1] * 64.0)), 0, 63)
    every = wp.uint64(0) - wp.uint64(1)
    result = Towards()
    result.strips = found.strips | ((every >> wp.uint64(63 - last + first)) << wp.uint64(first))
    result.low = wp.min(found.low, along[0])
    result.high = wp.max(found.high, along[1])
    return result


@wp.func
def towards(fan: Fan, found: Towards, centre: wp.vec3, radius: wp.float32) -> Towards:
    """`found` with the rays added that may strike a sphere."""
    offset = centre - fan.point
    distance = wp.length(offset)
    wide = radius * 1.0001
    if wide >= ALMOST * distance:
        return everything()
    axis = offset / distance
    sine = wide / distance + 1.0e-4
    result = cone(fan, found, axis, sine)
    if wp.dot(fan.normal, fan.face_normal) < 0.999999:
        # What is drawn below the face is mirrored in it.
        mirrored = axis - 2.0 * wp.dot(axis, fan.face_normal) * fan.face_normal
        result = cone(fan, result, mirrored, sine)
    return result


@wp.func
def number_in(strip: wp.int32, seed: wp.uint32) -> wp.uint32:
    """The last six bits of the numbers of the rays in a strip; the seed is that of the first dimension."""
    wanted = reverse_bits(wp.uint32(strip)) >> wp.uint32(26)
    number = wp.uint32(0)
    for bit in range(6):
        differs = ((scramble_reversed(number, seed) ^ wanted) >> wp.uint32(bit)) & wp.uint32(1)
        number = number ^ (differs << wp.uint32(bit))
    return number
