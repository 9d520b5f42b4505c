"""Decorators made up for a baked level: two trees, fog, a volume whose answer is known, and one small decorator."""

from __future__ import annotations

import dataclasses

import numpy as np

from bake.decorator_types import Decorators, FogBoxes, SmallScalars, TreeFits, TreeModel, TreeVolume
from bake.decorators.harmonics import constant
from bake.decorators.volume_grid import build_grid
from bake.types import BakeResult, ObjectKeys, Role, VertexField, VertexState

OPEN_SHARE = 0.6
ROLES = {"Crate": Role.TREE, "Buried": Role.TREE, "Flipped": Role.SHRUB, "Room": Role.LOD}


def with_decorators(result: BakeResult) -> BakeResult:
    """The level with some objects in other roles: crates are trees, the room is a lower LOD of the ground."""
    world = result.world
    roles = tuple(ROLES.get(path, role) for path, role in zip(world.object_paths, world.object_roles, strict=True))
    keys = tuple(ObjectKeys(of="Ground") if role is Role.LOD else ObjectKeys() for role in roles)
    world = dataclasses.replace(world, object_roles=roles, object_keys=keys)
    ao, state = np.array(result.field.ao), np.array(result.field.state)
    for index, role in enumerate(roles):
        if role in (Role.TREE, Role.SHRUB):
            span = slice(int(world.first_vertex[index]), int(world.first_vertex[index + 1]))
            ao[span], state[span] = np.nan, VertexState.NOT_BAKED
    trees = np.array([i for i, role in enumerate(roles) if role is Role.TREE], np.int32)
    shrub = np.array([i for i, role in enumerate(roles) if role is Role.SHRUB], np.int32)
    spans = [slice(int(world.first_vertex[i]), int(world.first_vertex[i + 1])) for i in trees]
    boxes = np.array([(world.positions[span].min(0), world.positions[span].max(0)) for span in spans])
    k = ao.shape[1]
    rng = np.random.default_rng(3)
    count = spans[0].stop - spans[0].start
    grid = build_grid(boxes[:, 0], boxes[:, 1], 0.5, world.origin)
    volume = TreeVolume(
        origin=grid.origin,
        spacing=grid.spacing,
        top=grid.top,
        brick_voxels=grid.brick_voxels,
        voxel=grid.voxel,
        sh=constant(OPEN_SHARE, len(grid.voxel), k),
        valid=(np.arange(len(grid.voxel)) % 3 > 0).astype(np.uint8),
    )
    coefficients = np.zeros((2, 4, k), np.float32)
    coefficients[:, 0], coefficients[1, 2] = 0.8, 0.1
    decorators = Decorators(
        fog=FogBoxes(
            object=np.repeat(shrub, 2),
            minimum=np.array([(0, 0, 0), (1, 0, 0)], np.float32),
            maximum=np.array([(2, 1, 1), (3, 1, 1)], np.float32),
            given_density=np.array([1.0, 0.8], np.float32),
            density=np.array([0.75, 0.8], np.float32),
        ),
        volume=volume,
        models=(TreeModel(0, rng.uniform(0.2, 1.0, (count, k)).astype(np.float32)),),
        fits=TreeFits(
            object=trees,
            model=np.zeros(2, np.int32),
            centre=boxes.mean(axis=1),
            coefficients=coefficients,
            rmse_global=np.full((2, k), 0.2, np.float32),
            rmse_product=np.full((2, k), 0.1, np.float32),
            terms=np.full((2, k), 4, np.uint8),
            rmse_volume=np.full((2, k), 0.05, np.float32),
        ),
        shrub_scalars=SmallScalars(shrub, np.full((len(shrub), k), 0.4, np.float32), np.zeros(len(shrub), bool)),
    )
    return dataclasses.replace(
        result, world=world, field=VertexField(ao, state, result.field.report), decorators=decorators
    )
