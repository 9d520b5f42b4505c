"""Rays on record against what the bake made of the same rays, on every tracer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bake.decorator_types import FogBoxes
from bake.settings import BakeSettings, Kernel
from bake.trace import create_tracer
from bake.trace.records import RayRecords
from bake.types import ObjectKeys, Role, SampleSet, World
from tests.trace.clutter import clutter
from tests.trace.conftest import CPU, body, fast_body, open_tracer, trace_all
from tests.worlds import icosphere, make_world, quad

__all__ = ["body", "fast_body"]

SETTINGS = BakeSettings(rays=32, samples_per_face=(2, 4), sample_spacing=0.7)


def grove() -> tuple[World, FogBoxes]:
    """A floor under two trees of different transmission and three boxes of fog, two of them overlapping."""
    spheres = [icosphere(2, 1.5, centre=(x, 2.0, 0.0)) for x in (-1.0, 1.5)]
    world = make_world(
        quad(4.0),
        *spheres,
        *(quad(0.1, -1.0) for _ in range(3)),
        roles=(Role.STATIC, Role.TREE, Role.TREE, *(Role.SHRUB,) * 3),
        keys=(ObjectKeys(), ObjectKeys(transmission=0.3), *(ObjectKeys(),) * 4),
    )
    floor = world.face_object == 0
    low = np.array([[-2.0, 0.2, -2.0], [-1.0, 0.1, -1.0], [0.5, 1.0, -0.5]], np.float32)
    density = np.array([0.3, 0.8, 2.0], np.float32)
    boxes = FogBoxes(np.array([3, 4, 5], np.int32), low, low + np.float32(1.7), density, density)
    return replace(world, face_casts=floor, face_samples=floor), boxes


def ao_of(records: RayRecords, settings: BakeSettings) -> np.ndarray:
    """AO of the samples as their records tell it, shape (n, k)."""
    far = records.face < 0
    distances = np.asarray(settings.distances)
    rho = -np.expm1(records.distance[..., None].astype(np.float64) * (-np.log(2.0) / distances))
    if settings.kernel is Kernel.OCCLUSION:
        rho = np.zeros((*far.shape, 1))
    rho[far] = 1.0
    return (rho * records.passes[..., None].astype(np.float64)).mean(axis=1)


@pytest.mark.parametrize("kernel", list(Kernel))
def test_records_add_up_to_the_bake(body: str, kernel: Kernel) -> None:
    """The mean over the rays on record is the AO that the bake stored, and so are hits and back faces."""
    settings = SETTINGS.replaced(kernel=kernel, max_distance=5.0 if kernel is Kernel.OCCLUSION else None)
    world = clutter(1, 6)
    samples, tally = trace_all(body, world, settings)
    rows = np.random.default_rng(0).permutation(len(samples))[:500]
    with open_tracer(body, world, settings) as tracer:
        records = tracer.record(samples.only(rows))
    np.testing.assert_allclose(ao_of(records, settings), tally.ao[rows], atol=1e-6)
    np.testing.assert_array_equal((records.first_face >= 0).sum(axis=1), tally.hits[rows])
    np.testing.assert_array_equal(records.back.sum(axis=1), tally.back_faces[rows])
    assert records.mirrored.any()
    assert (records.first_face != records.face).any(), "partly open faces let rays through"


def test_records_name_the_same_faces(fast_body: str) -> None:
    """The faces on record are those of brute force, but for rays within rounding of an edge."""
    world = clutter(2)
    with open_tracer("brute", world, SETTINGS) as brute, open_tracer(fast_body, world, SETTINGS) as tracer:
        samples = some_samples(world)
        expected, records = brute.record(samples), tracer.record(samples)
    assert (records.face == expected.face).mean() > 0.997
    assert (records.first_face == expected.first_face).mean() > 0.997
    assert (records.mirrored == expected.mirrored).mean() > 0.9999
    np.testing.assert_allclose(records.direction, expected.direction, atol=2e-6)


def test_fog_and_leaves_on_record(body: str) -> None:
    """What a ray crosses adds up to what it lets through, object by object as brute force has it."""
    world, boxes = grove()
    samples, tally = trace_all(body, world, SETTINGS, fog=boxes)
    with open_tracer(body, world, SETTINGS, fog=boxes) as tracer:
        records = tracer.record(samples)
    np.testing.assert_allclose(ao_of(records, SETTINGS), tally.ao, atol=1e-6)
    depth = np.bincount(records.crossed_ray, records.crossed_depth, minlength=records.passes.size)
    np.testing.assert_allclose(np.exp(-np.minimum(depth, 40.0)), records.passes.ravel(), atol=2e-6)
    assert (np.diff(records.crossed_ray) >= 0).all()
    with open_tracer("brute", world, SETTINGS, fog=boxes) as brute:
        expected = brute.record(samples)
    per_object = np.bincount(records.crossed_object, records.crossed_depth, minlength=6)
    np.testing.assert_allclose(
        per_object, np.bincount(expected.crossed_object, expected.crossed_depth, minlength=6), rtol=2e-3
    )
    assert (per_object[1:] > 0).all()


def test_a_sample_meets_what_its_rays_meet(body: str) -> None:
    """Samples whose record names an object are found to meet it, and the others see no change without it."""
    world = clutter(3, 5)
    samples, tally = trace_all(body, world, SETTINGS)
    wanted = 4
    own = world.positions[world.faces[world.face_object == wanted]]
    low, high = own.reshape(-1, 3).min(axis=0)[None], own.reshape(-1, 3).max(axis=0)[None]
    with open_tracer(body, world, SETTINGS) as tracer:
        meets = tracer.meets(samples, wanted, low.astype(np.float32), high.astype(np.float32))
        records = tracer.record(samples)
    stopped = (records.face >= 0) & (world.face_object[records.face] == wanted)
    assert meets[stopped.any(axis=1)].all()
    assert 0.05 < meets.mean() < 0.95
    without = replace(world, face_casts=world.face_casts & (world.face_object != wanted))
    _, bare = trace_all(body, without, SETTINGS)
    np.testing.assert_array_equal(bare.ao[~meets], tally.ao[~meets])
    assert (bare.ao[meets] != tally.ao[meets]).any(axis=1).mean() > 0.5


def test_crossing_a_box_is_enough_for_fog(fast_body: str) -> None:
    """Without a face to strike, the samples with a ray through the box are found, and no others."""
    world, boxes = grove()
    samples, tally = trace_all(fast_body, world, SETTINGS, fog=boxes)
    with open_tracer(fast_body, world, SETTINGS, fog=boxes) as tracer:
        meets = tracer.meets(samples, -1, boxes.minimum[2:], boxes.maximum[2:])
    rest = FogBoxes(
        *(getattr(boxes, name)[:2] for name in ("object", "minimum", "maximum", "given_density", "density"))
    )
    _, bare = trace_all(fast_body, world, SETTINGS, fog=rest)
    np.testing.assert_array_equal(bare.ao[~meets], tally.ao[~meets])


def some_samples(world: World) -> SampleSet:
    """A hundred samples of a world."""
    from bake.samples import place_samples

    samples = place_samples(world, SETTINGS)
    return samples.only(np.random.default_rng(1).permutation(len(samples))[:100])


def test_nothing_recorded_of_nothing() -> None:
    """No samples give empty records, not an error."""
    world = clutter(1)
    with create_tracer(world, SETTINGS, CPU) as tracer:
        records = tracer.record(some_samples(world).only(np.zeros(0, np.int64)))
    assert records.direction.shape == (0, 32, 3)


@pytest.mark.parametrize("wanted", [0, 3, 5])
def test_tracing_without_an_object_is_tracing_a_world_without_it(body: str, wanted: int) -> None:
    """To the bit, what samples see with an object passed over is what they see where it never was."""
    world = clutter(2, 6)
    samples, tally = trace_all(body, world, SETTINGS)
    bare = replace(world, face_casts=world.face_casts & (world.face_object != wanted))
    _, expected = trace_all(body, bare, SETTINGS)
    with open_tracer(body, world, SETTINGS) as tracer:
        found = tracer.trace_without(samples, wanted, None)
    for name in ("ao", "hits", "back_faces", "rays"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
    assert (found.ao != tally.ao).any()


def test_coincident_faces_of_another_object_stay(fast_body: str) -> None:
    """A wall that lies in the same plane as the object passed over still blocks."""
    world = make_world(quad(2.0), quad(8.0, 1.0, up=False), quad(8.0, 1.0, up=False), casts=True)
    samples, tally = trace_all(fast_body, world, SETTINGS)
    with open_tracer(fast_body, world, SETTINGS) as tracer:
        found = tracer.trace_without(samples, 1, None)
    floor = world.face_object[samples.face] == 0
    np.testing.assert_allclose(found.ao[floor], tally.ao[floor], atol=1e-6)


@pytest.mark.parametrize("wanted", [1, 2, 4])
def test_trees_and_fog_are_passed_over_too(body: str, wanted: int) -> None:
    """Without a tree or a shrub, rays are as dim as in a world without it."""
    world, boxes = grove()
    roles = list(world.object_roles)
    rest = boxes
    if wanted <= 2:
        roles[wanted] = Role.IGNORE
    else:
        there = boxes.object != wanted
        names = ("object", "minimum", "maximum", "given_density", "density")
        rest = FogBoxes(*(getattr(boxes, name)[there] for name in names))
    samples, _ = trace_all(body, world, SETTINGS, fog=boxes)
    _, expected = trace_all(body, replace(world, object_roles=tuple(roles)), SETTINGS, fog=rest)
    with open_tracer(body, world, SETTINGS, fog=boxes) as tracer:
        found = tracer.trace_without(samples, wanted, rest)
    np.testing.assert_allclose(found.ao, expected.ao, atol=2e-6)
