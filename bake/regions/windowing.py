"""Ringing of convolved harmonics: measured, and taken away where it would show.

Nine harmonics of a narrow opening dip below zero opposite to it. Lowering the upper bands removes that, but blurs what
they say, so only what dips gets a window, and the weakest that will do (Sloan 2017, "Deringing Spherical Harmonics").
Sloan lowers high bands more than low ones. Here that is no good: the clamped cosine has already lowered band 2 so much
that without it band 1 dips deeper. One factor for both needs the least change: at worst 0.863, for any visibility.
"""

from __future__ import annotations

import math

import numpy as np

from bake import spherical_harmonics
from bake.arrays import Float64Array, UInt8Array
from bake.geometry import frame

DIP = 1e-3
"""AO below minus this, about any normal, calls for a window."""

_DIRECTIONS = 256
_STEPS = 12  # enough where the least values lie along a valley, as those of a quadratic nearly round do
_FUNCTIONS_A_PART = 1 << 14


def lowest(harmonics: Float64Array) -> Float64Array:
    """Least value over all directions of functions given by nine harmonics, shape (m, 9) → (m,).

    Newton's method from the best of a dense set of directions, and from the best one of the other hemisphere: a
    quadratic dips in at most two places on the sphere, on opposite sides.
    """
    least = np.empty(len(harmonics))
    for begin in range(0, len(harmonics), _FUNCTIONS_A_PART):
        part = harmonics[begin : begin + _FUNCTIONS_A_PART]
        values = part @ _SET_VALUES.T
        nearest = values.argmin(axis=1)
        found = _descend(part, _SET[nearest])
        others = np.where(_OPPOSITE[nearest], values, np.inf)
        # Between its directions the set misses less than this.
        slack = 0.03 * np.linalg.norm(part[:, 1:], axis=1)
        again = np.flatnonzero(others.min(axis=1) - slack < found)
        found[again] = np.minimum(found[again], _descend(part[again], _SET[others[again].argmin(axis=1)]))
        least[begin : begin + _FUNCTIONS_A_PART] = found
    return least


def window(sh: Float64Array) -> tuple[Float64Array, UInt8Array]:
    """Lowers bands 1 and 2 of those functions that dip below zero, until they just do not.

    The mean over all directions stays, so that with the least value m the factor is mean / (mean - m).

    Args:
        sh: Shape (n, 9, k), convolved; the distances of a point are judged apart.

    Returns:
        Harmonics, shape (n, 9, k), and 1 where any distance of a point was lowered, shape (n,), uint8.
    """
    functions = np.moveaxis(sh, 1, 2).reshape(-1, 9)
    mean = functions[:, 0] * spherical_harmonics.Y0
    # |Σ c Y| over bands 1 and 2 is at most |c| √(8/4π): most points need no look.
    bound = np.linalg.norm(functions[:, 1:], axis=1) * math.sqrt(8.0 / (4.0 * math.pi))
    suspects = np.flatnonzero(mean - bound < -DIP)
    least = lowest(functions[suspects])
    dips = least < -DIP
    dipping, least = suspects[dips], least[dips]
    mean = np.maximum(mean[dipping], 0.0)
    lowered = functions.copy()
    lowered[dipping, 1:] *= (mean / (mean - least))[:, None]
    flags = np.zeros((len(sh), sh.shape[2]), np.uint8)
    flags.ravel()[dipping] = 1
    return np.moveaxis(lowered.reshape(len(sh), -1, 9), 2, 1), flags.max(axis=1, initial=0)


def _descend(functions: Float64Array, directions: Float64Array) -> Float64Array:
    """Newton's method in the plane that touches the sphere; returns the least value met."""
    linear, quadratic = _as_polynomial(functions)
    constant = functions[:, 0] * spherical_harmonics.Y0
    least = _value(constant, linear, quadratic, directions)
    for _ in range(_STEPS):
        slope = linear + 2.0 * (quadratic @ directions[:, :, None])[:, :, 0]
        outward = _dot(slope, directions)
        first, second = frame(directions)
        bent = 2.0 * (quadratic @ first[:, :, None])[:, :, 0]
        xx, xy = _dot(bent, first) - outward, _dot(bent, second)
        yy = 2.0 * _dot((quadratic @ second[:, :, None])[:, :, 0], second) - outward
        middle, spread = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
        lift = np.maximum(1e-9 + 1e-3 * (np.abs(middle) + spread) - (middle - spread), 0.0)  # makes the step lead down
        xx, yy = xx + lift, yy + lift
        x, y = _dot(slope, first), _dot(slope, second)
        along = ((yy * x - xy * y)[:, None] * first + (xx * y - xy * x)[:, None] * second) / (xx * yy - xy * xy)[
            :, None
        ]
        directions = directions - along
        directions = directions / np.sqrt(_dot(directions, directions))[:, None]
        least = np.minimum(least, _value(constant, linear, quadratic, directions))
    return least


def _dot(a: Float64Array, b: Float64Array) -> Float64Array:
    return np.einsum("mi,mi->m", a, b)


def _value(
    constant: Float64Array, linear: Float64Array, quadratic: Float64Array, directions: Float64Array
) -> Float64Array:
    bent = (quadratic @ directions[:, :, None])[:, :, 0]
    return constant + _dot(linear + bent, directions)


def _as_polynomial(functions: Float64Array) -> tuple[Float64Array, Float64Array]:
    """The same functions on the unit sphere as bᵀ n + nᵀ Q n, without the constant: (m, 3) and (m, 3, 3)."""
    y1, product, zonal, difference = (
        spherical_harmonics.Y1,
        spherical_harmonics.Y2_PRODUCT,
        spherical_harmonics.Y2_ZONAL,
        spherical_harmonics.Y2_DIFFERENCE,
    )
    linear = functions[:, [3, 1, 2]] * y1
    xy, yz, zz, xz, xx_yy = functions[:, 4:9].T
    quadratic = np.empty((len(functions), 3, 3))
    quadratic[:, 0, 0] = difference * xx_yy - zonal * zz  # 3 z² - 1 = 2 z² - x² - y² on the sphere
    quadratic[:, 1, 1] = -difference * xx_yy - zonal * zz
    quadratic[:, 2, 2] = 2.0 * zonal * zz
    quadratic[:, 0, 1] = quadratic[:, 1, 0] = 0.5 * product * xy
    quadratic[:, 1, 2] = quadratic[:, 2, 1] = 0.5 * product * yz
    quadratic[:, 0, 2] = quadratic[:, 2, 0] = 0.5 * product * xz
    return linear, quadratic


def _spread(count: int) -> Float64Array:
    """Directions spread evenly over the sphere, shape (count, 3): a spherical Fibonacci set."""
    index = np.arange(count) + 0.5
    z = 1.0 - 2.0 * index / count
    angle = index * (math.pi * (3.0 - math.sqrt(5.0)))
    ring = np.sqrt(1.0 - z * z)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)


_SET = _spread(_DIRECTIONS)
_OPPOSITE = _SET @ _SET.T < 0.0
_SET_VALUES = spherical_harmonics.evaluate(_SET)
