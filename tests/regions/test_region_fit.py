"""Fitting a region's model: what it represents, what it can do without, and where it stays stable."""

from __future__ import annotations

import numpy as np
import pytest

from bake import spherical_harmonics
from bake.region_types import GRID, CentreKind, PointState, RegionGraph, RegionPoints
from bake.regions.empty import OPEN
from bake.regions.evaluate import AXIS_NORMALS, basis, evaluate
from bake.regions.fit import RIDGE, UNSEEN, fit_regions, solve
from bake.regions.grid import grid_positions
from bake.regions.moments import sum_points
from bake.settings import BakeSettings
from tests.regions.synthetic import chain, points_of, random_field, row_of_boxes

SETTINGS = BakeSettings()


def slopes(value: float, along: np.ndarray, *, distances: int = 2):
    """A field whose AO is the same about every normal and linear in position."""

    def field(positions: np.ndarray) -> np.ndarray:
        sh = np.zeros((len(positions), 9, distances))
        sh[:, 0] = ((value + positions @ along) * OPEN)[:, None]
        return sh

    return field


def plain_fit(points: RegionPoints, graph: RegionGraph, region: int, centre: np.ndarray) -> np.ndarray:
    """The model of one region by stacking a row a point: with data, without, and the ridge's."""
    of = points.traced // GRID**3 == region
    use = of & (points.state[points.traced] == PointState.VALID)
    half = 0.5 * (graph.maximum - graph.minimum)[region]
    rows = basis((grid_positions(graph)[points.traced[use]] - centre) / half)
    ridge = np.sqrt(RIDGE * len(rows)) * np.eye(7)[1:]
    values = points.sh[use].reshape(len(rows), -1).astype(np.float64)
    others = np.setdiff1d(np.arange(region * GRID**3, (region + 1) * GRID**3), points.traced[use])
    weight = np.sqrt(UNSEEN / GRID**3 * len(rows))
    empty = weight * basis((grid_positions(graph)[others] - centre) / half)
    wanted = weight * np.tile(values.mean(axis=0), (len(others), 1))
    right = np.concatenate([values, wanted, np.zeros((6, values.shape[1]))])
    found = np.linalg.lstsq(np.concatenate([rows, empty, ridge]), right, rcond=None)[0].reshape(7, 9, -1)
    found[1:] /= np.repeat(half, 2)[:, None, None]
    return found


@pytest.mark.parametrize("invalid", [0.0, 0.4])
def test_equals_plain_least_squares(invalid: float) -> None:
    """The sums by grid planes give the model that a row a point gives, and its error is the residual's."""
    graph = row_of_boxes(3)
    valid = np.random.default_rng(3).random(3 * GRID**3) >= invalid
    points = points_of(graph, random_field(2), valid=valid)
    models = fit_regions(points, graph, SETTINGS)
    for region in range(3):
        plain = plain_fit(points, graph, region, models.centre[region])
        np.testing.assert_allclose(models.coefficients[region], plain, atol=2e-6)
        of = points.traced // GRID**3 == region
        residual = [
            evaluate(models, region, grid_positions(graph)[points.traced[of]], normal, clamp=False)
            - np.einsum("c,nck->nk", spherical_harmonics.evaluate(normal[None])[0], points.sh[of])
            for normal in AXIS_NORMALS
        ]
        np.testing.assert_allclose(models.rmse[region], np.sqrt(np.mean(np.square(residual), axis=(0, 1))), rtol=1e-4)


def test_constant_region() -> None:
    """Where AO is the same everywhere, all derivatives are zero."""
    graph = row_of_boxes(2)
    models = fit_regions(points_of(graph, slopes(0.6, np.zeros(3))), graph, SETTINGS)
    assert np.abs(models.coefficients[:, 1:]).max() < 1e-6
    np.testing.assert_allclose(evaluate(models, 0, graph.maximum[:1], [0.0, 1.0, 0.0]), 0.6, atol=1e-6)
    assert models.rmse.max() < 1e-4


def test_gradient_at_a_million_metres() -> None:
    """Far from the origin the same gradient is found, to the ridge, as at it."""
    along = np.array([0.05, -0.02, 0.03])
    for at in (0.0, 1e6):
        graph = row_of_boxes(1, at=at)
        offset = 0.5 - along.sum() * at
        models = fit_regions(points_of(graph, slopes(offset, along)), graph, SETTINGS)
        found = models.coefficients[0, 1:, 0, 0] / OPEN
        np.testing.assert_allclose(found, np.repeat(along, 2), rtol=5e-3)
        truth = offset + graph.minimum @ along
        np.testing.assert_allclose(evaluate(models, 0, graph.minimum, [0.0, 0.0, 1.0])[:, 0], truth, atol=1e-3)


