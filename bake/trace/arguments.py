"""What a world and its settings look like to the kernels of a fused tracer."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.settings import BakeSettings, Kernel
from bake.types import Float32Array, Int32Array, World


def surface_argument(
    wp: Any, array: Callable[[NDArray[Any], Any], Any], world: World, cast: Int32Array, positions: Any
) -> Any:
    """The kernels' `Surface`.

    Args:
        wp: The initialised module `warp`.
        array: Puts an array on the device.
        world: Geometry and traits.
        cast: Shape (p,): the face of each of the tracer's primitives; -1 where it is gone.
        positions: `World.positions` on the device.
    """
    from bake.kernels.surface import Surface

    surface: Any = Surface()
    surface.positions = positions
    surface.normals = array(world.normals, wp.vec3)
    surface.faces = array(world.faces.ravel(), wp.int32)
    surface.face_object = array(world.face_object, wp.int32)
    surface.object_offset = array(np.array([keys.offset or 0.0 for keys in world.object_keys], np.float32), wp.float32)
    surface.cast_face = array(cast, wp.int32)
    surface.openness = array(world.face_openness[cast], wp.float32)
    surface.two_sided = array(world.face_two_sided[cast].astype(np.uint8), wp.uint8)
    texels, first, width, height = _packed(world.textures)
    uvs, texture = np.zeros((0, 2), np.float32), np.zeros(0, np.int32)
    if world.vertex_uv is not None and world.face_texture is not None:
        uvs, texture = world.vertex_uv, world.face_texture[cast]
    surface.uvs = array(uvs, wp.vec2)
    surface.texture = array(texture, wp.int32)
    surface.texture_first = array(first, wp.int64)
    surface.texture_width = array(width, wp.int32)
    surface.texture_height = array(height, wp.int32)
    surface.texels = array(texels, wp.float32)
    return surface


def falloff_argument(settings: BakeSettings) -> Any:
    """The kernels' `Falloff`."""
    from bake.kernels.falloff import MAX_DISTANCES, Falloff, vec8

    falloff: Any = Falloff()
    rates = np.zeros(MAX_DISTANCES, np.float32)  # rate 0: every hit counts in full
    if settings.kernel is Kernel.OBSCURANCE:
        rates[: len(settings.distances)] = -math.log(2.0) / np.asarray(settings.distances)
    falloff.rates = vec8(*rates.tolist())
    falloff.count = settings.distance_count
    falloff.t_max = settings.trace_distance
    return falloff


def _packed(textures: tuple[Float32Array, ...]) -> tuple[NDArray[Any], ...]:
    """All texels in one array, with each texture's first texel, width and height."""
    sizes = np.array([t.size for t in textures], np.int64)
    texels = np.concatenate([t.ravel() for t in textures]) if textures else np.zeros(0, np.float32)
    width = np.array([t.shape[1] for t in textures], np.int32)
    height = np.array([t.shape[0] for t in textures], np.int32)
    return texels.astype(np.float32), np.cumsum(sizes) - sizes, width, height
