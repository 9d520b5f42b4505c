"""Whole walks over fields that are known: variants, pops and figures."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic import build_regions, random_field, row_of_boxes
from walk_fields import constant_sh, constants, fitted_to, ramp, with_models

from bake.errors import InputError
from bake.regions.evaluate import evaluate
from bake.walk import CHOSEN, PathTruth, Variant, WalkOptions, WalkPath, lay_out, path_in_pieces, path_through, simulate
from bake.walk.steps import codes

MODELLED = [variant for variant in Variant if variant is not Variant.TRUTH]


def truth_of(path: WalkPath, field: object, *, noise: float = 0.0) -> PathTruth:
    """What tracing a field along a straight path would give."""
    distance = np.arange(0.0, path.length, 0.1)
    points = np.stack([np.interp(distance, path.distance, path.points[:, axis]) for axis in range(3)], axis=1)
    sh = field(points)
    sh += noise * np.random.default_rng(3).normal(size=sh.shape)
    return PathTruth(
        distance, np.zeros(len(distance), np.int32), sh.astype(np.float32), 1024, np.ones(len(distance), bool),
        np.zeros(2),
    )  # fmt: skip


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 1000), st.integers(1, 4))
def test_variants_are_the_models_they_name(seed: int, count: int) -> None:
    """Raw and regularised AO are the reference evaluation of the tagged region, for all seven normals."""
    regions = build_regions(count, seed=seed)
    path = path_through([[0.5, 1.0, 2.0], [4.0 * count - 0.5, 2.0, 3.0]])
    walk = simulate(regions, path, WalkOptions(normal=(1.0, 2.0, -0.5), column=0))
    for variant, models in ((Variant.RAW, regions.fitted), (Variant.REGULARISED, regions.regularised)):
        for column, normal in enumerate(walk.options.normals):
            expected = evaluate(models, walk.region, walk.position, normal)[:, 0]
            assert np.abs(walk.ao[variant][:, column] - expected).max() < 1e-5
    assert walk.inside.all()


def test_a_constant_level_never_steps() -> None:
    """Where all regions agree every variant is still, and nothing pops."""
    path = path_through([[0.5, 1.0, 2.0], [11.5, 1.0, 2.0]])
    walk = simulate(constants(row_of_boxes(3), [0.4] * 3), path, WalkOptions())
    for variant in MODELLED:
        assert np.abs(walk.ao[variant] - 0.4).max() < 1e-6
        assert walk.metrics[variant].worst_step < 1e-6
    assert not walk.pops


def test_a_jump_is_found_on_its_frame_and_boundary() -> None:
    """A boundary between two constants pops once, there, by their difference, and only where nothing blends it."""
    path = path_through([[0.5, 1.0, 2.0], [11.5, 1.0, 2.0]])
    walk = simulate(constants(row_of_boxes(3), [0.4, 0.4, 0.7]), path, WalkOptions())
    assert {pop.variant for pop in walk.pops} >= {Variant.RAW, Variant.REGULARISED}
    for pop in walk.pops:
        if pop.variant is not Variant.RAW:
            continue
        assert (pop.before, pop.after) == (1, 2)
        assert pop.frame == np.flatnonzero(walk.position[:, 0] > 8.0)[0]
        assert pop.step == pytest.approx(0.3, abs=1e-5)
        assert pop.codes == pytest.approx(codes(np.array([0.7]))[0] - codes(np.array([0.4]))[0], abs=1e-3)
    raw, blended = walk.metrics[Variant.RAW], walk.metrics[Variant.BLENDED]
    assert raw.worst_boundary_step == pytest.approx(0.3, abs=1e-5)
    assert blended.worst_step == pytest.approx(0.3 * (1.0 - 2.0 ** (-1.0 / 60.0 / WalkOptions().half_life)), abs=1e-5)
    assert walk.metrics[Variant.SPATIAL].worst_step < 0.02


def test_blended_pops_name_their_boundary_too() -> None:
    """A jump that blending softens but does not hide is one pop, on its first frame."""
    path = path_through([[0.5, 1.0, 2.0], [7.5, 1.0, 2.0]])
    walk = simulate(constants(row_of_boxes(2), [0.1, 0.9]), path, WalkOptions(half_life=0.15))
    found = [pop for pop in walk.pops if pop.variant is Variant.BLENDED]
    assert [(pop.before, pop.after) for pop in found] == [(0, 1)]
    assert found[0].frame == np.flatnonzero(walk.position[:, 0] > 4.0)[0]


def test_lag_is_the_time_to_nine_tenths() -> None:
    """A step arrives at once without blending, and after log2(10) half-lives with it."""
    path = path_through([[0.5, 1.0, 2.0], [7.5, 1.0, 2.0]])
    walk = simulate(constants(row_of_boxes(2), [0.3, 0.6]), path, WalkOptions(half_life=0.2))
    assert walk.metrics[Variant.RAW].lag == 0.0
    assert walk.metrics[Variant.BLENDED].lag == pytest.approx(0.2 * np.log2(10.0), abs=1.5 / 60.0)


def test_an_even_slope_is_no_pop() -> None:
    """A fast walk up a slope steps far each frame, but all alike."""
    walk = simulate(
        fitted_to(row_of_boxes(2), ramp(0.05, 0.3)),
        path_through([[0.5, 1.0, 2.0], [7.5, 1.0, 2.0]]),
        WalkOptions(speed=10.0, frame_rate=30.0),
    )
    assert walk.metrics[Variant.RAW].worst_step > 0.01
    assert not walk.pops


def test_teleports_are_no_steps() -> None:
    """From piece to piece AO may change, and blending snaps."""
    path = path_in_pieces([[[0.5, 1, 2], [3.5, 1, 2]], [[8.5, 1, 2], [11.5, 1, 2]]])
    walk = simulate(constants(row_of_boxes(3), [0.2, 0.5, 0.9]), path, WalkOptions())
    assert not walk.pops
    for variant in MODELLED:
        assert walk.metrics[variant].worst_step < 1e-6
        assert sorted(set(np.round(walk.ao[variant][:, CHOSEN], 5).tolist())) == pytest.approx([0.2, 0.9])


def test_errors_are_against_the_truth() -> None:
    """A model that is off by a constant has that error, and the truth has none and never pops, noise or not."""
    path, graph = path_through([[0.5, 1.0, 2.0], [7.5, 1.0, 2.0]]), row_of_boxes(2)
    regions = constants(graph, [0.5, 0.5])
    truth = truth_of(path, lambda p: constant_sh(0.6, len(p)))
    walk = simulate(regions, path, WalkOptions(), truth=truth)
    for variant in MODELLED:
        assert walk.metrics[variant].mean_error == pytest.approx(0.1, abs=1e-5)
        assert walk.metrics[variant].max_error == pytest.approx(0.1, abs=1e-5)
    noisy = simulate(regions, path, WalkOptions(), truth=truth_of(path, ramp(0.01), noise=0.05))
    assert not noisy.pops
    assert noisy.metrics[Variant.TRUTH].mean_error == 0.0


def test_variation_does_not_count_the_noise_of_the_truth() -> None:
    """A model of an even slope varies as much as the slope, though the truth trembles."""
    field, path = ramp(0.05, 0.2), path_through([[0.5, 1.0, 2.0], [7.5, 1.0, 2.0]])
    regions = fitted_to(row_of_boxes(2), field)
    exact = simulate(regions, path, WalkOptions(), truth=truth_of(path, field))
    assert exact.metrics[Variant.RAW].excess_variation == pytest.approx(1.0, abs=0.02)
    noisy = simulate(regions, path, WalkOptions(), truth=truth_of(path, field, noise=0.004))
    assert noisy.metrics[Variant.RAW].excess_variation > 0.6


def test_sliders_need_no_tracing_and_no_new_course() -> None:
    """The same course and truth give what a walk from scratch gives, for other models and options."""
    regions = build_regions(3, field=random_field(5))
    path = path_through([[0.5, 1.0, 2.0], [11.5, 1.0, 2.0]])
    course = lay_out(regions, path, speed=1.5, frame_rate=60.0)
    truth = truth_of(path, random_field(5))
    changed = with_models(regions, regions.fitted.coefficients * 0.9)
    for options in (WalkOptions(half_life=0.3), WalkOptions(normal=(1.0, 1.0, 0.0), column=0), WalkOptions(speed=2.0)):
        quick = simulate(changed, path, options, truth=truth, course=course)
        anew = simulate(changed, path, options, truth=truth)
        assert quick.pops == anew.pops
        for variant in Variant:
            assert np.array_equal(quick.ao[variant], anew.ao[variant])
            assert quick.metrics[variant] == anew.metrics[variant]


def test_far_from_the_origin_nothing_changes() -> None:
    """A million metres away the same walk gives the same AO."""
    here = build_regions(2, field=lambda p: random_field(1)(p - np.round(p.min(axis=0) / 1e5) * 1e5))
    there = build_regions(
        graph=row_of_boxes(2, at=1e6), field=lambda p: random_field(1)(p - np.round(p.min(axis=0) / 1e5) * 1e5)
    )
    walks = [
        simulate(regions, path_through(np.array([[0.5, 1, 2], [7.5, 1, 2]]) + at), WalkOptions())
        for regions, at in ((here, 0.0), (there, 1e6))
    ]
    for variant in MODELLED:
        assert np.abs(walks[0].ao[variant] - walks[1].ao[variant]).max() < 1e-4


def test_there_must_be_something_to_walk_in() -> None:
    """Without regions, or for a distance that was not baked, one line says so."""
    path = path_through([[0, 0, 0], [1, 0, 0]])
    with pytest.raises(InputError, match="no distance"):
        simulate(build_regions(2), path, WalkOptions(column=2))
    empty = dataclasses.replace(build_regions(2), graph=row_of_boxes(0))
    with pytest.raises(InputError, match="no regions"):
        simulate(empty, path, WalkOptions())
