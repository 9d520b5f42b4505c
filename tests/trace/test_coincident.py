"""Which of several faces in one place counts does not hang on what else is in the scene."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bake.samples import place_samples
from bake.settings import BakeSettings
from bake.types import Float32Array, Int32Array, Tally, World
from tests.trace.conftest import open_tracer
from tests.worlds import icosphere, make_world, quad

SETTINGS = BakeSettings(rays=32, samples_per_face=(6, 6))
OPENNESS = (0.0, 0.9, 0.2, 0.6)
"""Of the floor, and of three lids in one place above it."""


def lids(spheres: int) -> World:
    """A floor under three lids in one place; below it spheres that no ray of the floor meets, but that fill a tree."""
    below = [icosphere(1, 0.3, centre=(0.7 * number - 2.0, -2.0, 0.3 * number)) for number in range(spheres)]
    world = make_world(quad(3.0), *[quad(9.0, 0.7, up=False) for _ in OPENNESS[1:]], *below)
    openness = np.zeros(world.face_count, np.float32)
    for number, value in enumerate(OPENNESS):
        openness[world.face_object == number] = value
    return replace(world, face_openness=openness, face_samples=world.face_object == 0)


def seen(world: World, body: str) -> tuple[Float32Array, Int32Array]:
    """AO of the floor's samples, and the first faces that their rays meet."""
    samples = place_samples(world, SETTINGS)
    with open_tracer(body, world, SETTINGS) as tracer:
        found = tracer.record(samples)
        return tracer.trace_without(samples, 0, None).ao, found.first_face


def test_the_lowest_number_counts(fast_body: str) -> None:
    """The first of the lids is met, and the others are as if they were not there."""
    ao, first = seen(lids(0), fast_body)
    lid = make_world(quad(3.0), quad(9.0, 0.7, up=False))
    openness = np.where(lid.face_object == 1, np.float32(OPENNESS[1]), np.float32(0.0))
    alone, _ = seen(replace(lid, face_openness=openness, face_samples=lid.face_object == 0), fast_body)
    assert set(np.unique(first)) <= {-1, 2, 3}
    np.testing.assert_array_equal(ao, alone)


@pytest.mark.parametrize("spheres", [0, 1, 3, 7])
def test_an_opaque_face_wins(spheres: int) -> None:
    """With Embree, where one of the lids is opaque, no ray goes through, whatever its number and the tree."""
    for opaque in range(1, len(OPENNESS)):
        world = lids(spheres)
        openness = np.where(world.face_object == opaque, np.float32(0.0), world.face_openness)
        samples = place_samples(world, SETTINGS)
        with open_tracer("embree", replace(world, face_openness=openness), SETTINGS) as tracer:
            found = tracer.record(samples)
        above = found.first_face >= 0
        assert above.sum() > 300
        np.testing.assert_array_equal(world.face_object[found.face[above]], opaque)


def test_other_objects_do_not_decide(fast_body: str) -> None:
    """Objects elsewhere change the tree and not the values."""
    expected, _ = seen(lids(0), fast_body)
    for spheres in (1, 3, 7):
        found, _ = seen(lids(spheres), fast_body)
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("order", [(True, False), (False, True)])
def test_faces_back_to_back_are_no_back(order: tuple[bool, bool]) -> None:
    """With Embree, a ceiling of two sheets back to back shows its front, whatever their order and the tree."""
    for spheres in (0, 1, 3, 7):
        below = [icosphere(1, 0.3, centre=(0.7 * number - 2.0, -2.0, 0.3 * number)) for number in range(spheres)]
        # rays from the floor strike the sheet that faces down from the front, and the other from behind
        world = make_world(quad(3.0), *[quad(8.0, 0.5, up=up) for up in order], *below)
        world = replace(world, face_samples=world.face_object == 0)
        samples = place_samples(world, SETTINGS)
        tally = Tally.empty(len(samples), SETTINGS.distance_count)
        with open_tracer("embree", world, SETTINGS) as tracer:
            tracer.accumulate(samples, slice(0, len(samples)), tally)
        assert tally.hits.sum() > 300
        assert not tally.back_faces.any()


def test_a_face_alone_keeps_its_back() -> None:
    """A ceiling that shows nothing but its back proves that samples below it lie inside a body."""
    world = make_world(quad(3.0), quad(8.0, 0.5, up=True))
    world = replace(world, face_samples=world.face_object == 0)
    samples = place_samples(world, SETTINGS)
    tally = Tally.empty(len(samples), SETTINGS.distance_count)
    with open_tracer("embree", world, SETTINGS) as tracer:
        tracer.accumulate(samples, slice(0, len(samples)), tally)
    assert tally.back_faces.sum() > 0.9 * tally.hits.sum() > 270
