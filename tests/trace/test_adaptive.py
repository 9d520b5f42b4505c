"""Adaptive rays against fixed counts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bake.errors import SettingsError
from bake.pipeline import BakeRequest, run_bake
from bake.results import load_result
from bake.samples import place_samples
from bake.settings import BakeSettings
from bake.solve.importance import SampleImportance
from bake.trace.adaptive import PILOT, RayPlan, trace_adaptively
from bake.trace.ray_plan import Pilot, RayWorth
from bake.types import SampleSet, Tally, World
from tests.trace.clutter import clutter
from tests.trace.conftest import open_tracer, trace_all
from tests.worlds import box, make_world, quad

SETTINGS = BakeSettings(rays=64, samples_per_face=(4, 8), sample_spacing=0.7, adaptive_error=0.01)


def adapted(world: World, settings: BakeSettings, *, body: str = "embree") -> tuple[SampleSet, Tally, RayPlan]:
    """Samples of a world, what their rays found, and how many they were."""
    samples = place_samples(world, settings)
    importance = SampleImportance(world, samples, settings).of
    with open_tracer(body, world, settings) as tracer:
        run = trace_adaptively(tracer, samples, importance, settings)
        while True:
            try:
                next(run)
            except StopIteration as ended:
                return samples, *ended.value


def test_all_blocks_are_the_fixed_count(body: str) -> None:
    """Samples that send all of their rays get what a bake with that count gives them, and the others their prefix."""
    settings = SETTINGS.replaced(adaptive_error=1e-4)
    world = clutter(1)
    samples, tally, plan = adapted(world, settings, body=body)
    _, fixed = trace_all(body, world, settings)
    whole = plan.rays == settings.rays
    assert whole.mean() > 0.2
    np.testing.assert_array_equal(tally.rays, plan.rays)
    same = np.abs(tally.ao - fixed.ao).max(axis=1)[whole] < 2e-6
    assert same.mean() > 0.995  # where hardly a ray escapes, Embree looks twice at other rays
    assert (tally.hits[whole] == fixed.hits[whole]).mean() > 0.995
    assert len(samples) == len(tally)


@pytest.mark.parametrize("threshold", [1.0, 0.25])
def test_means_over_seeds_are_those_of_fixed_counts(threshold: float) -> None:
    """Adaptive rays are unbiased: over seeds their mean is that of all rays, within its error, or less than 1e-3 off.

    With the back-face rule at work samples look at their own rays, and the means are those of what is valid.
    """
    world = clutter(2)
    settings = SETTINGS.replaced(samples_per_face=(4, 4), adaptive_error=0.02, back_face_threshold=threshold)
    differences: list[np.ndarray] = []
    shares: list[float] = []
    for seed in range(1, 25):
        own = settings.replaced(seed=seed)
        _, tally, plan = adapted(world, own)
        _, fixed = trace_all("embree", world, own.replaced(rays=256))
        kept = fixed.valid(threshold)
        differences.append((tally.ao - fixed.ao)[kept].mean(axis=0, dtype=np.float64))
        shares.append(float(plan.rays.mean()))
    assert PILOT < np.mean(shares) < 0.8 * settings.rays
    mean, error = np.mean(differences, axis=0), np.std(differences, axis=0) / np.sqrt(len(differences))
    assert (error < 1e-3).all()
    assert (np.abs(mean) < 3.5 * error + (0.0 if threshold == 1.0 else 1e-3)).all()


def test_a_looser_bound_takes_fewer_rays() -> None:
    """The estimated noise keeps to the bound where rays allow it, and rays fall as the bound rises."""
    counts: list[int] = []
    for bound in (0.003, 0.01, 0.03):
        plan = adapted(clutter(1), SETTINGS.replaced(adaptive_error=bound, rays=1024))[2]
        assert plan.noise <= 1.1 * bound
        counts.append(int(plan.rays.sum()))
    assert counts[0] > counts[1] > counts[2]


def test_what_is_buried_or_in_the_open_ends_early() -> None:
    """A floor in a solid block and one under the open sky send their first rays only; the shadowed one sends more."""
    inside = quad(1.0, 0.0)
    block = box((4.0, 2.0, 4.0))
    wide, near = quad(4.0, 0.0, centre=(1000.0, 0.0)), quad(4.0, 0.0, centre=(2000.0, 0.0))
    wall = box((4.0, 2.0, 0.5), centre=(2000.0, 1.001, 0.0))
    world = make_world(inside, block, wide, near, wall)
    settings = SETTINGS.replaced(
        samples_per_face=(64, 64), max_distance=10.0, adaptive_error=1e-4, distances=(2.0,), rays=256
    )
    samples, tally, plan = adapted(world, settings)
    of = world.face_object[samples.face]
    assert plan.buried[of == 0].all()
    assert (tally.rays[of == 0] == PILOT).all()
    assert not tally.valid(0.25)[of == 0].any()
    assert plan.unreachable[of == 2].mean() > 0.7  # all but the neighbours of other objects' samples
    assert (tally.ao[of == 2] == 1.0).all()
    assert tally.rays[of == 3].mean() > 4 * PILOT


def test_importance_grows_where_few_samples_are_left() -> None:
    """What some samples weigh is what they weigh among all, and rises as their neighbours turn out invalid."""
    world = clutter(1)
    samples = place_samples(world, SETTINGS)
    importance = SampleImportance(world, samples, SETTINGS)
    every, valid = np.arange(len(samples)), np.ones(len(samples))
    whole = importance.of(valid, every)
    np.testing.assert_array_equal(importance.of(valid, every[5:40:3]), whole[5:40:3])
    valid[::2] = 0.0
    assert (importance.of(valid, every) >= whole * (1.0 - 1e-12)).all()
    assert importance.of(valid, every[1::2]).sum() > 1.5 * whole[1::2].sum()


def test_the_price_takes_the_estimate_to_the_bound() -> None:
    """A ray's price is the one at which the samples that are worth it bring the estimated error down to the bound."""
    random = np.random.default_rng(3)
    count = 4000
    pilot = Pilot(random.random((count, 2)) ** 4, np.full(count, 4.0), np.zeros(count))
    worth = RayWorth(pilot, 0.25, 3.0)
    weight, valid, rows = random.random(count) ** 6 / count, np.ones(count), np.arange(count)
    bound = 0.3 * worth.errors(weight, valid, float(PILOT), rows)[0]
    price = worth.price_for(weight, valid, bound, 4096, rows)
    rays = np.full(count, PILOT)
    for _ in range(10):
        noise, doubt = worth.gain(valid, rays.astype(np.float64), rows)
        rays = np.where(weight * (noise + doubt) > price * rays, 2 * rays, rays)
    assert 0.97 * bound < worth.errors(weight, valid, rays.astype(np.float64), rows)[0] < 1.1 * bound


def test_rays_have_to_be_a_power_of_two() -> None:
    """Sixty rays cannot be cut into blocks that double."""
    with pytest.raises(SettingsError, match="power of two"):
        BakeSettings(rays=60, adaptive_error=0.01)


def test_bakes_say_what_was_skipped(tmp_path: Path) -> None:
    """From the option to the stored result: rays left out are counted, and the stage report says which."""
    scene = tmp_path / "box.ply"
    from bake.bench.synthetic import cube, write_ply

    write_ply(scene, cube())
    run = run_bake(BakeRequest(scene, tmp_path / "result", {"adaptive-error": "0.01", "rays": "64"}))
    while True:
        try:
            next(run)
        except StopIteration:
            break
    result = load_result(tmp_path / "result")
    sent = int(result.tally.rays.sum(dtype=np.int64))
    assert result.settings.adaptive_error == 0.01
    assert result.rays_skipped == 64 * len(result.samples) - sent > 0
    row = next(row for row in result.stages if row.name == "trace")
    assert "in the open" in row.why
    assert row.rays == sent