def test_centre_of_mass_is_chosen() -> None:
    """AO that bends where the valid points gather is fitted about their centre of mass."""
    graph = row_of_boxes(1, size=(8.0, 8.0, 8.0))
    positions = grid_positions(graph)
    valid = (positions < 4.0).all(axis=1)
    kink = np.array([2.0, 2.0, 2.0])

    def field(p: np.ndarray) -> np.ndarray:
        sh = np.zeros((len(p), 9, 2))
        sh[:, 0] = ((0.9 - 0.1 * np.abs(p - kink).sum(axis=1)) * OPEN)[:, None]
        return sh

    models = fit_regions(points_of(graph, field, valid=valid), graph, SETTINGS)
    assert models.centre_kind[0] == CentreKind.MASS
    np.testing.assert_allclose(models.centre[0], kink)
    assert models.rmse.max() < 0.03  # seven of eight grid points are not valid and want the mean


def test_optimised_centre() -> None:
    """A search finds the bend that neither candidate has, and never ends with a larger error."""
    graph = row_of_boxes(4, size=(8.0, 6.0, 4.0))
    kink = np.array([[2.3, 3.6, 1.7]]) + np.arange(4)[:, None] * [8.0, 0.0, 0.0]

    def field(p: np.ndarray) -> np.ndarray:
        room = np.minimum(p[:, 0] // 8.0, 3).astype(int)
        sh = np.zeros((len(p), 9, 2))
        sh[:, 0] = ((0.9 - 0.08 * np.abs(p - kink[room]).sum(axis=1)) * OPEN)[:, None]
        return sh

    points = points_of(graph, field)
    plain = fit_regions(points, graph, SETTINGS)
    found = fit_regions(points, graph, SETTINGS.replaced(optimise_centre=True))
    assert (found.centre_kind == CentreKind.OPTIMISED).all()
    np.testing.assert_allclose(found.centre, kink, atol=0.15)
    assert (found.rmse < 0.35 * plain.rmse).all()


@pytest.mark.parametrize("seed", range(3))
def test_optimising_never_harms(seed: int) -> None:
    """On any field the optimised error is at most that of the better candidate."""
    graph = row_of_boxes(3)
    points = points_of(graph, random_field(seed, wiggle=1.5))
    plain = fit_regions(points, graph, SETTINGS).rmse
    found = fit_regions(points, graph, SETTINGS.replaced(optimise_centre=True)).rmse
    assert ((found**2).sum(axis=1) <= (plain**2).sum(axis=1) * (1.0 + 1e-5)).all()


def one_box_with(chosen: np.ndarray, along: np.ndarray):
    """The model of one box in which only the chosen grid points, shape (n, 3) of plane numbers, are valid."""
    graph = row_of_boxes(1)
    valid = np.zeros((GRID, GRID, GRID), bool)
    valid[tuple(chosen.T)] = True
    points = points_of(graph, slopes(0.5, along), valid=valid.ravel())
    return graph, points, fit_regions(points, graph, SETTINGS)


ALONG = np.array([0.05, -0.02, 0.03])


@pytest.mark.parametrize(
    ("chosen", "bits"),
    [
        ([[2, 5, 6]], {0}),
        ([[2, 5, 6], [6, 5, 6]], {0, 1, 2}),
        ([[2, 3, 1], [2, 3, 6], [2, 6, 1], [2, 6, 6]], {0, 3, 4, 5, 6}),  # coplanar, across x
        ([[1, 1, 1], [1, 6, 6], [6, 1, 6], [6, 6, 1]], set(range(7))),
    ],
    ids=["one", "two", "coplanar", "tetrahedron"],
)
def test_few_points(chosen: list[list[int]], bits: set[int]) -> None:
    """With few points the model hits them, stays tame elsewhere, and says which terms they determined."""
    graph, _, models = one_box_with(np.array(chosen), ALONG)
    assert {j for j in range(7) if models.terms[0] >> j & 1} <= bits
    assert models.terms[0] & 1
    assert models.rmse.max() < 5e-3
    corners = np.stack(np.meshgrid(*zip(graph.minimum[0], graph.maximum[0], strict=True)), axis=-1).reshape(-1, 3)
    values = evaluate(models, 0, corners, [0.0, 1.0, 0.0], clamp=False)
    assert np.abs(values - 0.5).max() < 0.5
    undetermined = [j for j in range(7) if not models.terms[0] >> j & 1]
    assert not models.coefficients[0, undetermined].any()


def test_one_sided_points() -> None:
    """Points on one side of the middle determine that side alone, or a centre among them both."""
    chosen = np.argwhere(np.ones((3, GRID, GRID), bool))
    graph, _, models = one_box_with(chosen, ALONG)
    assert models.rmse.max() < 3e-3
    value = evaluate(models, 0, graph.minimum, [0.0, 1.0, 0.0])[0, 0]
    assert value == pytest.approx(0.5 + graph.minimum[0] @ ALONG, abs=0.01)
    design = np.eye(7)[None].copy()
    design[0, 2, 2] = 0.0
    _, determined = solve(design, np.ones((1, 7, 9, 1)), np.zeros((1, 7, 7)))
    assert determined[0].tolist() == [True, True, False, True, True, True, True]


def test_regions_without_points() -> None:
    """They take what their neighbours say at the boundary, ring by ring; what nothing is linked to is open."""
    size, low = np.array([4.0, 3.0, 5.0]), np.array([[0.0, 0, 0], [4, 0, 0], [8, 0, 0], [50, 0, 0]])
    linked = chain(low[:3], low[:3] + size)
    graph = RegionGraph(
        names=("hall", "empty", "further", "lost"),
        minimum=low,
        maximum=low + size,
        seed=low + 1.0,
        link=linked.link,
        link_area=linked.link_area,
        link_centre=linked.link_centre,
        origin="file",
    )
    valid = np.repeat([True, False, False, False], GRID**3)
    models = fit_regions(points_of(graph, slopes(0.5, ALONG), valid=valid), graph, SETTINGS)
    at_boundary = 0.5 + graph.link_centre[0] @ ALONG
    for region in (1, 2):
        value = evaluate(models, region, graph.seed[[region]], [1.0, 0.0, 0.0])[0, 0]
        assert value == pytest.approx(at_boundary, abs=1e-3)
    assert evaluate(models, 3, graph.seed[3:], [1.0, 0.0, 0.0]).tolist() == [[1.0, 1.0]]
    assert models.terms.tolist() == [127, 0, 0, 0]
    assert np.isnan(models.rmse[1:]).all()
    assert np.isfinite(models.rmse[0]).all()


def test_flat_box() -> None:
    """A box without height has no derivative along it."""
    low = np.zeros((1, 3))
    graph = chain(low, low + np.array([4.0, 0.0, 5.0]))
    models = fit_regions(points_of(graph, slopes(0.5, ALONG)), graph, SETTINGS)
    assert models.terms[0] == 0b1100111
    assert np.isfinite(models.coefficients).all()
    assert models.rmse.max() < 1e-4


def test_absorbed_regions_share_a_model() -> None:
    """A group is fitted once, to all of its points by the space that they stand for, and its error told by region."""
    graph = row_of_boxes(3)
    points = points_of(graph, slopes(0.5, ALONG))
    models = fit_regions(points, graph, SETTINGS, owner=np.array([0, 0, 2], np.int32))
    np.testing.assert_array_equal(models.coefficients[0], models.coefficients[1])
    np.testing.assert_array_equal(models.centre[0], models.centre[1])
    assert models.centre[0, 0] == pytest.approx(4.0)
    assert models.rmse[:2].max() < 2e-3


def test_points_at_a_threshold_of_validity_count_not() -> None:
    """Points that saw too many back faces were traced, but take no part."""
    graph = row_of_boxes(1)
    points = points_of(graph, random_field(1))
    points.state[::2] = PointState.BACK_FACES
    moments = sum_points(points, graph)
    assert moments.count.tolist() == [GRID**3 / 2]
    fewer = points_of(graph, random_field(1), valid=points.state == PointState.VALID)
    np.testing.assert_allclose(sum_points(fewer, graph).cross, moments.cross, atol=1e-12)


def test_a_slope_in_a_corner_does_not_run_wild() -> None:
    """A few points in one corner of a large box suggest a steep slope; across the box it stays within bounds."""
    low = np.zeros((1, 3))
    graph = chain(low, low + 60.0)
    valid = np.zeros((GRID, GRID, GRID), bool)
    valid[6:, :3, :2] = True
    along = np.array([0.0, 0.02, 0.0])
    points = points_of(graph, slopes(0.4, along), valid=valid.ravel())
    models = fit_regions(points, graph, SETTINGS)
    there = evaluate(models, 0, grid_positions(graph)[points.traced], [0.0, 1.0, 0.0])[:, 0]
    np.testing.assert_allclose(there, 0.4 + grid_positions(graph)[points.traced] @ along, atol=0.08)
    corners = np.stack(np.meshgrid(*[[0.0, 60.0]] * 3), axis=-1).reshape(-1, 3)
    values = evaluate(models, 0, corners, [0.0, 1.0, 0.0], clamp=False)
    assert -0.1 < values.min() < values.max() < 1.3
