"""The tour: on foot, through doors, never through walls."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest
from synthetic import build_regions, points_of, random_field
from two_rooms import DOOR, write_two_rooms

from bake.devices import resolve
from bake.errors import InputError
from bake.pipeline import settings_for
from bake.region_types import PointState, Regions
from bake.regions.free_space import FreeSpace
from bake.regions.graph import make_graph
from bake.regions.upright import Upright
from bake.scene import flatten, load_scene
from bake.trace import Tracer, create_tracer
from bake.walk.tour import tour

UP = Upright(1, 1.0)


@pytest.fixture(scope="module")
def rooms(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Tracer, Regions]]:
    """The two rooms, their regions with some AO, and a tracer of them."""
    scene_path, region_path = write_two_rooms(tmp_path_factory.mktemp("rooms"))
    settings = settings_for(scene_path, {"regions": str(region_path), "device": "cpu"})
    scene = load_scene(scene_path)
    world = flatten(scene, settings)
    with create_tracer(world, settings, resolve("cpu")) as tracer:
        work = make_graph(scene, world, settings, nearest=tracer.nearest)
        while True:
            try:
                next(work)
            except StopIteration as stop:
                space = stop.value
                break
        yield (
            tracer,
            dataclasses.replace(
                build_regions(2),
                graph=space.graph,
                points=points_of(space.graph, random_field(1), valid=space.valid),
            ),
        )


def test_it_visits_every_region_through_the_door(rooms: tuple[Tracer, Regions]) -> None:
    """The path leads from one room into the other, through the door and through no wall."""
    tracer, regions = rooms
    assert regions.graph.link.tolist() == [[0, 1]]
    found = tour(regions, tracer.world, tracer.nearest, UP)
    assert found.visited.all()
    points = found.path.points
    assert FreeSpace(tracer.world, tracer.nearest).clear(points[:-1], points[1:], width=0.05).all()
    world = points + tracer.world.origin
    crossed = np.flatnonzero(np.diff(world[:, 0] > 4.0))
    assert len(crossed) == 1
    assert DOOR[0] < world[crossed[0], 2] < DOOR[1]


def test_it_stays_at_walking_height(rooms: tuple[Tracer, Regions]) -> None:
    """All of it is a metre above the floor."""
    tracer, regions = rooms
    points = tour(regions, tracer.world, tracer.nearest, UP).path.points + tracer.world.origin
    assert np.abs(points[:, 1] - 1.0).max() < 0.05


def test_the_same_regions_give_the_same_tour(rooms: tuple[Tracer, Regions]) -> None:
    """Bit by bit."""
    tracer, regions = rooms
    one, other = (tour(regions, tracer.world, tracer.nearest, UP).path.points for _ in range(2))
    assert np.array_equal(one, other)


def test_without_valid_points_there_is_no_tour(rooms: tuple[Tracer, Regions]) -> None:
    """Nowhere to stand ends in one clear line."""
    tracer, regions = rooms
    points = regions.points
    closed = dataclasses.replace(points, state=np.full_like(points.state, PointState.UNREACHABLE))
    with pytest.raises(InputError, match="--path"):
        tour(dataclasses.replace(regions, points=closed), tracer.world, tracer.nearest, UP)
