"""From samples to vertices, as the pipeline calls it."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.errors import SolveError
from bake.settings import BakeSettings, MappingKind
from bake.solve import VertexMapper, map_to_vertices
from bake.types import ObjectKeys, Role, SampleSet, VertexState, World
from tests.solve.solve_cases import ao_of, grid, moved, points, random_samples, soup
from tests.worlds import box, icosphere, make_world

BOTH = pytest.mark.parametrize("mapping", list(MappingKind))


def solve(world: World, samples: SampleSet, ao: np.ndarray, valid: np.ndarray | None = None, **settings: object):
    """The field of one call."""
    everything = np.ones(len(samples), bool) if valid is None else valid
    return map_to_vertices(world, samples, ao, everything, BakeSettings(**settings))


def bumpy(p: np.ndarray) -> np.ndarray:
    """A smooth function with values from 0.05 to 0.95."""
    return 0.5 + 0.45 * np.sin(5 * p[:, 0] + 1) * np.cos(4 * p[:, 1] - p[:, 2])


@BOTH
@pytest.mark.parametrize("alpha", [0.0, 0.03, 1.0])
@given(value=st.floats(0.0, 1.0), seed=st.integers(0, 2**32 - 1))
def test_constants_are_reproduced(mapping: MappingKind, alpha: float, value: float, seed: int) -> None:
    """By both mappings, with few samples, some of them invalid, on a closed surface."""
    world = make_world(icosphere(1))
    samples = random_samples(world, 2, seed=seed)
    valid = np.random.default_rng(seed).random(len(samples)) > 0.3
    ao = np.full((len(samples), 2), value, np.float32)
    field = solve(world, samples, ao, valid, alpha=alpha, mapping=mapping)
    np.testing.assert_allclose(field.ao, value, atol=1e-6)


@pytest.mark.parametrize("alpha", [0.0, 0.03, 1.0])
def test_least_squares_reproduces_linear_functions_on_flat_patches(alpha: float) -> None:
    """Whatever alpha is, on an irregular grid stored as loose triangles, to 1e-6."""
    positions, faces = grid(9, 7)
    positions[:, :2] += np.random.default_rng(1).uniform(-0.03, 0.03, (len(positions), 2))
    world = make_world(soup(positions, faces))
    samples = random_samples(world, 5)
    linear = (lambda p: 0.2 + 0.5 * p[:, 0] + 0.1 * p[:, 1], lambda p: 0.9 - 0.7 * p[:, 1])
    field = solve(world, samples, ao_of(world, samples, *linear), alpha=alpha)
    for k, function in enumerate(linear):
        np.testing.assert_allclose(field.ao[:, k], function(world.positions), atol=1e-6)


def test_the_teaching_example_in_one_dimension() -> None:
    """Samples .6 .5 .7 1 along an edge: the least squares line leaves their range, the average does not."""
    world = make_world((np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])))
    t = np.array([0.125, 0.375, 0.625, 0.875])
    value = np.array([0.6, 0.5, 0.7, 1.0])
    samples = SampleSet(
        face=np.zeros(4, np.int32),
        barycentric=np.column_stack([1 - t, t]).astype(np.float32),
        area=np.full(4, 0.25, np.float32),
        index=np.arange(4, dtype=np.int32),
        face_seed=np.zeros(1, np.uint32),
    )
    ao = value[:, None].astype(np.float32)
    line = solve(world, samples, ao, alpha=0.0)
    slope, start = np.polyfit(t, value, 1)
    np.testing.assert_allclose(line.ao[:2, 0], [start, start + slope], atol=1e-5)
    np.testing.assert_allclose(line.ao[:2, 0], [0.42, 0.98], atol=1e-5)
    assert line.ao[0, 0] < value.min()
    average = solve(world, samples, ao, mapping=MappingKind.AVERAGE).ao[:2, 0]
    np.testing.assert_allclose(average, [((1 - t) * value).sum() / 2, (t * value).sum() / 2], atol=1e-6)
    assert value.min() < average.min() and average.max() < value.max()
    assert line.state.tolist() == [VertexState.BAKED, VertexState.BAKED, VertexState.FILLED]


@pytest.mark.parametrize("shape", [grid(6, 6), icosphere(1)])
def test_alpha_zero_is_the_least_squares_optimum(shape: tuple[np.ndarray, np.ndarray]) -> None:
    """Against a dense solver of the overdetermined system, to 1e-6."""
    world = make_world(shape)
    samples = random_samples(world, 12)
    ao = ao_of(world, samples, lambda p: 0.3 + 0.3 * bumpy(p))
    phi = np.zeros((len(samples), world.vertex_count))
    weights = np.column_stack([samples.barycentric, 1 - samples.barycentric.astype(float).sum(1)])
    for corner in range(3):
        np.add.at(phi, (np.arange(len(samples)), world.faces[samples.face, corner]), weights[:, corner])
    root = np.sqrt(samples.area.astype(float))[:, None]
    best = np.linalg.lstsq(phi * root, ao.astype(float) * root, rcond=None)[0]
    np.testing.assert_allclose(solve(world, samples, ao, alpha=0.0).ao, best, atol=1e-6)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.01, 0.1, 1.0, 10.0]), st.integers(1, 5))
def test_values_stay_within_bounds(seed: int, alpha: float, per_face: int) -> None:
    """Black-and-white noise on slivers and large faces, half the samples invalid: 0 to 1, no NaN, no failure."""
    rng = np.random.default_rng(seed)
    positions, faces = grid(5, 5)
    positions *= [1.0, 10.0 ** rng.uniform(-4, 1), 1.0]
    positions[:, :2] += rng.uniform(-0.1, 0.1, (len(positions), 2)) * positions[-1, :2]
    world = make_world((positions, faces))
    samples = random_samples(world, per_face, seed=seed)
    ao = rng.integers(0, 2, (len(samples), 2)).astype(np.float32)
    field = solve(world, samples, ao, rng.random(len(samples)) > 0.5, alpha=alpha)
    assert field.ao.min() >= 0.0 and field.ao.max() <= 1.0
    assert field.report.averaged == 0
    assert field.report.iterations <= 200


def test_uniform_scale_changes_nothing() -> None:
    """alpha has no unit: the same scene in centimetres gives the same values."""
    positions, faces = icosphere(2)
    fields = []
    for scale in (1.0, 0.01, 100.0):
        world = make_world((positions * scale, faces))
        samples = random_samples(world, 4)
        ao = ao_of(make_world((positions, faces)), samples, bumpy)
        fields.append(solve(world, samples, ao, alpha=0.1).ao)
    np.testing.assert_allclose(fields[1], fields[0], atol=1e-5)
    np.testing.assert_allclose(fields[2], fields[0], atol=1e-5)


@BOTH
def test_vertices_that_lost_their_samples_are_filled_and_marked(mapping: MappingKind) -> None:
    """A hole of invalid samples in a slope is bridged from its rim, never black."""
    world = make_world(grid(12, 12))
    samples = random_samples(world, 6)
    at = points(world, samples)[:, :2]
    valid = np.abs(at - 0.5).max(axis=1) > 0.25
    ao = ao_of(world, samples, lambda p: 0.3 + 0.5 * p[:, 0])
    ao[~valid] = 0.0
    field = solve(world, samples, ao, valid, mapping=mapping)
    inside = np.abs(world.positions[:, :2] - 0.5).max(axis=1) < 0.17
    assert (field.state[inside] == VertexState.FILLED).all()
    assert (field.state[world.positions[:, 0] < 0.2] == VertexState.BAKED).all()
    assert np.abs(field.ao[:, 0] - (0.3 + 0.5 * world.positions[:, 0]))[inside].max() < 0.12
    row = field.ao.reshape(13, 13)[4:9, 6]
    assert (np.diff(row) >= -1e-3).all() or mapping is MappingKind.AVERAGE


@BOTH
def test_a_component_without_valid_samples_takes_the_nearest_value(mapping: MappingKind) -> None:
    """And is marked; a scene without any valid sample is open."""
    positions, faces = grid(2, 2)
    world = make_world((positions, faces), (moved(positions, 5.0), faces), (moved(positions, 7.0), faces))
    samples = random_samples(world, 4)
    ao = np.select([samples.face < 8, samples.face < 16], [0.25, 0.0], 0.75)[:, None].astype(np.float32)
    valid = (samples.face < 8) | (samples.face >= 16)
    field = solve(world, samples, ao, valid, mapping=mapping)
    assert (field.state[9:18] == VertexState.FILLED).all()
    np.testing.assert_allclose(field.ao[9:18, 0], 0.75, atol=1e-6)
    nothing = solve(world, samples, ao, np.zeros(len(samples), bool), mapping=mapping)
    np.testing.assert_allclose(nothing.ao, 1.0)
    assert (nothing.state == VertexState.FILLED).all()


def test_what_is_not_solved_is_nan_and_says_why() -> None:
    """Unreferenced vertices and objects that receive nothing per vertex."""
    positions, faces = grid(1, 1)
    lonely = np.concatenate([positions, [[7.0, 7.0, 7.0]]])
    world = make_world((lonely, faces), box(), roles=(Role.STATIC, Role.BLOCKER), samples=np.arange(14) < 2)
    samples = random_samples(world, 4)
    field = solve(world, samples, ao_of(world, samples, bumpy))
    assert field.state.tolist() == [VertexState.BAKED] * 4 + [VertexState.UNREFERENCED] + [VertexState.NOT_BAKED] * 8
    assert np.isnan(field.ao[4:]).all() and np.isfinite(field.ao[:4]).all()


def test_vertices_of_faces_without_area_are_filled() -> None:
    """A needle face takes no samples; its own vertex hangs on the rest of the surface."""
    positions, faces = grid(2, 2)
    needle = (np.concatenate([positions, positions[:1]]), np.concatenate([faces, [[0, 1, 9]]]))
    world = make_world(
        needle, samples=np.arange(9) < 8, normals=np.tile([0, 0, 1.0], (10, 1)) * (np.arange(10) < 9)[:, None]
    )
    samples = random_samples(world, 4)
    field = solve(world, samples, ao_of(world, samples, lambda p: 0.25 + 0 * p[:, 0]))
    np.testing.assert_allclose(field.ao, 0.25, atol=1e-6)


@given(seed=st.integers(0, 2**32 - 1), guess=st.sampled_from([0.0, 0.5, 1.0]))
@settings(deadline=None, max_examples=15)
def test_fills_do_not_hang_on_where_the_solve_begins(seed: int, guess: float) -> None:
    """Vertices without samples weigh next to nothing, and still end in one place from any start."""
    rng = np.random.default_rng(seed)
    positions, faces = grid(9, 9)
    positions = positions**8  # tiny faces beside large ones
    world = make_world((positions, faces))
    samples = random_samples(world, 2, seed=seed)
    valid = (positions[faces[samples.face], 0] > 0.01).all(axis=1)
    ao = rng.random((len(samples), 1)).astype(np.float32)
    mapper = VertexMapper(world, samples, BakeSettings())
    cold = mapper.solve(ao, valid)
    warm = mapper.solve(ao, valid, start=np.full((world.vertex_count, 1), guess, np.float32))
    assert np.count_nonzero(cold.state == VertexState.FILLED) > 3
    np.testing.assert_allclose(warm.ao, cold.ao, atol=1e-5)


def test_fills_do_not_hang_on_what_else_is_in_the_scene() -> None:
    """A vertex between a sliver and a needle gets the same value whatever size another object's faces have."""
    positions, faces = grid(1, 2)  # corners 0, 2 and 4 lie on one side, one above the other
    apart = np.array([-1e-5, 0.25, 0.0])
    both = [apart, 0.5 * (apart + positions[4])]
    bridged = np.concatenate([positions, both]), np.concatenate([faces, [[0, 2, 6], [6, 7, 4]]])
    values: list[np.ndarray] = []
    for size in (1.0, 300.0):
        far = moved(grid(3, 3, size=size)[0], 50.0), grid(3, 3)[1]
        world = make_world(bridged, far)
        samples = random_samples(world, 6)
        on_first = samples.face < 6
        ao = ao_of(world, samples, lambda p: np.where(p[:, 1] < 0.5, 0.1, 0.9))
        ao[~on_first, 0] = np.random.default_rng(2).random(len(ao) - np.count_nonzero(on_first))
        field = solve(world, samples, ao, ~np.isin(samples.face, [4, 5]))
        assert field.state[6] == VertexState.FILLED
        values.append(field.ao[:8])
    np.testing.assert_allclose(values[0], values[1], atol=1e-4)


