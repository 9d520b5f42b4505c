"""Samples brought up to date by the rays that changed equal samples traced anew."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.change_types import WorldChange
from bake.decorator_types import FogBoxes
from bake.rebake.casters import changed_casters
from bake.rebake.changes import compare
from bake.samples import place_samples
from bake.settings import BakeSettings, Kernel
from bake.trace import Tracer
from bake.trace.changed_rays import ChangedRays, TallyChange
from bake.types import BoolArray, Float32Array, SampleSet, Tally, World
from tests.trace.conftest import open_tracer
from tests.trace.edits import Thing, edited, fog_of, start, world_of
from tests.worlds import box, icosphere, quad

SETTINGS = BakeSettings(rays=32, samples_per_face=(1, 4), sample_spacing=1.0, alpha_lookup=True)
CUDA = pytest.param("cuda", marks=pytest.mark.cuda)


def boxes_of(
    old: World, new: World, change: WorldChange, fogs: tuple[FogBoxes | None, FogBoxes | None]
) -> tuple[Float32Array, Float32Array, BoolArray]:
    """Boxes around what differs, and which of them hold faces that stop rays."""
    casters = changed_casters(old, new, change, *fogs)
    return *casters.boxes, np.concatenate((casters.before.opaque, casters.after.opaque))


def traced(tracer: Tracer, samples: SampleSet) -> Tally:
    """All samples traced whole."""
    tally = Tally.empty(len(samples), tracer.settings.distance_count)
    for batch in samples.batches(tracer.batch_size):
        tracer.accumulate(samples, batch, tally)
    return tally


def carried(old: World, new: World, change: WorldChange, options: BakeSettings) -> tuple[SampleSet, SampleSet]:
    """The samples on carried faces, in both numberings."""
    before, after = place_samples(old, options), place_samples(new, options)
    rows = np.flatnonzero(change.old_face[after.face] >= 0)
    known = {(face, index): row for row, (face, index) in enumerate(zip(before.face, before.index, strict=True))}
    former = [known.get((change.old_face[after.face[row]], after.index[row]), -1) for row in rows]
    there = np.array([row >= 0 for row in former], np.bool_)
    return before.only(np.array(former, np.int64)[there]), after.only(rows[there])


def hold_against(body: str, old: World, new: World, options: BakeSettings, *, exact: bool = False) -> TallyChange:
    """What was found to change, after comparing it with samples traced whole before and after."""
    change, fogs = compare(old, new), (fog_of(old), fog_of(new))
    here, there = carried(old, new, change, options)
    with (
        open_tracer(body, old, options, fog=fogs[0]) as before,
        before.updated(new, change, fogs[1]) as after,
        ChangedRays(before, after, change, *boxes_of(old, new, change, fogs)) as rays,
    ):
        former, expected = traced(before, here), traced(after, there)
        found = rays.trace(there, exact=exact)
        parts = [rays.trace(there, rays=slice(a, b)) for a, b in ((0, 4), (4, options.rays))]
    now = found.applied(former)
    if exact:
        np.testing.assert_array_equal(now.ao, expected.ao)
    np.testing.assert_allclose(now.ao, expected.ao, atol=2e-6)
    np.testing.assert_array_equal(now.hits, expected.hits)
    np.testing.assert_array_equal(now.back_faces, expected.back_faces)
    in_parts = parts[1].applied(parts[0].applied(former))
    np.testing.assert_allclose(in_parts.ao, expected.ao, atol=2e-6)
    np.testing.assert_array_equal(in_parts.hits, expected.hits)
    touched = (former.ao != expected.ao).any(axis=1)
    assert (found.changed[touched] > 0).all()
    return found


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6), st.booleans(), st.booleans(), st.sampled_from(list(Kernel)))
def test_changes_add_up_to_samples_traced_anew(seed: int, lookup: bool, exact: bool, kernel: Kernel) -> None:
    """Whatever is edited, old values and changes together are what a whole trace finds."""
    rng = np.random.default_rng((seed, 1))
    options = SETTINGS.replaced(kernel=kernel, max_distance=6.0 if kernel is Kernel.OCCLUSION else None)
    things = start(seed)
    now = things
    for _ in range(rng.integers(1, 3)):
        now = edited(now, rng)
    hold_against("embree", world_of(things, lookup=lookup), world_of(now, lookup=lookup), options, exact=exact)


@pytest.mark.parametrize("body", ["warp-cpu", "brute", CUDA])
@pytest.mark.parametrize("exact", [False, True])
def test_the_others_find_them_too(body: str, exact: bool) -> None:
    """So with the other bodies."""
    rng, things = np.random.default_rng((4, 1)), start(4, 6)
    now = edited(edited(things, rng), rng)
    hold_against(body, world_of(things, lookup=True), world_of(now, lookup=True), SETTINGS, exact=exact)


def room(prop: tuple[float, float, float]) -> World:
    """A closed room with a prop on its floor and a pillar, next to another room."""
    walls = box((8.0, 3.0, 8.0), inward=True)
    floor = (quad(8.0)[0], quad(8.0)[1])
    return world_of(
        [
            Thing("floor", floor, (0.0, 0.01, 0.0)),
            Thing("walls", walls, (0.0, 1.5, 0.0)),
            Thing("next", walls, (8.5, 1.5, 0.0)),
            Thing("pillar", box((0.5, 3.0, 0.5)), (-2.0, 1.5, 0.3)),
            Thing("prop", icosphere(2, 0.5), prop),
        ]
    )


def test_few_rays_are_traced_for_a_prop_in_a_room() -> None:
    """Moving a prop traces at most three times as many rays as find something else, and none of most samples."""
    options = BakeSettings(rays=64, samples_per_face=(64, 64))
    found = hold_against("embree", room((1.0, 0.6, 0.5)), room((1.6, 0.6, 1.1)), options)
    assert found.changed.sum() > 1000
    assert found.traced.sum() <= 3 * found.changed.sum()
    assert found.tested.sum() < 64 * len(found) / 4


def test_nothing_is_traced_where_nothing_changed() -> None:
    """Without a difference no ray is tested."""
    world = room((1.0, 0.6, 0.5))
    found = hold_against("embree", world, world, SETTINGS)
    assert found.tested.sum() == found.traced.sum() == found.changed.sum() == 0
    assert len(found.whole) == 0


def test_many_boxes_are_put_together() -> None:
    """Hundreds of things that move at once change the samples as a whole trace does."""
    rng = np.random.default_rng(2)
    floor = Thing("floor", quad(20.0), (0.0, 0.0, 0.0))

    def scattered() -> World:
        places = rng.uniform(-9, 9, (120, 3)) * [1, 0, 1] + [0, 0.4, 0]
        shape = icosphere(0, 0.3)
        return world_of([floor, *[Thing(f"{i}", shape, tuple(p)) for i, p in enumerate(places.tolist())]])

    hold_against("embree", scattered(), scattered(), BakeSettings(rays=32, samples_per_face=(200, 200)))
