"""The smoothing that the samples ask for themselves."""

from __future__ import annotations

import numpy as np

from bake.bench.synthetic import height_field
from bake.samples import place_samples
from bake.settings import BakeSettings
from bake.solve import VertexMapper
from bake.solve.alpha_choice import CANDIDATES, STRATIFIED, AlphaChoice, choose_alpha
from bake.types import Float32Array, Float64Array, SampleSet, World
from tests.worlds import make_world

RAYS = 8


def chosen(per_face: int, noisy: bool) -> tuple[AlphaChoice, World, SampleSet]:
    """The choice on a rolling field, from samples as noisy as few rays make them or from exact ones."""
    world = make_world(height_field(24, 24.0))
    settings = BakeSettings(rays=RAYS, samples_per_face=(per_face, per_face))
    samples = place_samples(world, settings)
    exact = truth_at(points_of(world, samples))
    noise = np.sqrt(STRATIFIED * exact * (1.0 - exact) / RAYS) * np.random.default_rng(1).standard_normal(len(exact))
    drawn = np.clip(exact + noise, 0.0, 1.0) if noisy else exact
    ao: Float32Array = np.repeat(drawn[:, None], 2, axis=1).astype(np.float32)
    valid = np.random.default_rng(2).random(len(samples)) > 0.05
    mapper = VertexMapper(world, samples, settings)
    return choose_alpha(world, samples, ao, valid, mapper, rays=RAYS), world, samples


def points_of(world: World, samples: SampleSet) -> Float64Array:
    """Where samples lie."""
    weights = np.column_stack([samples.barycentric, 1.0 - samples.barycentric.sum(axis=1)])
    return np.einsum("ij,ijk->ik", weights, world.positions[world.faces[samples.face]])


def truth_at(points: Float64Array) -> Float64Array:
    """AO that changes over a few faces, in (0, 1)."""
    return 0.55 + 0.3 * np.sin(0.9 * points[:, 0]) * np.cos(0.7 * points[:, 1])


def test_noisy_samples_ask_for_more_smoothing() -> None:
    """One sample of few rays a face asks for much more than many exact ones."""
    noisy, exact = chosen(1, noisy=True)[0], chosen(8, noisy=False)[0]
    assert noisy.alpha >= 0.1
    assert exact.alpha <= 0.03
    assert noisy.noise > 2.0 * exact.noise
    assert len(noisy.fields) == len(noisy.risk) == len(CANDIDATES)


def test_the_choice_is_nearly_the_best() -> None:
    """The chosen values come within a twentieth of the candidate that is closest to the truth."""
    choice, world, _ = chosen(1, noisy=True)
    expected = truth_at(world.positions)
    errors = [float(np.sqrt(np.mean((field.ao[:, 0] - expected) ** 2))) for field in choice.fields]
    assert errors[CANDIDATES.index(choice.alpha)] <= 1.05 * min(errors)


def test_the_same_samples_give_the_same_choice() -> None:
    """What is added is drawn from the seed alone."""
    one, two = chosen(1, noisy=True)[0], chosen(1, noisy=True)[0]
    np.testing.assert_array_equal(one.risk, two.risk)