def test_split_vertices_get_one_value() -> None:
    """Loose triangles and the indexed mesh bake alike."""
    world = make_world(grid(6, 6))
    loose = make_world(soup(*grid(6, 6)))
    samples = random_samples(world, 6)
    ao = ao_of(world, samples, bumpy)
    indexed, split = solve(world, samples, ao), solve(loose, samples, ao)
    assert split.report.unknowns == indexed.report.unknowns == 49
    np.testing.assert_allclose(split.ao, indexed.ao[world.faces.ravel()], atol=1e-5)


def test_touching_objects_share_values_on_request() -> None:
    """A seam between two halves of a floor closes only when asked to."""
    positions, faces = grid(4, 4)
    world = make_world((positions, faces), (moved(positions, 1.0), faces))
    samples = random_samples(world, 4)
    ao = ao_of(world, samples, bumpy)
    ao += np.random.default_rng(1).normal(0, 0.02, ao.shape).astype(np.float32)
    ao = np.clip(ao, 0, 1)
    left, right = np.arange(20, 25), 25 + np.arange(5)
    apart, together = solve(world, samples, ao), solve(world, samples, ao, weld_instances=True)
    assert np.abs(apart.ao[left] - apart.ao[right]).max() > 1e-3
    np.testing.assert_array_equal(together.ao[left], together.ao[right])


