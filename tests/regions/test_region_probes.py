"""Region points as they are traced: convolution, ringing, seeds, and what models make of real rooms."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bake import spherical_harmonics
from bake.devices import resolve
from bake.geometry import sphere_direction
from bake.low_discrepancy import owen_sobol
from bake.region_types import GRID, PointState, RegionGraph, RegionPoints
from bake.regions.convolution import CLAMPED_COSINE, convolve
from bake.regions.evaluate import AXIS_NORMALS, ambient_obscurance, evaluate
from bake.regions.fit import fit_regions
from bake.regions.grid import grid_positions
from bake.regions.probes import judged, point_seeds, trace_points
from bake.regions.windowing import DIP, lowest, window
from bake.settings import BakeSettings, Kernel
from bake.trace import create_tracer
from bake.types import BoolArray, World
from tests.regions.synthetic import row_of_boxes
from tests.worlds import box, make_world, quad

DIRECTIONS = sphere_direction(*owen_sobol(np.arange(1 << 14), np.full(1 << 14, 5)))
BASIS = spherical_harmonics.evaluate(DIRECTIONS)


def project(values: np.ndarray) -> np.ndarray:
    """Harmonics of functions given at `DIRECTIONS`, shape (n, directions) → (n, 9, 1)."""
    return (4.0 * math.pi / len(DIRECTIONS) * values @ BASIS)[:, :, None]


def trace(
    world: World,
    graph: RegionGraph,
    bake: BakeSettings,
    *,
    reachable: BoolArray | None = None,
    body: str = "embree",
) -> RegionPoints:
    """Traces all points of a graph, or those said."""
    reachable = np.ones(len(graph) * GRID**3, bool) if reachable is None else reachable
    with create_tracer(world, bake.replaced(tracer=body), resolve("cpu")) as tracer:
        work = trace_points(graph, reachable, tracer, bake)
        done = 0
        while True:
            try:
                done = next(work)
            except StopIteration as end:
                assert done == np.count_nonzero(reachable)
                return end.value


@pytest.mark.parametrize("way", [(0.0, 1.0, 0.0), (0.6, 0.0, -0.8), (0.48, 0.6, 0.64)])
def test_twice_known_signals(way: tuple[float, float, float]) -> None:
    """Convolving 1, a cosine and a Legendre polynomial multiplies them by π, 2π/3 and π/4."""
    cosine = DIRECTIONS @ np.array(way)
    at_way = spherical_harmonics.evaluate(np.array([way]))[0]
    for signal, factor in (
        (np.ones(len(cosine)), math.pi),
        (cosine, 2.0 * math.pi / 3.0),
        (1.5 * cosine**2 - 0.5, math.pi / 4.0),
    ):
        sh = project(signal[None])
        known = 4.0 * math.pi * np.mean(signal * np.maximum(cosine, 0.0))  # the integral itself, about `way`
        assert known == pytest.approx(factor, rel=2e-3)
        found = at_way @ (sh[0, :, 0] * CLAMPED_COSINE)
        assert found == pytest.approx(factor, rel=2e-3)
        assert at_way @ convolve(sh)[0, :, 0] == pytest.approx(factor / math.pi, rel=2e-3)


@pytest.mark.parametrize("normal", [(0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (0.6, 0.8, 0.0)])
def test_ground_plane_is_exact_in_linear_harmonics(normal: tuple[float, float, float]) -> None:
    """Over endless ground, AO about any normal is (1 + n.y) / 2, from four coefficients."""
    graph = row_of_boxes(1)
    points = trace(
        make_world(quad(4e4)),
        dataclasses.replace(graph, minimum=graph.minimum + 0.5, maximum=graph.maximum + 0.5),
        BakeSettings(kernel=Kernel.OCCLUSION, max_distance=1e5, region_directions=4096),
    )
    assert (points.state == PointState.VALID).all()
    normals = np.tile(np.array(normal), (len(points.sh), 1))
    linear = ambient_obscurance(points.sh, normals, bands=2)
    np.testing.assert_allclose(linear, 0.5 + 0.5 * normal[1], atol=2e-3)
    models = fit_regions(points, graph, BakeSettings())
    found = evaluate(models, 0, graph.seed, np.array([normal]), bands=2)
    np.testing.assert_allclose(found, 0.5 + 0.5 * normal[1], atol=2e-3)


def test_room_with_six_walls() -> None:
    """Bright in the middle and dark toward each wall: half the error, at most, of a single gradient."""
    size = np.array([6.0, 3.0, 8.0])
    world = make_world(box((6.0, 3.0, 8.0), inward=True, centre=(3.0, 1.5, 4.0)))
    graph = row_of_boxes(1, size=(6.0, 3.0, 8.0))
    points = trace(world, graph, BakeSettings(distances=(2.0,), region_directions=512))
    assert (points.state == PointState.VALID).all()
    models = fit_regions(points, graph, BakeSettings())
    positions = (grid_positions(graph) - 0.5 * size) / size
    rows = np.concatenate([np.ones((len(positions), 1)), positions], axis=1)
    flat = points.sh.reshape(len(rows), -1).astype(np.float64)
    residual = flat - rows @ np.linalg.lstsq(rows, flat, rcond=None)[0]
    at_normals = np.einsum("nc,pc->pn", spherical_harmonics.evaluate(AXIS_NORMALS), residual)
    gradient = math.sqrt((at_normals**2).mean())
    assert float(models.rmse[0, 0]) < 0.5 * gradient
    centre = evaluate(models, 0, 0.5 * size[None], [0.0, 1.0, 0.0])[0, 0]
    assert evaluate(models, 0, np.array([[3.0, 1.5, 0.3]]), [0.0, 0.0, -1.0])[0, 0] < centre


def test_points_behind_faces_drop_out() -> None:
    """Of a region half sunk into a block, the sunk points are judged by what they see, and again at will."""
    world = make_world(quad(100.0, -0.5), box((4.0, 3.0, 5.0), centre=(0.0, 1.5, 2.5)))
    graph = row_of_boxes(1)
    points = trace(world, graph, BakeSettings(region_directions=64))
    sunk = grid_positions(graph)[:, 0] < 2.0
    np.testing.assert_array_equal(points.state == PointState.BACK_FACES, sunk)
    assert (points.back_face_share[sunk] > 0.9).all()
    assert not (judged(points, 1.0).state == PointState.BACK_FACES).any()
    np.testing.assert_array_equal(judged(judged(points, 1.0), 0.25).state, points.state)


def test_only_reachable_points_are_traced() -> None:
    """The others cost no ray, and what they hold is said to be unknown."""
    reachable = np.random.default_rng(1).random(2 * GRID**3) < 0.3
    graph = row_of_boxes(2)
    points = trace(make_world(quad(50.0, -0.5)), graph, BakeSettings(region_directions=16), reachable=reachable)
    np.testing.assert_array_equal(points.traced, np.flatnonzero(reachable))
    np.testing.assert_array_equal(points.state == PointState.UNREACHABLE, ~reachable)
    assert not points.back_face_share[~reachable].any()


def test_tracers_agree_on_points() -> None:
    """The fast tracer and brute force give the same harmonics."""
    world = make_world(quad(30.0, -0.5), box((1.0, 1.0, 1.0), centre=(5.0, 1.0, 2.0)))
    graph = row_of_boxes(1)
    bake = BakeSettings(region_directions=64)
    reachable = np.zeros(GRID**3, bool)
    reachable[::16] = True
    fast, plain = (trace(world, graph, bake, reachable=reachable, body=body) for body in ("embree", "brute"))
    np.testing.assert_allclose(fast.sh, plain.sh, atol=1e-4)


def test_seeds_are_a_regions_own() -> None:
    """Other regions, however many and in whatever order, do not change a region's rays."""
    two, more = point_seeds(("hall", "yard"), 1), point_seeds(("attic", "yard", "hall"), 1)
    one = GRID**3
    np.testing.assert_array_equal(two[:one], more[2 * one :])
    np.testing.assert_array_equal(two[one:], more[one : 2 * one])
    assert len(np.unique(two)) == 2 * one
    assert (point_seeds(("hall",), 2) != two[:one]).any()


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), width=st.floats(0.02, 3.1))
@example(seed=105, width=0.96875)  # least values along a valley
def test_window_takes_negative_values_away(seed: int, width: float) -> None:
    """Whatever is open around a point, its AO about no normal falls below zero; the mean over normals stays."""
    random = np.random.default_rng(seed)
    ways = random.normal(size=(20, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    opening = (math.cos(width) < DIRECTIONS @ ways.T) | (random.random(len(DIRECTIONS)) < 0.002)[:, None]
    sh = convolve(project(opening.T * random.random((1, len(DIRECTIONS)))))
    windowed, flags = window(sh)
    values = windowed[:, :, 0] @ BASIS.T
    assert values.min() > -1.1 * DIP
    np.testing.assert_array_equal(windowed[:, 0], sh[:, 0])
    dips = (sh[:, :, 0] @ BASIS.T).min(axis=1) < -1.1 * DIP
    assert flags[dips].all()
    np.testing.assert_array_equal(windowed[flags == 0], sh[flags == 0])
    factor = windowed[flags == 1, 1:] / sh[flags == 1, 1:]
    assert (factor >= 0.86).all()
    np.testing.assert_allclose(factor, np.broadcast_to(factor[:, :1], factor.shape), rtol=1e-9)


def test_worst_ringing() -> None:
    """An opening toward a single direction dips to -3.96 % of its peak, 8/15 behind it, and needs 0.863."""
    way = DIRECTIONS[[7]]
    sh = convolve(spherical_harmonics.evaluate(way)[:, :, None])
    least = lowest(sh[:, :, 0])[0]
    peak = 1.0 / math.pi  # of the clamped cosine itself: the opening holds one unit of light
    assert least / peak == pytest.approx(-0.0396, abs=2e-4)
    windowed, flags = window(sh)
    assert flags.tolist() == [1]
    assert (windowed / sh)[0, 5, 0] == pytest.approx(0.863, abs=1e-3)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_lowest_value(seed: int) -> None:
    """What is called the lowest value is not above any of many others, yet close to the lowest of them."""
    functions = np.random.default_rng(seed).normal(size=(10, 9))
    values = (functions @ BASIS.T).min(axis=1)
    found = lowest(functions)
    assert (found <= values + 1e-3).all()
    assert (found >= values - 0.01).all()
