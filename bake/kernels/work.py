"""What the kernels over surface samples work on: the samples, and the fan of rays that each sends out."""

from __future__ import annotations

import warp as wp

from bake.kernels.rays import (
    GOLDEN,
    SECOND_DIMENSION,
    THRESHOLD,
    above_face,
    concentric_disc,
    first_tangent,
    hash_u32,
    owen_sobol,
    to_unit,
)
from bake.kernels.surface import Surface, sample_origin

wp.set_module_options({"enable_backward": False, "fast_math": False})


@wp.struct
class Work:
    """The samples of a bake and where their tallies go."""

    face: wp.array(dtype=wp.int32)
    barycentric: wp.array(dtype=wp.vec2)
    index: wp.array(dtype=wp.int32)
    face_seed: wp.array(dtype=wp.uint32)
    rays: wp.int32
    # Out:
    ao: wp.array2d(dtype=wp.float32)
    hits: wp.array(dtype=wp.uint16)
    back_faces: wp.array(dtype=wp.uint16)


@wp.struct
class Fan:
    """The rays of one sample: where they begin, the frame they spread in, and the sequences they come from."""

    point: wp.vec3
    face_normal: wp.vec3
    normal: wp.vec3
    tangent: wp.vec3
    bitangent: wp.vec3
    first_seed: wp.uint32
    second_seed: wp.uint32
    threshold_seed: wp.uint32
    block: wp.uint32


@wp.func
def fan_at(
    surface: Surface, face: wp.int32, barycentric: wp.vec2, seed: wp.uint32, index: wp.int32, rays: wp.int32
) -> Fan:
    """The rays of the sample with number `index` on its face, each of whose samples has `rays`."""
    origin = sample_origin(surface, face, barycentric)
    fan = Fan()
    fan.point = origin.point
    fan.face_normal = origin.face_normal
    fan.normal = origin.shading_normal
    fan.tangent = first_tangent(origin.shading_normal)
    fan.bitangent = wp.cross(origin.shading_normal, fan.tangent)
    fan.first_seed = hash_u32(seed)
    fan.second_seed = hash_u32(seed ^ SECOND_DIMENSION)
    fan.threshold_seed = hash_u32(seed ^ THRESHOLD)
    fan.block = wp.uint32(index) * wp.uint32(rays)
    return fan


@wp.func
def fan_of(surface: Surface, work: Work, sample: wp.int32) -> Fan:
    """The rays of a sample."""
    face = work.face[sample]
    return fan_at(surface, face, work.barycentric[sample], work.face_seed[face], work.index[sample], work.rays)


@wp.func
def drawn(fan: Fan, ray: wp.int32) -> wp.vec3:
    """Direction of a ray by the cosine about the shading normal, before it is brought above the face."""
    disc = concentric_disc(owen_sobol(fan.block + wp.uint32(ray), fan.first_seed, fan.second_seed))
    height = wp.sqrt(wp.max(0.0, 1.0 - disc[0] * disc[0] - disc[1] * disc[1]))
    return disc[0] * fan.tangent + disc[1] * fan.bitangent + height * fan.normal


@wp.func
def ray_direction(fan: Fan, ray: wp.int32) -> wp.vec3:
    """Direction of a ray, never below the face."""
    return above_face(drawn(fan, ray), fan.face_normal)


@wp.func
def ray_threshold(fan: Fan, ray: wp.int32) -> wp.float32:
    """Transmittance at which partly open faces stop a ray."""
    return to_unit(fan.threshold_seed + (fan.block + wp.uint32(ray)) * GOLDEN)