def test_an_object_can_have_its_own_alpha() -> None:
    """One key changes its object and no other."""
    positions, faces = grid(5, 5)
    plain = make_world((positions, faces), (moved(positions, 3.0), faces))
    keyed = dataclasses.replace(plain, object_keys=(ObjectKeys(), ObjectKeys(alpha=1.0)))
    samples = random_samples(plain, 4)
    ao = ao_of(plain, samples, lambda p: bumpy(2 * p))
    usual, own, all_smooth = solve(plain, samples, ao), solve(keyed, samples, ao), solve(plain, samples, ao, alpha=1.0)
    np.testing.assert_allclose(own.ao[:36], usual.ao[:36], atol=1e-6)
    np.testing.assert_allclose(own.ao[36:], all_smooth.ao[36:], atol=1e-6)
    assert np.abs(own.ao[36:] - usual.ao[36:]).max() > 0.01


def test_more_alpha_is_smoother() -> None:
    """The regulariser's own energy falls as alpha grows."""
    world = make_world(icosphere(2))
    samples = random_samples(world, 4)
    ao = ao_of(world, samples, lambda p: bumpy(2 * p))
    mapper = VertexMapper(world, samples, BakeSettings())
    wings = mapper.surface.butterflies
    energies = []
    for alpha in (0.0, 0.03, 0.1, 1.0):
        x = np.empty(mapper.surface.unknown_count)
        x[mapper.surface.unknown] = mapper.solve(ao, np.ones(len(ao), bool), alpha=alpha).ao[:, 0]
        energies.append(float((((wings.operator * x[wings.stencil]).sum(1)) ** 2).sum()))
    assert all(a > b for a, b in itertools.pairwise(energies))


