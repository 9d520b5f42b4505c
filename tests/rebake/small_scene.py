"""A small level in memory with an object of every role, and what two bakes of it differ by."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bake.devices import Device
from bake.pipeline import bake
from bake.settings import BakeSettings
from bake.stages import StageClock
from bake.types import BakeResult, Material, Mesh, ObjectKeys, RegionBox, Role, Scene, SceneObject
from tests.solve.solve_cases import grid
from tests.worlds import box, icosphere, quad

CPU = Device("cpu", "CPU")
SETTINGS = BakeSettings(
    rays=16, samples_per_face=(4, 6), device="cpu", volume_directions=32, region_directions=64, distances=(2.0, 40.0)
)
ALONE = SETTINGS.replaced(skip=("trees", "fog", "decorators", "lods", "regions"))


def mesh(name: str, positions: np.ndarray, faces: np.ndarray) -> Mesh:
    """A mesh without normals, of one material."""
    return Mesh(
        name=name,
        positions=np.asarray(positions, np.float64),
        normals=np.zeros((len(positions), 3), np.float32),
        faces=np.asarray(faces, np.int32),
        face_material=np.zeros(len(faces), np.int32),
    )


def placed(
    path: str, number: int, x: float, y: float, z: float, role: Role = Role.STATIC, **keys: object
) -> SceneObject:
    """A mesh at a place."""
    transform = np.eye(4)
    transform[:3, 3] = x, y, z
    return SceneObject(path, number, transform, role, ObjectKeys(**keys))  # pyright: ignore[reportArgumentType]


def small_scene() -> Scene:
    """A floor with walls, props, copies of them, trees, shrubs, decorators and a lower level of detail."""
    positions, faces = grid(10, 10, size=10.0)
    x, z, _ = positions.T
    floor = np.column_stack([x - 5.0, np.zeros(len(x)), z - 5.0]), faces[:, ::-1]
    sheet = quad(1.5, 0.0)
    meshes = (
        mesh("floor", *floor),
        mesh("wall", *box((0.3, 2.5, 8.0))),
        mesh("crate", *box((1.0, 1.0, 1.0))),
        mesh("ball", *icosphere(1, 0.6)),
        mesh("sheet", *sheet),
        mesh("tree", *icosphere(1, 0.8)),
        mesh("shrub", *box((0.6, 0.5, 0.6))),
        mesh("pebble", *icosphere(0, 0.1)),
    )
    objects = (
        placed("floor", 0, 0.0, 0.0, 0.0),
        placed("wall", 1, -4.5, 1.25, 0.0),
        placed("crate", 2, -2.0, 0.501, -1.0),
        placed("crate#1", 2, 1.0, 0.501, 1.0),
        placed("crate#2", 2, 1.2, 1.52, 1.1),
        placed("ball", 3, 2.5, 0.7, -2.0),
        placed("sheet", 4, -1.0, 1.4, 2.0),
        placed("buried", 2, 3.0, -0.3, 3.0),
        placed("tree", 5, 2.0, 1.2, -4.0, Role.TREE),
        placed("tree#1", 5, 3.5, 1.2, -3.5, Role.TREE),
        placed("shrub", 6, -2.5, 0.26, 3.0, Role.SHRUB),
        placed("pebble", 7, -0.5, 0.1, -3.0, Role.SMALL),
        placed("ball far", 3, 2.5, 0.7, -2.0, Role.LOD, of="ball"),
    )
    return Scene(
        path=Path("/nowhere/small.glb"),
        meshes=meshes,
        materials=(Material("plain"),),
        objects=objects,
        regions=(
            RegionBox("west", (-4.3, 0.1, -4.5), (0.0, 2.4, 4.5)),
            RegionBox("east", (0.0, 0.1, -4.5), (4.5, 2.4, 4.5)),
        ),
        up_axis=1,
    )


def baked(scene: Scene, settings: BakeSettings = SETTINGS) -> BakeResult:
    """A whole bake."""
    return drained(bake(scene, settings, CPU, StageClock()))


def drained(steps):  # type: ignore[no-untyped-def]
    """What a generator returns."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
