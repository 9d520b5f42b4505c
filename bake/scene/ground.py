"""The ground plane (after NVIDIA's OptiX Prime baking sample): a quad under the scene that blocks light from below."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.ground import Ground
from bake.scene.content_hash import ContentHasher
from bake.types import Float64Array, ObjectKeys, Role, World

GROUND_PATH = "ground"
QUAD_FACES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def ground_quad(ground: Ground, minimum: Float64Array, maximum: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Corners and normal of the quad.

    Where the scene is flat along an axis, its largest extent stands in, so that the quad neither coincides with a
    flat floor nor vanishes.

    Args:
        ground: Which side faces up, size and distance in units of the scene's extents.
        minimum, maximum: Shape (3,): the scene's bounding box.

    Returns:
        Shape (4, 3), counter-clockwise seen from above (use with `QUAD_FACES`), and the unit normal, shape (3,).
    """
    extent = maximum - minimum
    extent = np.where(extent > 1e-9 * extent.max(), extent, extent.max())
    axis, downward = divmod(ground.axis, 2)
    sign = -1.0 if downward else 1.0
    height = (maximum[axis] if downward else minimum[axis]) - sign * ground.offset * extent[axis]
    centre = 0.5 * (minimum + maximum)
    first, second = (axis + 1) % 3, (axis + 2) % 3  # first × second points along +axis
    signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    if downward:
        signs = signs[::-1]
    corners = np.empty((4, 3))
    corners[:, axis] = height
    for column, tangent in enumerate((first, second)):
        corners[:, tangent] = centre[tangent] + signs[:, column] * 0.5 * ground.scale * extent[tangent]
    normal = np.zeros(3)
    normal[axis] = sign
    return corners, normal


def with_ground(world: World, ground: Ground, minimum: Float64Array, maximum: Float64Array) -> World:
    """`world` with the ground plane as its last object.

    Args:
        world: Without a ground.
        ground: Side, size and distance.
        minimum, maximum: Shape (3,): the scene's box, relative to the world's origin.
    """
    corners, normal = ground_quad(ground, minimum, maximum)
    path, repeat = GROUND_PATH, 0
    while path in world.object_paths:
        repeat += 1
        path = f"{GROUND_PATH}#{repeat}"
    number, two = world.object_count, len(QUAD_FACES)

    def extended(array: NDArray[Any], value: float) -> NDArray[Any]:
        return np.concatenate((array, np.full(two, value, array.dtype)))

    return replace(
        world,
        positions=np.concatenate((world.positions, corners)),
        normals=np.concatenate((world.normals, np.tile(normal, (4, 1)).astype(np.float32))),
        faces=np.concatenate((world.faces, QUAD_FACES + np.int32(world.vertex_count))),
        face_object=extended(world.face_object, number),
        face_casts=extended(world.face_casts, True),
        face_samples=extended(world.face_samples, False),
        face_two_sided=extended(world.face_two_sided, True),
        face_openness=extended(world.face_openness, 0.0),
        first_vertex=np.append(world.first_vertex, world.vertex_count + 4),
        first_face=np.append(world.first_face, world.face_count + two),
        object_paths=(*world.object_paths, path),
        object_roles=(*world.object_roles, Role.BLOCKER),
        object_keys=(*world.object_keys, ObjectKeys(two_sided=True)),
        object_hash=(*world.object_hash, ContentHasher.ground_hash(world.origin, corners)),
        vertex_uv=None if world.vertex_uv is None else np.concatenate((world.vertex_uv, np.zeros((4, 2), np.float32))),
        face_texture=None if world.face_texture is None else extended(world.face_texture, -1),
    )
