"""Shrubs as boxes of fog: cheap occluders for what is too many and too fine to trace."""

from __future__ import annotations

import numpy as np

from bake.arrays import Float32Array, Int32Array
from bake.decorator_types import FogBoxes
from bake.decorators.fog_density import without_overlap
from bake.decorators.object_faces import faces_of
from bake.geometry import as_traced
from bake.settings import BakeSettings
from bake.types import Role, World


def make_fog(world: World, settings: BakeSettings) -> FogBoxes | None:
    """One axis-aligned box a shrub, with a density that overlaps have lowered (Sloan et al. 2013, section 2.1).

    The density is the object's own, else the one fitted to its mesh (`fit_fog`), else `fog_density`.

    Args:
        world: Boxes are those of the vertices that the shrubs' faces use, as traced.
        settings: `fog_density`, `fit_fog` and `skip` matter.

    Returns:
        The boxes in scene order, or None if there is no shrub with faces or `fog` is skipped.

    Raises:
        DeviceError: fitting failed.
    """
    if "fog" in settings.skip:
        return None
    shrubs = np.array([role is Role.SHRUB for role in world.object_roles], np.bool_)
    shrubs &= np.diff(world.first_face) > 0
    number = np.flatnonzero(shrubs).astype(np.int32)
    if len(number) == 0:
        return None
    minimum, maximum = _boxes(world, number)
    given = _given_density(world, settings, number, minimum, maximum)
    return FogBoxes(number, minimum, maximum, given, without_overlap(minimum, maximum, given))


def _boxes(world: World, number: Int32Array) -> tuple[Float32Array, Float32Array]:
    """Bounding boxes of some objects' faces, shape (b, 3) each."""
    face, start, _ = faces_of(world, number)
    corners = as_traced(world.positions[world.faces[face]])
    return np.minimum.reduceat(corners.min(axis=1), start), np.maximum.reduceat(corners.max(axis=1), start)


def _given_density(
    world: World, settings: BakeSettings, number: Int32Array, minimum: Float32Array, maximum: Float32Array
) -> Float32Array:
    own = [world.object_keys[int(i)].density for i in number]
    density = np.array([settings.fog_density if value is None else value for value in own], np.float32)
    unsaid = np.array([value is None for value in own], np.bool_)
    if settings.fit_fog and unsaid.any():
        from bake.decorators.fog_fit import fitted_density

        density[unsaid] = fitted_density(world, number[unsaid], minimum[unsaid], maximum[unsaid])
    return density
