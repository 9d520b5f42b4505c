"""The kernels of the least squares solve, held to the NumPy solver."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

import bake.solve.face_descent
from bake.devices import cuda_devices, initialised_warp, resolve
from bake.samples import place_samples
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.solve import VertexMapper, box_choice, device_box
from bake.solve.conjugate_gradient import BoxSolution, BoxSolver
from bake.solve.device_box import DeviceBoxSolver
from bake.solve.proportioning import ProportioningState
from tests.solve.box_cases import grids
from tests.solve.solve_cases import ao_of, grid, random_samples
from tests.worlds import make_world

SCENES = Path(__file__).resolve().parents[2] / "../shared/scenes"
LATER: dict[str, Any] = {"within": 1e-6, "steps": 50}
BODIES = ["cores", "blocks", pytest.param("cuda", marks=pytest.mark.cuda)]


@pytest.fixture(params=BODIES)
def body(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """One thread a chunk, blocks of threads as on CUDA but on the CPU, and CUDA."""
    if request.param == "blocks":
        monkeypatch.setattr(initialised_warp().config, "enable_cpu_blocks", True)
    return request.param


def on_device(body: str, matrix: csr_array, first: np.ndarray) -> DeviceBoxSolver:
    """The solver with kernels; skips the test where the machine has no such device."""
    if body == "cuda" and not cuda_devices():
        pytest.skip("no CUDA device")
    device = cuda_devices()[0] if body == "cuda" else resolve("cpu")
    return DeviceBoxSolver(matrix.copy(), first, device, lanes=32 if body == "blocks" else None)


def alike(one: BoxSolution, other: BoxSolution, *, within: float = 1e-9, steps: int = 4) -> None:
    """Same values, ends and held values; rounding may cost or spare the last step or two, of two products each."""
    np.testing.assert_allclose(one.x, other.x, rtol=0, atol=within)
    assert abs(one.iterations - other.iterations) <= steps
    np.testing.assert_array_equal(one.held, other.held)
    np.testing.assert_array_equal(one.converged, other.converged)


def both(body: str, matrix: csr_array, rhs: np.ndarray, first: np.ndarray, **options: Any) -> None:
    """Solves by kernels and in NumPy and compares."""
    start = np.full(rhs.shape, 0.5)
    with mock.patch.object(ProportioningState, "begin", wraps=ProportioningState.begin) as taken_over:
        expected = list(BoxSolver(matrix.copy(), first).solve_all(rhs, start, **options))
    found = list(on_device(body, matrix, first).solve_all(rhs, start, **options))
    assert len(found) == len(expected) == rhs.shape[1]
    for one, other in zip(found, expected, strict=True):
        # what is left to steps within the box is solved in NumPy either way, from values that differ by rounding
        alike(one, other, **(LATER if taken_over.called else {}))


@given(
    seed=st.integers(0, 2**32 - 1),
    sides=st.lists(st.sampled_from([1, 2, 3, 9, 24, 40]), min_size=1, max_size=5),
    columns=st.integers(1, 3),
    smoothing=st.sampled_from([0.03, 1.0, 10.0]),
    in_places=st.booleans(),
)
@hypothesis_settings(max_examples=20)
def test_kernels_do_what_numpy_does(
    seed: int, sides: list[int], columns: int, smoothing: float, in_places: bool
) -> None:
    """Components of any size, one to three right-hand sides, by norm and by the largest miss."""
    matrix, rhs, first = grids(np.random.default_rng(seed), sides, columns, smoothing=smoothing)
    if in_places:
        both("cores", matrix, rhs, first, within=1e-11 * np.asarray(matrix.diagonal()))
    else:
        both("cores", matrix, rhs, first, tolerance=1e-11)


@pytest.mark.parametrize("in_places", [False, True])
def test_every_body_does_what_numpy_does(body: str, in_places: bool) -> None:
    """One thread or many a chunk, on the CPU and on CUDA; chunks that are full, and components of less than one."""
    matrix, rhs, first = grids(np.random.default_rng(7), [60, 1, 5, 30, 2], 2)
    within = 1e-11 * np.asarray(matrix.diagonal()) if in_places else None
    both(body, matrix, rhs, first, tolerance=1e-11, within=within)


def test_the_same_bits_every_time(body: str) -> None:
    """Nothing is summed in an order that depends on which thread comes first."""
    matrix, rhs, first = grids(np.random.default_rng(8), [70, 20], 2)
    solver = on_device(body, matrix, first)
    once, again = (list(solver.solve_all(rhs, np.full(rhs.shape, 0.5), tolerance=1e-11)) for _ in range(2))
    for one, other in zip(once, again, strict=True):
        np.testing.assert_array_equal(one.x, other.x)
        np.testing.assert_array_equal(one.residual, other.residual)


def test_it_does_not_matter_when_the_host_looks(monkeypatch: pytest.MonkeyPatch, body: str) -> None:
    """One step or thirty between two looks, and another right-hand side beside it, change no bit."""
    matrix, rhs, first = grids(np.random.default_rng(9), [40, 10], 2)
    solver, start = on_device(body, matrix, first), np.full(rhs.shape, 0.5)
    expected = list(solver.solve_all(rhs, start, tolerance=1e-11))
    for steps in (1, 30):
        monkeypatch.setattr(device_box, "AT_ONCE", steps)
        for one, other in zip(solver.solve_all(rhs, start, tolerance=1e-11), expected, strict=True):
            np.testing.assert_array_equal(one.x, other.x)
            assert one.iterations == other.iterations
    beside = np.column_stack([rhs[:, 0], 0.1 * rhs[:, 1]])
    np.testing.assert_array_equal(next(iter(solver.solve_all(beside, start, tolerance=1e-11))).x, expected[0].x)


def test_out_of_products_components_end_alike(body: str) -> None:
    """What does not converge within its products stops where NumPy stops, within the box."""
    matrix, rhs, first = grids(np.random.default_rng(10), [40, 3], 2, smoothing=1e3)
    both(body, matrix, rhs, first, tolerance=1e-11, most_iterations=25)


def test_steps_within_the_box_take_over(monkeypatch: pytest.MonkeyPatch, body: str) -> None:
    """Components that no projection is good enough for are solved in NumPy from where their face began."""
    matrix, rhs, first = grids(np.random.default_rng(11), [20, 3, 1], 2)
    expected = list(BoxSolver(matrix.copy(), first).solve_all(rhs, np.full(rhs.shape, 0.5), tolerance=1e-11))
    monkeypatch.setattr(bake.solve.face_descent, "SUFFICIENT", 2.0)
    found = list(
        on_device(body, matrix, first).solve_all(rhs, np.full(rhs.shape, 0.5), tolerance=1e-11, most_iterations=10_000)
    )
    for one, other in zip(found, expected, strict=True):
        assert one.converged.all()
        np.testing.assert_allclose(one.x, other.x, rtol=0, atol=1e-6)  # some weigh a millionth of the others
        np.testing.assert_array_equal(one.held, other.held)


@pytest.mark.shared
@pytest.mark.skipif(not SCENES.exists(), reason="the real scenes are not here")
@pytest.mark.parametrize("alpha", [0.03, 1.0])
@pytest.mark.parametrize("scene", ["godot_living_room/living_room.glb", "stk_mines/stk_mines.glb"])
def test_real_matrices(body: str, scene: str, alpha: float) -> None:
    """A room and a level with made-up AO, slivers, specks and unsampled vertices as they come."""
    if body == "blocks":
        pytest.skip("fibers take a minute for this")
    settings = BakeSettings(alpha=alpha)
    world = flatten(load_scene(SCENES / scene, crease_angle=settings.crease_angle), settings)
    samples = place_samples(world, settings)
    rng = np.random.default_rng(1)
    points = world.positions[world.faces[samples.face, 0]]
    ao = np.clip(0.5 + 0.7 * np.sin(points[:, :2]) + rng.normal(0, 0.15, (len(samples), 2)), 0, 1).astype(np.float32)
    valid = (rng.random(len(samples)) > 0.1) & (rng.random(world.face_count) > 0.05)[samples.face]
    mapper = VertexMapper(world, samples, settings)
    system, first = mapper.system(ao, valid), mapper.surface.first
    starved = mapper.equations(ao, valid).starved
    expected = BoxSolver(system.matrix.copy(), first)
    solver = on_device(body, system.matrix, first)
    for one, other in zip(
        solver.solve_all(system.rhs, system.average, tolerance=1e-11),
        expected.solve_all(system.rhs, system.average, tolerance=1e-11),
        strict=True,
    ):
        alike(one, other, within=1e-6)  # unknowns without samples weigh a millionth, and are solved for once more
        np.testing.assert_allclose(one.x[~starved], other.x[~starved], rtol=0, atol=1e-9)
        assert one.converged.all()


def test_the_mapping_is_the_same_by_either(monkeypatch: pytest.MonkeyPatch) -> None:
    """With every system sent to the kernels, starved patches too, a mapping's values are those of NumPy."""

    world = make_world(grid(12, 12))
    samples = random_samples(world, 4)
    ao = ao_of(world, samples, lambda p: 1.4 * p[:, 0] - 0.2, lambda p: np.abs(p[:, 1] - 0.5))
    valid = np.ones(len(samples), np.bool_)
    valid[np.isin(samples.face, np.arange(60, 90))] = False
    settings = BakeSettings(alpha=0.3, device="cpu")
    expected = VertexMapper(world, samples, settings).solve(ao, valid)
    monkeypatch.setattr(box_choice, "SMALLEST", {"cuda": 1, "cpu": 1})
    found = VertexMapper(world, samples, settings).solve(ao, valid)
    np.testing.assert_allclose(found.ao, expected.ao, rtol=0, atol=1e-7)
    np.testing.assert_array_equal(found.state, expected.state)
    assert found.report.bounded == expected.report.bounded
