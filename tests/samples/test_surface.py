"""Samples: how many, where, and that they stand for the whole surface."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.geometry import face_normals
from bake.samples import place_samples
from bake.settings import BakeSettings
from bake.types import ObjectKeys, SampleSet, World
from tests.worlds import box, icosphere, make_world, quad


def points(world: World, samples: SampleSet) -> np.ndarray:
    """Positions of the samples."""
    w = np.concatenate([samples.barycentric, 1.0 - samples.barycentric.sum(1, keepdims=True)], axis=1)
    return np.einsum("ij,ijk->ik", w, world.positions[world.faces[samples.face]])


@settings(max_examples=25)
@given(st.integers(1, 8), st.integers(0, 30), st.floats(0.05, 5.0), st.integers(0, 2**32 - 1))
def test_counts_areas_and_barycentrics(fewest: int, more: int, spacing: float, seed: int) -> None:
    """Counts stay between minimum and maximum, areas add up to the surface, weights lie in the triangle."""
    world = make_world(quad(7.0), box((1.0, 2.0, 0.1)), icosphere(1, 0.4))
    wanted = BakeSettings(samples_per_face=(fewest, fewest + more), sample_spacing=spacing, seed=seed)
    samples = place_samples(world, wanted)
    counts = np.bincount(samples.face, minlength=world.face_count)
    assert counts.min() >= fewest
    assert counts.max() <= fewest + more
    area = face_normals(world.positions, world.faces)[1]
    np.testing.assert_allclose(np.bincount(samples.face, samples.area), area, rtol=1e-5)
    w = np.concatenate([samples.barycentric, 1.0 - samples.barycentric.sum(1, keepdims=True)], axis=1)
    assert w.min() >= -1e-6
    assert (np.diff(samples.face) >= 0).all()
    first = np.cumsum(counts) - counts
    np.testing.assert_array_equal(samples.index, np.arange(len(samples)) - first[samples.face])


def test_spacing_decides_between_the_bounds() -> None:
    """A face has one sample per square of the spacing."""
    world = make_world(quad(2.0))
    samples = place_samples(world, BakeSettings(samples_per_face=(1, 100), sample_spacing=0.5))
    assert np.bincount(samples.face).tolist() == [8, 8]


def test_area_integrals_are_unbiased() -> None:
    """The weighted mean over samples is the surface integral, whatever the counts."""
    world = make_world(quad(4.0), quad(1.0, 1.0))
    total = 0.0
    for seed in range(200):
        samples = place_samples(world, BakeSettings(samples_per_face=(1, 5), sample_spacing=2.0, seed=seed))
        p = points(world, samples)
        total += (samples.area * (p[:, 0] ** 2 + p[:, 1])).sum() / 200
    assert total == pytest.approx(4.0**4 / 12 + 1 / 12 + 1.0, rel=0.03)


def test_points_are_uniform_on_a_triangle() -> None:
    """The samples of one large face are spread evenly: their mean is the centroid, far closer than random ones."""
    world = make_world((np.array([[0.0, 0, 0], [3, 0, 0], [0, 0, 5]]), np.array([[0, 2, 1]])))
    samples = place_samples(world, BakeSettings(samples_per_face=(1024, 1024)))
    np.testing.assert_allclose(points(world, samples).mean(0), [1.0, 0.0, 5 / 3], atol=5e-3)


def test_an_edit_elsewhere_moves_no_sample() -> None:
    """Samples of an object depend on the object alone: adding another changes none of them."""
    alone = make_world(box())
    both = make_world(box(), quad(500.0))
    a, b = (place_samples(world, BakeSettings()) for world in (alone, both))
    np.testing.assert_array_equal(a.barycentric, b.barycentric[: len(a)])
    np.testing.assert_array_equal(a.face_seed, b.face_seed[: len(alone.faces)])


def test_seeds_and_objects_differ() -> None:
    """Another seed, another object or another face gives other points."""
    world = make_world(box(), box())
    seeds = place_samples(world, BakeSettings(seed=1)).face_seed
    assert len(np.unique(seeds)) == 24
    assert (place_samples(world, BakeSettings(seed=2)).face_seed != seeds).all()


def test_keys_roles_and_degenerate_faces() -> None:
    """An object's own count wins; faces that take no samples, or have no area, get none."""
    flat = (np.zeros((3, 3)), np.array([[0, 1, 2]]))
    world = make_world(
        quad(), quad(), flat,
        samples=np.array([True, True, False, False, True]),
        keys=(ObjectKeys(samples=3), ObjectKeys(), ObjectKeys()),
    )  # fmt: skip
    samples = place_samples(world, BakeSettings())
    assert np.bincount(samples.face, minlength=5).tolist() == [3, 3, 0, 0, 0]