def test_a_mapper_is_as_good_as_new() -> None:
    """Re-used after other alphas and thresholds, and run again, it gives the same bits as a fresh one."""
    world = make_world(icosphere(2))
    samples = random_samples(world, 4)
    ao = ao_of(world, samples, bumpy, lambda p: 0.5 * bumpy(p[:, ::-1]))
    rng = np.random.default_rng(4)
    first, second = rng.random((2, len(samples))) > 0.2
    mapper = VertexMapper(world, samples, BakeSettings())
    mapper.solve(ao, first, alpha=0.5)
    mapper.solve(ao, second, mapping=MappingKind.AVERAGE)
    again = mapper.solve(ao, second, alpha=0.1)
    fresh = solve(world, samples, ao, second, alpha=0.1)
    np.testing.assert_array_equal(again.ao, fresh.ao)
    assert again.report == fresh.report


def test_values_are_sums_of_samples_where_no_bound_is_active() -> None:
    """The adjoint of a vertex gives every sample a weight; the weights add up to one and give back the value."""
    world = make_world(icosphere(1))
    samples = random_samples(world, 5)
    ao = ao_of(world, samples, lambda p: 0.3 + 0.3 * bumpy(p))
    mapper = VertexMapper(world, samples, BakeSettings())
    valid = np.ones(len(samples), bool)
    field, system = mapper.solve(ao, valid), mapper.system(ao, valid)
    assert field.report.bounded == (0,)
    vertex = 7
    adjoint = np.linalg.solve(system.matrix.toarray(), np.eye(42)[mapper.surface.unknown[vertex]])
    corners = mapper.surface.corners[samples.face]
    phi = np.column_stack([samples.barycentric, 1 - samples.barycentric.astype(float).sum(1)])
    weights = samples.area * (phi * ((1 + system.strength) * adjoint)[corners]).sum(1)
    assert abs(weights.sum() - 1) < 1e-6
    assert abs(weights @ ao[:, 0] - field.ao[vertex, 0]) < 1e-6


