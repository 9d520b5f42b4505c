"""A level in which only what lies near some places is baked; the rest casts as before, but gets no samples."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.spatial import cKDTree

from bake.arrays import Float64Array
from bake.types import Role, Scene, SceneObject


def only_near(scene: Scene, places: Float64Array, reach: float) -> Scene:
    """The scene with static objects that come near none of the places as blockers; a bake of it takes a fraction.

    Rays meet the same triangles, and a fit never reaches from one object into another that it does not touch, so
    values near the places stay as they are but for what a fit takes from the whole scene (`bake.solve.prior`).

    Args:
        scene: A loaded scene.
        places: Shape (p, 3), world metres.
        reach: Metres; objects with a vertex within it of a place are baked, and so are those around a place.
    """
    tree = cKDTree(places)
    return dataclasses.replace(scene, objects=tuple(_bystander(scene, item, tree, reach) for item in scene.objects))


def _bystander(scene: Scene, item: SceneObject, places: cKDTree, reach: float) -> SceneObject:
    if item.role is not Role.STATIC:
        return item
    positions = scene.meshes[item.mesh].positions
    if not len(positions):
        return item
    world = positions @ item.transform[:3, :3].T + item.transform[:3, 3]
    low, high = world.min(axis=0) - reach, world.max(axis=0) + reach
    points = np.asarray(places.data)
    if not np.all((points >= low) & (points <= high), axis=1).any():
        return dataclasses.replace(item, role=Role.BLOCKER)
    # triangles may be larger than the reach, so their middles count as well as their corners
    faces = world[scene.meshes[item.mesh].faces]
    edges = np.linalg.norm(faces - np.roll(faces, 1, axis=1), axis=2).max(axis=1)
    middle = faces.mean(axis=1)
    apart = places.query(middle)[0]
    near = bool((apart <= reach + edges).any())
    return item if near else dataclasses.replace(item, role=Role.BLOCKER)
