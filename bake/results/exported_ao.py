"""AO as the exports hand it out: no NaN, never black where nothing was baked."""

from __future__ import annotations

import numpy as np

from bake.errors import InputError
from bake.types import BakeResult, Float32Array, Float64Array, Role, UInt8Array, VertexState


def open_where_unbaked(ao: Float32Array) -> Float32Array:
    """AO with 1 (open) in place of NaN; same shape."""
    return np.where(np.isnan(ao), np.float32(1.0), ao)


def exported_state(state: UInt8Array) -> UInt8Array:
    """State codes as the exports document them: 0 baked, 1 filled, 2 without a value of its own.

    `NOT_BAKED` (an object that receives no per-vertex AO) becomes 2 like `UNREFERENCED`: both carry a 1 that no
    sample stands behind.
    """
    return np.where(state == VertexState.NOT_BAKED, np.uint8(VertexState.UNREFERENCED), state)


def column_of(result: BakeResult, distance: float | None) -> int:
    """The AO column of a baked distance in metres; of the longest one for None.

    Raises:
        InputError: that distance was not baked.
    """
    distances = result.settings.column_distances
    if distance is None:
        return int(np.argmax(distances))
    for column, baked in enumerate(distances):
        if np.isclose(baked, distance, rtol=1e-6):
            return column
    raise InputError(
        f"the distance {distance:g} m was not baked",
        where="--distance",
        remedy=f"use one of {', '.join(f'{baked:g}' for baked in distances)}",
    )


def object_means(result: BakeResult) -> Float64Array:
    """Mean AO of each object over its surface, shape (o, k), float64; NaN where an object has no baked face.

    A face counts with its area and the mean of its corners.
    """
    world, ao = result.world, result.field.ao
    corners = world.positions[world.faces]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    is_lod = np.array([role is Role.LOD for role in world.object_roles], np.bool_)[world.face_object]
    area[~(world.face_samples | is_lod)] = 0.0
    total = np.empty((world.object_count, ao.shape[1]))
    for column in range(ao.shape[1]):
        value = ao[:, column][world.faces].mean(axis=1, dtype=np.float64)
        weight = np.where(np.isnan(value), 0.0, area)
        weighted = np.bincount(world.face_object, weight * np.nan_to_num(value), world.object_count)
        surface = np.bincount(world.face_object, weight, world.object_count)
        with np.errstate(invalid="ignore", divide="ignore"):
            total[:, column] = np.where(surface > 0, weighted / surface, np.nan)
    return total