def test_least_squares_beats_the_average() -> None:
    """On a smooth function it is much closer to the truth over the whole surface."""
    world = make_world(grid(8, 8))
    samples, checks = random_samples(world, 6), random_samples(world, 40, seed=9)
    truth = ao_of(world, checks, bumpy)
    ao = ao_of(world, samples, bumpy)
    weights = np.column_stack([checks.barycentric, 1 - checks.barycentric.sum(1)])
    errors = {}
    for mapping in MappingKind:
        field = solve(world, samples, ao, mapping=mapping)
        value = (field.ao[world.faces[checks.face], 0] * weights).sum(1)
        errors[mapping] = np.sqrt(np.mean((value - truth[:, 0]) ** 2))
    assert errors[MappingKind.LEAST_SQUARES] < 0.6 * errors[MappingKind.AVERAGE]


def test_a_large_face_beside_slivers_does_not_overshoot() -> None:
    """The case that breaks the textbook regulariser: strips of very different width, few samples, a sharp shadow."""
    x = np.concatenate([[0.0], np.cumsum(np.tile([1e-4, 1e-3, 3.0], 8))])
    positions = np.array([[a, b, 0.0] for a in x for b in (0.0, 2.0)])
    i = np.arange(0, len(positions) - 2, 2)
    faces = np.concatenate([np.column_stack([i, i + 2, i + 3]), np.column_stack([i, i + 3, i + 1])])
    world = make_world((positions, faces))
    samples = random_samples(world, 4)
    ao = ao_of(world, samples, lambda p: np.where(p[:, 0] < 11.0, 0.2, 0.8))
    field = solve(world, samples, ao, alpha=0.1)
    assert field.report.iterations < 60
    assert field.report.limited_edges > 0
    away = np.abs(positions[:, 0] - 11.0) > 4.0
    np.testing.assert_allclose(field.ao[away, 0], np.where(positions[away, 0] < 11.0, 0.2, 0.8), atol=0.05)


def test_rmse_is_that_of_the_samples() -> None:
    """The report's figure, from sums a face, equals the plain one over all valid samples."""
    world = make_world(grid(4, 4))
    samples = random_samples(world, 5)
    ao = ao_of(world, samples, lambda p: bumpy(3 * p), bumpy)
    valid = np.random.default_rng(1).random(len(samples)) > 0.3
    field = solve(world, samples, ao, valid)
    weights = np.column_stack([samples.barycentric, 1 - samples.barycentric.sum(1)])
    value = (field.ao[world.faces[samples.face]] * weights[..., None]).sum(1)
    expected = np.sqrt(np.average((value - ao)[valid] ** 2, axis=0, weights=samples.area[valid]))
    np.testing.assert_allclose(field.report.rmse, expected, rtol=1e-4)


def test_values_that_are_no_numbers_are_refused() -> None:
    """One line, instead of a field of NaN; an invalid sample may hold anything."""
    world = make_world(grid(1, 1))
    samples = random_samples(world, 4)
    ao = ao_of(world, samples, bumpy)
    ao[3] = np.nan
    with pytest.raises(SolveError, match="finite"):
        solve(world, samples, ao)
    assert np.isfinite(solve(world, samples, ao, np.arange(len(ao)) != 3).ao).all()


def test_a_scene_where_nothing_receives_has_nothing_to_solve() -> None:
    """All vertices are not baked."""
    world = make_world(box(), roles=(Role.BLOCKER,), samples=False)
    samples = random_samples(world, 4)
    field = solve(world, samples, np.zeros((0, 2), np.float32))
    assert (field.state == VertexState.NOT_BAKED).all()
    assert field.report.unknowns == 0
    assert field.report.rmse == (0.0, 0.0)


def test_progress_is_told() -> None:
    """Shares never fall and end at one."""
    world = make_world(grid(2, 2))
    samples = random_samples(world, 4)
    told: list[tuple[str, float]] = []
    map_to_vertices(
        world, samples, ao_of(world, samples, bumpy), np.ones(len(samples), bool), BakeSettings(),
        on_progress=lambda step, share: told.append((step, share)),
    )  # fmt: skip
    shares = [share for _, share in told]
    assert shares == sorted(shares) and shares[-1] == 1.0
