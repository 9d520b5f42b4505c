"""Reference mathematics of the ray stage in NumPy: frames, mappings, falloff, offsets.

`bake/kernels/rays.py` holds the device twins; a parity test keeps both equal. The brute-force tracer and the tests run
on these.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bake.types import Float32Array, Float64Array

GRAZING_COSINE = 0.0175
"""A hit within 1° of the surface tells nothing reliable about its side, so it never counts as a back face."""

EDGE_BARYCENTRIC = 1e-4
"""Nor does a hit this close to an edge, where rounding may pick either of two faces."""

MAX_LAYERS = 32
"""Most partly open surfaces that one ray passes; it then counts as blocked."""

MAX_OPTICAL_DEPTH = 40.0
"""Where the sum along a ray ends: e⁻⁴⁰ is nothing, and no exponential ever sees an infinity."""

OFFSET_ULPS = 16.0
"""Origin offset in units of 2^-24 × (largest coordinate + extent of the face); see `offset_distance`."""


def frame(normal: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Two tangents that complete unit normals, shape (n, 3), to right-handed orthonormal frames.

    References:
        Duff et al. 2017, "Building an Orthonormal Basis, Revisited", JCGT 6(1), listing 3.
    """
    x, y, z = normal[:, 0], normal[:, 1], normal[:, 2]
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    tangent = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    bitangent = np.stack([b, sign + y * y * a, -y], axis=1)
    return tangent, bitangent


def concentric_disc(u: Float64Array, v: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Maps the unit square to the unit disc, area-preserving and continuous.

    References:
        Shirley and Chiu 1997, "A Low Distortion Map Between Disk and Square".
    """
    a, b = 2.0 * u - 1.0, 2.0 * v - 1.0
    first = np.abs(a) > np.abs(b)
    radius = np.where(first, a, b)
    safe = np.where(radius == 0.0, 1.0, radius)
    phi = (math.pi / 4.0) * np.where(first, b, a) / safe
    sine, cosine = np.sin(phi), np.cos(phi)
    return radius * np.where(first, cosine, sine), radius * np.where(first, sine, cosine)


def cosine_direction(u: Float64Array, v: Float64Array, normal: Float64Array) -> Float64Array:
    """Unit directions about `normal`, shape (n, 3), with density cos θ / π."""
    x, y = concentric_disc(u, v)
    z = np.sqrt(np.maximum(0.0, 1.0 - x * x - y * y))
    tangent, bitangent = frame(normal)
    return x[:, None] * tangent + y[:, None] * bitangent + z[:, None] * normal


def sphere_direction(u: Float64Array, v: Float64Array) -> Float64Array:
    """Unit directions, shape (n, 3), evenly spread over the sphere (Archimedes: by height and angle)."""
    z = 1.0 - 2.0 * u
    radius = np.sqrt(np.maximum(0.0, 1.0 - z * z))
    angle = 2.0 * math.pi * v
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


def above_face(direction: Float64Array, face_normal: Float64Array) -> Float64Array:
    """Mirrors directions below the face plane to above it, shape (n, 3).

    A shading normal tilts the hemisphere, so some directions point into the surface. Counting them as blocked darkens
    smooth, coarse meshes (an outside corner of a low-poly sphere would never be 1); drawing them again breaks the
    stratification and may fail. Their mirror images stay well spread, and every ray counts.
    """
    height = np.einsum("ij,ij->i", direction, face_normal)
    return direction - 2.0 * np.minimum(height, 0.0)[:, None] * face_normal


def falloff(distance: NDArray[np.floating], half_distance: float) -> Float64Array:
    """ρ(d) = 1 - 2^(-d/D): 0 at the surface, ½ at D, 1 far away (Sloan et al. 2013, equation 1)."""
    return -np.expm1(np.asarray(distance, np.float64) * (-math.log(2.0) / half_distance))


def offset_distance(position: Float64Array, extent: Float64Array) -> Float64Array:
    """How far above its face a ray must start so that rounding cannot put it below, in metres, shape (n,).

    Rounding the point to float32 moves it by at most 2^-24 of its largest coordinate along each axis, √3 × that in
    all; the tracers form vertex - origin and its products in float32, which errs by a few 2^-24 × (coordinate +
    extent of the face) in height. Sixteen of these units bound the sum (γ₇ on each side, Pharr, Jakob and Humphreys
    2023, section 6.8, plus rounding of the point). It depends on this face alone, never on the size of the scene.

    Args:
        position: Points on the faces, shape (n, 3), metres.
        extent: Longest edge of each point's face, shape (n,), metres.
    """
    return OFFSET_ULPS * 2.0**-24 * (np.abs(position).max(axis=1) + extent)


def faces_corners(positions: Float64Array, faces: NDArray[np.integer]) -> tuple[Float64Array, ...]:
    """The three corner positions of each face, each shape (m, 3)."""
    return positions[faces[:, 0]], positions[faces[:, 1]], positions[faces[:, 2]]


def face_normals(positions: Float64Array, faces: NDArray[np.integer]) -> tuple[Float64Array, Float64Array]:
    """Unit normals, shape (m, 3), zero for degenerate faces, and areas, shape (m,), in m²."""
    a, b, c = faces_corners(positions, faces)
    cross = np.cross(b - a, c - a)
    length = np.linalg.norm(cross, axis=1)
    return cross / np.where(length > 0.0, length, 1.0)[:, None], 0.5 * length


def as_traced(positions: Float64Array) -> Float32Array:
    """What tracers see: recentred metres rounded to float32. Samples lie on these, not on the originals."""
    return np.ascontiguousarray(positions, dtype=np.float32)


def shading_normals(
    corner_normals: NDArray[np.floating], weights: Float64Array, face_normal: Float64Array
) -> Float64Array:
    """Interpolated unit normals, shape (n, 3), of corner normals turned to the face's side first.

    NVIDIA's sample does the same: a normal from the other side would otherwise cancel its neighbours. Where normals
    cancel all the same, they say nothing about the surface, and the face's own serves.

    Args:
        corner_normals: Shape (n, 3, 3); zero where unknown, which the face's own replaces.
        weights: Shape (n, 3), barycentric.
        face_normal: Shape (n, 3), unit; zero for faces without area.
    """
    corners = corner_normals.astype(np.float64)
    missing = np.einsum("ijk,ijk->ij", corners, corners) == 0.0
    corners = np.where(missing[:, :, None], face_normal[:, None, :], corners)
    away = np.einsum("ijk,ik->ij", corners, face_normal) < 0.0
    smooth = np.einsum("ij,ijk->ik", weights, np.where(away[:, :, None], -corners, corners))
    length = np.linalg.norm(smooth, axis=1, keepdims=True)
    return np.where(length > 1e-3, smooth / np.maximum(length, 1e-3), face_normal)
