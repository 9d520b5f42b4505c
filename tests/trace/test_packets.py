"""Sixteen samples at a time find what one finds, to the bit; in packets too, where no ray meets an edge."""

from __future__ import annotations

import numpy as np
import pytest

from bake.decorator_types import FogBoxes
from bake.samples import place_samples
from bake.settings import BakeSettings
from bake.types import Tally, World
from tests.trace.clutter import clutter
from tests.trace.conftest import open_tracer
from tests.trace.edits import fog_of, start, world_of

SETTINGS = BakeSettings(rays=64, samples_per_face=(1, 4), sample_spacing=1.0)


def scenes() -> list[tuple[World, FogBoxes | None]]:
    """A world of opaque and partly open faces, and one with fog, trees and textures."""
    grown = world_of(start(3), lookup=True)
    return [(clutter(2), None), (grown, fog_of(grown))]


@pytest.mark.parametrize("rays", [1, 8, 48, 64, 100, 256])
@pytest.mark.parametrize("packets", [True, False])
@pytest.mark.parametrize("scene", [0, 1])
def test_groups_find_what_rays_one_by_one_find(scene: int, packets: bool, rays: int) -> None:
    """AO and counts are equal to the bit, whatever the number of rays and however full the last group is."""
    world, fog = scenes()[scene]
    settings = SETTINGS.replaced(rays=rays, packets=packets, alpha_lookup=scene == 1)
    samples = place_samples(world, settings)
    samples = samples.only(np.arange(0, len(samples), 3, dtype=np.int64)[:203])
    tally = Tally.empty(len(samples), settings.distance_count)
    with open_tracer("embree", world, settings, fog=fog) as tracer:
        for batch in samples.batches(101):
            tracer.accumulate(samples, batch, tally)
        alone = tracer.trace_without(samples, -1, fog)  # no object's number: nothing is left out
    np.testing.assert_array_equal(tally.ao, alone.ao)
    np.testing.assert_array_equal(tally.hits, alone.hits)
    np.testing.assert_array_equal(tally.back_faces, alone.back_faces)
    assert len(np.unique(tally.ao)) > 1


@pytest.mark.parametrize("directions", [64, 100, 512, 1024, 1100, 4096])
@pytest.mark.parametrize("packets", [True, False])
@pytest.mark.parametrize("scene", [0, 1])
def test_spheres_find_what_rays_one_by_one_find(scene: int, packets: bool, directions: int) -> None:
    """Harmonics and counts are equal to the bit, sorted or not, whatever the number of directions."""
    world, fog = scenes()[scene]
    rng = np.random.default_rng(5)
    points = rng.uniform(-4, 4, (9, 3)).astype(np.float32)
    seeds = rng.integers(0, 2**32, 9, dtype=np.uint32)
    settings = SETTINGS.replaced(packets=packets, alpha_lookup=scene == 1)
    with open_tracer("embree", world, settings, fog=fog) as tracer:
        found = tracer.gather_sphere(points, seeds, directions)
        tracer.grouped = False  # pyright: ignore[reportAttributeAccessIssue]
        alone = tracer.gather_sphere(points, seeds, directions)
    np.testing.assert_array_equal(found.sh, alone.sh)
    np.testing.assert_array_equal(found.hits, alone.hits)
    np.testing.assert_array_equal(found.back_faces, alone.back_faces)
    assert found.hits.any()
