"""Regularisation: its energy, its limits, and what it leaves alone."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from bake.region_types import PARAMETERS, RegionGraph, RegionModels
from bake.regions.colouring import colouring
from bake.regions.crossings import Crossings
from bake.regions.evaluate import basis
from bake.regions.fit import RIDGE, fit_regions
from bake.regions.gram import box_gram
from bake.regions.mismatch import boundary_mismatch
from bake.regions.regularise import link_weights, regularise
from bake.settings import BakeSettings
from tests.regions.synthetic import build_regions, chain, points_of, random_field, row_of_boxes

UNBOUNDED = {"largest_step": np.inf, "largest_slope": np.inf}


def random_graph(seed: int, count: int, links: int) -> RegionGraph:
    """Boxes anywhere, overlapping or far apart, with links between any of them, some of no area."""
    random = np.random.default_rng(seed)
    low = random.uniform(-20.0, 20.0, (count, 3))
    high = low + random.uniform(0.1, 12.0, (count, 3))
    pairs = np.unique(np.sort(random.integers(0, count, (links, 2)), axis=1), axis=0)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]].astype(np.int32).reshape(-1, 2)
    a, b = pairs.T
    share = random.random((len(pairs), 1))
    centre = share * 0.5 * (low[a] + high[a]) + (1.0 - share) * 0.5 * (low[b] + high[b])
    area = random.uniform(0.0, 9.0, len(pairs)) * (random.random(len(pairs)) < 0.9)
    names = tuple(f"r{i}" for i in range(count))
    return RegionGraph(names, low, high, 0.5 * (low + high), pairs, area, centre, "file")


def random_models(graph: RegionGraph, seed: int) -> RegionModels:
    """Models with any coefficients, some of whose terms no point determined."""
    random = np.random.default_rng(seed)
    count = len(graph)
    half = 0.5 * (graph.maximum - graph.minimum)
    determined = random.random((count, PARAMETERS)) < 0.85
    coefficients = random.normal(size=(count, PARAMETERS, 9, 2))
    coefficients[:, 1:] /= np.repeat(half, 2, axis=1)[:, :, None, None]
    coefficients[~determined] = 0.0
    share = random.uniform(0.2, 0.8, (count, 3))
    return RegionModels(
        centre=graph.minimum * share + graph.maximum * (1.0 - share),
        coefficients=coefficients.astype(np.float32),
        terms=np.packbits(determined, axis=1, bitorder="little")[:, 0],
        centre_kind=np.zeros(count, np.uint8),
        rmse=np.zeros((count, 2), np.float32),
    )


def random_crossings(graph: RegionGraph, seed: int) -> Crossings:
    """The middle of each boundary and places around it, some rows of which do not count."""
    random = np.random.default_rng(seed + 1)
    links = len(graph.link)
    position = graph.link_centre[:, None] + random.normal(size=(links, 5, 3))
    counts = random.random((links, 5)) < 0.7
    position[:, 0], counts[:, 0] = graph.link_centre, True
    return Crossings(position, counts)


@settings(max_examples=200, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(2, 12),
    links=st.integers(0, 30),
    beta=st.sampled_from([0.01, 1.0, 10.0, 1e4, 1e9]),
)
@example(seed=1048575, count=11, links=1, beta=0.01)  # a linked region without any point
def test_energy_never_rises(seed: int, count: int, links: int, beta: float) -> None:
    """On any graph, with any models and any β, no sweep ends with more energy than it began with."""
    graph = random_graph(seed, count, links)
    models = random_models(graph, seed)
    outcome = regularise(models, graph, beta=beta, sweeps=20, tolerance=0.0, crossings=random_crossings(graph, seed))
    before, after = outcome.energies.T
    assert (after <= before * (1.0 + 1e-9) + 1e-12).all()
    assert np.isfinite(outcome.models.coefficients).all()
    determined = np.unpackbits(models.terms[:, None], axis=1, count=PARAMETERS, bitorder="little").astype(bool)
    determined[:, 0] = True
    determined[models.terms == 0] = True  # a region without any point takes what suits its neighbours
    assert not outcome.models.coefficients[~determined].any()


def test_energy_is_that_of_the_definition() -> None:
    """The energies reported are E, computed anew from the models by sampling their boxes."""
    graph = random_graph(5, 6, 9)
    graph = dataclasses.replace(graph, link_area=graph.link_area + 1.0)
    models = random_models(graph, 5)
    models = dataclasses.replace(models, terms=np.full(6, 127, np.uint8))
    outcome = regularise(models, graph, beta=2.0, sweeps=3, tolerance=0.0, **UNBOUNDED)
    weights = link_weights(graph.link_area, graph.link, 6)

    def values(m: RegionModels, region: int, p: np.ndarray) -> np.ndarray:
        return np.einsum("np,pck->nck", basis(p - m.centre[region]), m.coefficients[region].astype(np.float64))

    share = (np.indices((40, 40, 40)).reshape(3, -1).T + 0.5) / 40
    energy = 0.0
    for region in range(6):
        p = graph.minimum[region] + share * (graph.maximum - graph.minimum)[region]
        change = values(outcome.models, region, p) - values(models, region, p)
        energy += (change**2).mean(axis=0).sum()
        half = 0.5 * (graph.maximum - graph.minimum)[region]
        slopes = (outcome.models.coefficients - models.coefficients)[region, 1:] * np.repeat(half, 2)[:, None, None]
        energy += RIDGE * (slopes.astype(np.float64) ** 2).sum()
    for (a, b), weight, at in zip(graph.link, weights, graph.link_centre, strict=True):
        apart = values(outcome.models, a, at[None]) - values(outcome.models, b, at[None])
        energy += 2.0 * weight * (apart**2).sum()
    assert outcome.energies[-1, 1] == pytest.approx(energy / (4.0 * np.pi), rel=2e-3)


def test_it_converges_to_the_minimum() -> None:
    """Many sweeps reach what a general optimiser finds for one function on a small graph."""
    graph = chain(np.array([[0.0, 0, 0], [3.5, 0, 0]]), np.array([[4.0, 3, 5], [9.0, 3, 4]]))
    models = random_models(graph, 1)
    models = dataclasses.replace(
        models, coefficients=models.coefficients[..., :1], terms=np.full(2, 127, np.uint8), rmse=models.rmse[:, :1]
    )
    models.coefficients[:, :, 1:] = 0.0
    outcome = regularise(models, graph, beta=1.0, sweeps=2000, tolerance=0.0, **UNBOUNDED)
    half = 0.5 * (graph.maximum - graph.minimum)
    gram = box_gram(graph.minimum, graph.maximum, models.centre, half) + RIDGE * np.diag([0.0] + [1.0] * 6)
    lengths = np.concatenate([np.ones((2, 1)), np.repeat(half, 2, axis=1)], axis=1)
    start = models.coefficients[:, :, 0, 0] * lengths
    phi = basis((graph.link_centre - models.centre) / half)
    weight = link_weights(graph.link_area, graph.link, 2)[0]

    def energy(x: np.ndarray) -> float:
        d = x.reshape(2, 7)
        change = d - start
        quadratic = np.einsum("ri,rij,rj->", change, gram, change)
        return float(quadratic + weight * (phi[0] @ d[0] - phi[1] @ d[1]) ** 2)

    found = minimize(energy, start.ravel(), method="BFGS", options={"gtol": 1e-10}).x.reshape(2, 7)
    np.testing.assert_allclose(outcome.models.coefficients[:, :, 0, 0] * lengths, found, atol=1e-4)


def test_beta_zero_returns_the_fit() -> None:
    """Without weight on agreement, the models are those of the fit, bit by bit."""
    regions = build_regions(6)
    outcome = regularise(regions.fitted, regions.graph, beta=0.0)
    assert outcome.models is regions.fitted
    np.testing.assert_array_equal(outcome.mismatch, regions.mismatch_before)


def test_large_beta_makes_neighbours_agree() -> None:
    """As β grows, the mismatch goes to zero at every boundary, on a ring with chords too."""
    regions = build_regions(8)
    link = np.array([[i, i + 1] for i in range(7)] + [[0, 7], [1, 4], [2, 6]], np.int32)
    centre = 0.25 * (regions.graph.minimum + regions.graph.maximum)[link].sum(axis=1)
    graph = dataclasses.replace(regions.graph, link=link, link_area=np.linspace(1, 9, 10), link_centre=centre)
    before = boundary_mismatch(regions.fitted, graph).max()
    worst = [regularise(regions.fitted, graph, beta=beta, sweeps=400).mismatch.max() for beta in (0.1, 1e2, 1e6)]
    assert before > 0.05
    assert before > worst[0] > worst[1] > worst[2]
    assert worst[2] < 1e-3


def test_what_has_no_neighbour_stays() -> None:
    """Regions without links, and links without area, are left as they are."""
    regions = build_regions(4)
    graph = dataclasses.replace(regions.graph, link_area=np.array([0.0, 3.0, 0.0]))
    outcome = regularise(regions.fitted, graph, beta=10.0)
    for alone in (0, 3):
        np.testing.assert_array_equal(outcome.models.coefficients[alone], regions.fitted.coefficients[alone])
    assert (outcome.models.coefficients[1] != regions.fitted.coefficients[1]).any()


def test_neither_scale_nor_place_matters() -> None:
    """A level a hundred times as large, a million metres away, is regularised to the same AO."""
    plain, far = row_of_boxes(5), row_of_boxes(5, size=(400.0, 300.0, 500.0), at=1e6)
    field = random_field(4)
    outcome = []
    for graph, scale, at in ((plain, 1.0, 0.0), (far, 100.0, 1e6)):
        points = points_of(graph, lambda p, scale=scale, at=at: field((p - at) / scale))
        outcome.append(regularise(fit_regions(points, graph, BakeSettings()), graph, beta=1.0, largest_slope=np.inf))
    np.testing.assert_allclose(outcome[0].mismatch, outcome[1].mismatch, atol=2e-5)
    np.testing.assert_allclose(outcome[0].energies[-1, 1], outcome[1].energies[-1, 1], rtol=1e-3)


def test_absorbed_regions_are_regularised_as_one() -> None:
    """Regions that share a model still share it afterwards, and the link between them has no mismatch."""
    regions = build_regions(5)
    owner = np.array([0, 0, 2, 3, 3], np.int32)
    fitted = fit_regions(regions.points, regions.graph, BakeSettings(), owner=owner)
    outcome = regularise(fitted, regions.graph, beta=1.0, owner=owner)
    for a, b in ((0, 1), (3, 4)):
        np.testing.assert_array_equal(outcome.models.coefficients[a], outcome.models.coefficients[b])
    assert outcome.mismatch[0].max() == outcome.mismatch[3].max() == 0.0
    assert outcome.mismatch[1:3].max() < boundary_mismatch(fitted, regions.graph)[1:3].max()


def test_tolerance_ends_it() -> None:
    """It ends when nothing moves by more than the tolerance, and a looser one ends sooner."""
    regions = build_regions(12)
    counts = [
        len(regularise(regions.fitted, regions.graph, beta=1.0, sweeps=500, tolerance=t, **UNBOUNDED).energies)
        for t in (1e-2, 1e-4, 1e-8)
    ]
    assert counts[0] < counts[1] < counts[2] < 500


@pytest.mark.parametrize("seed", range(5))
def test_gram_matrix_by_sampling(seed: int) -> None:
    """The closed form of the mean products equals their mean over many points, wherever the centre lies."""
    random = np.random.default_rng(seed)
    low, high, half = np.array([[-1.0, 2.0, 0.0]]), np.array([[3.0, 5.0, 0.5]]), np.array([[2.0, 1.5, 0.25]])
    centre = low + random.uniform(-0.3, 1.3, (1, 3)) * (high - low)
    share = (np.indices((60, 60, 60)).reshape(3, -1).T + 0.5) / 60
    phi = basis((low + share * (high - low) - centre) / half)
    np.testing.assert_allclose(box_gram(low, high, centre, half)[0], phi.T @ phi / len(phi), atol=2e-3)


@given(seed=st.integers(0, 1000), count=st.integers(1, 40), links=st.integers(0, 120))
@settings(max_examples=50, deadline=None)
def test_colours_keep_neighbours_apart(seed: int, count: int, links: int) -> None:
    """No link joins two regions that are set side by side."""
    graph = random_graph(seed, count, links)
    colour = colouring(count, graph.link)
    assert (colour >= 0).all()
    assert (colour[graph.link[:, 0]] != colour[graph.link[:, 1]]).all()
