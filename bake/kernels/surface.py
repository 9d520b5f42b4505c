"""The surface as kernels see it, and the origin and normals of a sample on it."""

from __future__ import annotations

import warp as wp

from bake.kernels.rays import OFFSET_SCALE, agreeing

wp.set_module_options({"enable_backward": False, "fast_math": False})


@wp.struct
class Surface:
    """Geometry and per-face traits, shared by all launches of a bake.

    `openness` is per casting face: the order of the tracer's primitives. `cast_face` leads back to faces.
    """

    positions: wp.array(dtype=wp.vec3)
    normals: wp.array(dtype=wp.vec3)
    faces: wp.array(dtype=wp.int32)
    face_object: wp.array(dtype=wp.int32)
    object_offset: wp.array(dtype=wp.float32)
    cast_face: wp.array(dtype=wp.int32)
    openness: wp.array(dtype=wp.float32)
    two_sided: wp.array(dtype=wp.uint8)
    # Openness maps, empty without look-up at the hit:
    uvs: wp.array(dtype=wp.vec2)
    texture: wp.array(dtype=wp.int32)
    texture_first: wp.array(dtype=wp.int64)
    texture_width: wp.array(dtype=wp.int32)
    texture_height: wp.array(dtype=wp.int32)
    texels: wp.array(dtype=wp.float32)


@wp.struct
class Origin:
    """Where the rays of a sample start, and about which normals."""

    point: wp.vec3
    face_normal: wp.vec3
    shading_normal: wp.vec3


@wp.func
def corner(surface: Surface, face: wp.int32, k: wp.int32) -> wp.vec3d:
    """A corner in float64."""
    p = surface.positions[surface.faces[3 * face + k]]
    return wp.vec3d(wp.float64(p[0]), wp.float64(p[1]), wp.float64(p[2]))


@wp.func
def sample_origin(surface: Surface, face: wp.int32, weights: wp.vec2) -> Origin:
    """The point of a sample, lifted above its face by the bound of `geometry.offset_distance`."""
    a = corner(surface, face, 0)
    b = corner(surface, face, 1)
    c = corner(surface, face, 2)
    u = wp.float64(weights[0])
    v = wp.float64(weights[1])
    point = u * a + v * b + (wp.float64(1.0) - u - v) * c
    normal = wp.normalize(wp.cross(b - a, c - a))
    extent = wp.max(wp.length(b - a), wp.max(wp.length(c - b), wp.length(a - c)))
    largest = wp.max(wp.abs(point[0]), wp.max(wp.abs(point[1]), wp.abs(point[2])))
    lift = OFFSET_SCALE * (largest + extent) + wp.float64(surface.object_offset[surface.face_object[face]])
    lifted = point + lift * normal

    origin = Origin()
    origin.point = wp.vec3(wp.float32(lifted[0]), wp.float32(lifted[1]), wp.float32(lifted[2]))
    origin.face_normal = wp.vec3(wp.float32(normal[0]), wp.float32(normal[1]), wp.float32(normal[2]))
    na = agreeing(surface.normals[surface.faces[3 * face]], origin.face_normal)
    nb = agreeing(surface.normals[surface.faces[3 * face + 1]], origin.face_normal)
    nc = agreeing(surface.normals[surface.faces[3 * face + 2]], origin.face_normal)
    smooth = weights[0] * na + weights[1] * nb + (1.0 - weights[0] - weights[1]) * nc
    length = wp.length(smooth)
    # Normals that cancel say nothing about the surface.
    origin.shading_normal = wp.where(length > 1.0e-3, smooth / wp.max(length, 1.0e-3), origin.face_normal)
    return origin


@wp.func
def openness_at(surface: Surface, primitive: wp.int32, weights: wp.vec2) -> wp.float32:
    """Share of light that passes at a hit: the face's own, or its texture's nearest texel."""
    openness = surface.openness[primitive]
    if surface.texture.shape[0] > 0:
        texture = surface.texture[primitive]
        if texture >= 0:
            face = surface.cast_face[primitive]
            uv = (
                weights[0] * surface.uvs[surface.faces[3 * face]]
                + weights[1] * surface.uvs[surface.faces[3 * face + 1]]
                + (1.0 - weights[0] - weights[1]) * surface.uvs[surface.faces[3 * face + 2]]
            )
            width = surface.texture_width[texture]
            height = surface.texture_height[texture]
            x = wp.min(wp.int32((uv[0] - wp.floor(uv[0])) * wp.float32(width)), width - 1)
            y = wp.min(wp.int32((uv[1] - wp.floor(uv[1])) * wp.float32(height)), height - 1)
            openness = surface.texels[surface.texture_first[texture] + wp.int64(y * width + x)]
    return openness
