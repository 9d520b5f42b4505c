"""A tracer that follows edits finds what one made anew finds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bake.rebake.changes import compare
from bake.samples import place_samples
from bake.settings import BakeSettings
from bake.trace import Tracer
from bake.types import SampleSet, Tally, World
from tests.trace.conftest import open_tracer
from tests.trace.edits import edited, fog_of, start, world_of

SETTINGS = BakeSettings(rays=16, samples_per_face=(1, 4), sample_spacing=1.0, alpha_lookup=True)


def everything(tracer: Tracer, samples: SampleSet) -> list[np.ndarray]:
    """What a tracer finds, in every way that it can be asked."""
    rng = np.random.default_rng(1)
    origins = rng.uniform(-5, 5, (200, 3)).astype(np.float32)
    ways = rng.normal(size=(200, 3))
    ways = (ways / np.linalg.norm(ways, axis=1, keepdims=True)).astype(np.float32)
    tally = Tally.empty(len(samples), tracer.settings.distance_count)
    tracer.accumulate(samples, slice(0, len(samples)), tally)
    hits = tracer.nearest(origins, ways, 50.0)
    sphere = tracer.gather_sphere(origins[:40], np.arange(40, dtype=np.uint32), 32)
    record = tracer.record(samples.only(np.arange(0, len(samples), 7)))
    without = tracer.trace_without(samples, 2, tracer.fog)
    return [
        tally.ao, tally.hits, tally.back_faces, hits.distance, hits.face, sphere.sh, record.distance, record.face,
        record.passes, np.sort(record.crossed_ray), np.sort(record.crossed_object), np.sort(record.crossed_depth),
        without.ao, without.hits, tracer.transmittance(origins, ways, 20.0),
    ]  # fmt: skip


def agree(found: list[np.ndarray], expected: list[np.ndarray]) -> None:
    """Numbers are equal; what is a sum over leaves differs by rounding, since their order does."""
    for a, b in zip(found, expected, strict=True):
        if a.dtype.kind == "f":
            np.testing.assert_allclose(a, b, atol=2e-5, rtol=1e-5)
        else:
            np.testing.assert_array_equal(a, b)


def follow_edits(body: str, seed: int, edits: int, *, lookup: bool) -> None:
    """Edits a world several times, one tracer following, and compares it with new ones; old ones stay usable."""
    rng = np.random.default_rng((seed, 1))  # nothing may come to lie where its twin does
    things = start(seed)
    world = world_of(things, lookup=lookup)
    tracer = open_tracer(body, world, SETTINGS, fog=fog_of(world))
    for _ in range(edits):
        for _ in range(rng.integers(1, 3)):
            things = edited(things, rng)
        new = world_of(things, lookup=lookup)
        before = everything(tracer, samples_of(world))
        following = tracer.updated(new, compare(world, new), fog_of(new))
        agree(everything(tracer, samples_of(world)), before)
        tracer.close()
        world, tracer = new, following
        with open_tracer(body, world, SETTINGS, fog=fog_of(world)) as anew:
            assert (tracer.fog_boxes, tracer.tree_triangles) == (anew.fog_boxes, anew.tree_triangles)
            agree(everything(tracer, samples_of(world)), everything(anew, samples_of(world)))
    tracer.close()


def samples_of(world: World) -> SampleSet:
    """The samples of a world."""
    return place_samples(world, SETTINGS)


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10**6), st.booleans())
@example(257024, False)  # what is left out was added since, with others, and nothing is gone
def test_following_edits_equals_building_anew(seed: int, lookup: bool) -> None:
    """Whatever is edited, the updated Embree tracer answers as a new one; the old one goes on answering as before."""
    follow_edits("embree", seed, 4, lookup=lookup)


@pytest.mark.parametrize("body", ["warp-cpu", "brute", pytest.param("cuda", marks=pytest.mark.cuda)])
def test_the_others_follow_edits(body: str) -> None:
    """So do the bodies that are made anew."""
    follow_edits(body, 3, 2, lookup=True)


def test_embree_keeps_what_it_built() -> None:
    """After an edit the first scene is shared and only what changed is in the second."""
    things = start(5)
    old, new = (
        world_of(things),
        world_of([*things[:-1], edited(things[:1] + things[-1:], np.random.default_rng(0))[-1]]),
    )
    with open_tracer("embree", old, SETTINGS) as tracer, tracer.updated(new, compare(old, new), None) as following:
        assert following._first.address == tracer._first.address
        assert set(new.face_object[following.primitives.added].tolist()) <= {len(things) - 1}
        assert len(following.primitives.kept) == np.count_nonzero(old.face_casts)


def test_a_worn_structure_is_built_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once a fifth of the faces has changed, nothing is gone or added any more."""
    monkeypatch.setattr("bake.trace.primitives.WORN_COUNT", 0)
    things = start(6)
    old = world_of(things)
    new = world_of([things[0], *list(edited(things[1:], np.random.default_rng(1)))[: len(things) // 2]])
    with open_tracer("embree", old, SETTINGS) as tracer, tracer.updated(new, compare(old, new), None) as following:
        assert len(following.primitives.kept) == np.count_nonzero(new.face_casts)
        assert not following.primitives.gone.any()
        samples = samples_of(new)
        with open_tracer("embree", new, SETTINGS) as anew:
            agree(everything(following, samples), everything(anew, samples))


def test_closing_in_any_order() -> None:
    """A following tracer outlives the one it came from, and that one it."""
    things = start(7)
    worlds = [world_of(things), world_of(things[:-1]), world_of(things[:-2])]
    first = open_tracer("embree", worlds[0], SETTINGS)
    second = first.updated(worlds[1], compare(worlds[0], worlds[1]), None)
    third = second.updated(worlds[2], compare(worlds[1], worlds[2]), None)
    second.close()
    expected = [everything(t, samples_of(t.world)) for t in (first, third)]
    first.close()
    agree(everything(third, samples_of(worlds[2])), expected[1])
    third.close()
    third.close()
