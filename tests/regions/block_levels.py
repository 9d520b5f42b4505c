"""Small levels out of solid blocks, with a tracer, for tests of regions."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bake.devices import Device
from bake.regions.free_space import FreeSpace
from bake.regions.graph import make_graph
from bake.regions.rays import Nearest
from bake.regions.space import RegionSpace
from bake.scene import flatten
from bake.settings import BakeSettings
from bake.trace import create_tracer
from bake.types import Material, Mesh, RegionBox, Scene, SceneObject, World
from tests.worlds import box, make_world

Block = tuple[tuple[float, float, float], tuple[float, float, float]]

# Two rooms of 5 m x 4 m and a wall of 0.2 m between them, with a doorway of 1.2 m x 2.2 m in its middle.
TWO_ROOMS: tuple[Block, ...] = (
    ((-5.3, -0.2, -2.2), (5.3, 0.0, 2.2)),
    ((-5.3, 3.0, -2.2), (5.3, 3.2, 2.2)),
    ((-5.3, 0.0, -2.2), (5.3, 3.0, -2.0)),
    ((-5.3, 0.0, 2.0), (5.3, 3.0, 2.2)),
    ((-5.3, 0.0, -2.0), (-5.1, 3.0, 2.0)),
    ((5.1, 0.0, -2.0), (5.3, 3.0, 2.0)),
    ((-0.1, 0.0, -2.0), (0.1, 3.0, -0.6)),
    ((-0.1, 0.0, 0.6), (0.1, 3.0, 2.0)),
    ((-0.1, 2.2, -0.6), (0.1, 3.0, 0.6)),
)
WALLED_OFF = (*TWO_ROOMS, ((-0.1, 0.0, -0.6), (0.1, 2.2, 0.6)))
"""The same, the doorway filled."""


def solids(blocks: tuple[Block, ...], *, at: float = 0.0) -> list[tuple[np.ndarray, np.ndarray]]:
    """Corners and outward faces of each block; `at` moves it along every axis."""
    ends = [(np.array(low) + at, np.array(high) + at) for low, high in blocks]
    return [box(tuple(high - low), centre=tuple(0.5 * (low + high))) for low, high in ends]


def block_scene(
    blocks: tuple[Block, ...],
    *,
    regions: tuple[RegionBox, ...] = (),
    at: float = 0.0,
    up_axis: int = 1,
    folder: str = ".",
) -> Scene:
    """A scene of solid blocks; `at` moves it along every axis."""
    parts = solids(blocks, at=at)
    mesh = Mesh(
        name="blocks",
        positions=np.concatenate([corners for corners, _ in parts]),
        normals=np.zeros((8 * len(blocks), 3), np.float32),
        faces=np.concatenate([faces + 8 * i for i, (_, faces) in enumerate(parts)]).astype(np.int32),
        face_material=np.zeros(12 * len(blocks), np.int32),
    )
    return Scene(
        path=Path(folder) / "blocks.glb",
        meshes=(mesh,),
        materials=(Material("stone"),),
        objects=(SceneObject("Blocks", 0, np.eye(4)),),
        regions=regions,
        up_axis=up_axis,
    )


@contextmanager
def lent(world: World) -> Iterator[Nearest]:
    """The closest hits of an Embree tracer."""
    pytest.importorskip("embreex", reason="Embree is not installed")
    with create_tracer(world, BakeSettings(), Device("cpu", "CPU")) as tracer:
        yield tracer.nearest


@contextmanager
def free_space(blocks: tuple[Block, ...]) -> Iterator[FreeSpace]:
    """What blocks in a level of blocks."""
    world = make_world(*solids(blocks))
    with lent(world) as nearest:
        yield FreeSpace(world, nearest)


def regions_of(scene: Scene, **options: Any) -> tuple[RegionSpace, World]:
    """What `make_graph` finds in a scene."""
    settings = BakeSettings(**options)
    world = flatten(scene, settings)
    with lent(world) as nearest:
        space = returned(make_graph(scene, world, settings, nearest=nearest))
    assert space is not None
    return space, world


def returned(work: Generator[Any, None, Any]) -> Any:
    """What a generator returns in the end."""
    try:
        while True:
            next(work)
    except StopIteration as end:
        return end.value
