"""The weights of samples in a value: against dense algebra, against differences, and against the stored values."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.explain.adjoint import Adjoint
from bake.explain.greens import Greens
from bake.settings import BakeSettings, MappingKind
from bake.solve import VertexMapper
from bake.types import BakeResult, BoolArray, ObjectKeys, SampleSet
from tests.explain.baked_worlds import SETTINGS, baked, courtyard
from tests.solve.solve_cases import ao_of, grid, random_samples
from tests.worlds import make_world

CASES = {
    "accurate": SETTINGS,
    "smooth": SETTINGS.replaced(alpha=1.0),
    "plain": SETTINGS.replaced(alpha=0.0),
    "average": SETTINGS.replaced(mapping=MappingKind.AVERAGE),
    "strict": SETTINGS.replaced(back_face_threshold=0.0),
    "welded": SETTINGS.replaced(weld_instances=True),
}


def adjoint_of(result: BakeResult) -> tuple[Adjoint, VertexMapper, BoolArray]:
    """The adjoint of a bake, its mapper and its valid samples."""
    valid = result.tally.valid(result.settings.back_face_threshold)
    mapper = VertexMapper(result.world, result.samples, result.settings)
    return Adjoint(mapper, result.samples, result.tally.ao, valid, result.field, result.settings), mapper, valid


@pytest.mark.parametrize("case", list(CASES))
def test_every_value_is_its_samples(case: str) -> None:
    """At every vertex of a level the weighed samples and the bounds add up to the value, and the weights to one."""
    keys = (ObjectKeys(), ObjectKeys(alpha=0.3), *(ObjectKeys(),) * 3)
    result = baked(courtyard(keys=keys), CASES[case])
    adjoint, _, valid = adjoint_of(result)
    kinds = set()
    for unknown in range(adjoint.surface.unknown_count):
        found = adjoint.weights(np.array([unknown]), np.ones(1))
        value = found.weight @ result.tally.ao[found.sample].astype(float) + found.effect.sum(axis=0)
        np.testing.assert_allclose(value, adjoint.values[unknown], atol=2e-6)
        assert found.weight.sum() == pytest.approx(1.0, abs=1e-6)
        assert valid[found.sample].all()
        kinds |= {"held"} if len(found.held) else set()
        kinds |= {"starved"} if adjoint.starved[unknown] else set()
    assert "starved" in kinds
    assert ("held" in kinds) == (case != "average")


def test_values_of_the_stored_field_are_solved_well() -> None:
    """Values strictly inside the bounds solve their own row."""
    adjoint, _, _ = adjoint_of(baked(courtyard()))
    assert np.abs(adjoint.solver_error).max() < 2e-6


@pytest.mark.parametrize("alpha", [0.03, 0.5])
def test_weights_are_the_dense_inverse(alpha: float) -> None:
    """Row by row: A⁻¹ (1 + r) dA φ from a dense matrix, built apart from the adjoint."""
    result = baked(courtyard(), SETTINGS.replaced(alpha=alpha))
    adjoint, mapper, valid = adjoint_of(result)
    system = mapper.system(result.tally.ao, valid, alpha=alpha)
    dense = np.linalg.inv(system.matrix.toarray())
    samples, surface = result.samples, mapper.surface
    phi = np.column_stack([samples.barycentric, 1.0 - samples.barycentric.astype(float).sum(axis=1)])
    corners = surface.corners[surface.row[samples.face]]
    scale = np.where(adjoint.starved, 0.0, 1.0 + system.strength)
    rows = np.random.default_rng(0).choice(np.flatnonzero(~adjoint.starved), 12)
    for unknown in rows:
        expected = samples.area * np.einsum("ij,ij->i", phi, (dense[unknown] * scale)[corners]) * valid
        found = adjoint.weights(np.array([unknown]), np.ones(1))
        whole = np.zeros(len(samples))
        whole[found.sample] = found.weight
        np.testing.assert_allclose(whole, expected, atol=1e-5)


def plain_fit(alpha: float, seed: int) -> tuple[VertexMapper, SampleSet, np.ndarray, BakeSettings]:
    """A flat grid with samples that are open or closed at random: a fit that overshoots."""
    world = make_world(grid(4, 4))
    samples = random_samples(world, 4, seed=seed)
    ao = (np.random.default_rng(seed).random((len(samples), 1)) < 0.5).astype(np.float32)
    options = BakeSettings(distances=(2.0,), alpha=alpha)
    return VertexMapper(world, samples, options), samples, ao, options


@pytest.mark.parametrize("seed", [1, 2])
def test_derivative_is_what_a_change_does(seed: int) -> None:
    """With vertices held at both bounds, a small change of a sample moves a value by its derivative."""
    mapper, samples, ao, options = plain_fit(0.0, seed)
    valid = np.ones(len(ao), np.bool_)
    adjoint = Adjoint(mapper, samples, ao, valid, mapper.solve(ao, valid), options)
    free = np.flatnonzero((adjoint.values[:, 0] > 0.01) & (adjoint.values[:, 0] < 0.99))
    assert 3 < len(free) < adjoint.surface.unknown_count - 3
    rng = np.random.default_rng(seed)
    for unknown in free[:4]:
        found = adjoint.derivative(np.array([unknown]), np.ones(1), 0)
        value = found.weight @ ao[found.sample, 0].astype(float) + found.effect[:, 0].sum()
        assert value == pytest.approx(adjoint.values[unknown, 0], abs=1e-6)
        for place in rng.choice(len(found.sample), 3):
            step = 1e-3
            changed = ao.copy()
            changed[found.sample[place], 0] += step
            after = mapper.solve(changed, valid).ao[mapper.surface.unknown == unknown, 0][0]
            assert (after - adjoint.values[unknown, 0]) / step == pytest.approx(found.weight[place], abs=1e-3)


def test_a_held_value_does_not_answer() -> None:
    """The derivative of a value that a bound holds is nothing but that bound."""
    mapper, samples, ao, options = plain_fit(0.0, 3)
    valid = np.ones(len(ao), np.bool_)
    adjoint = Adjoint(mapper, samples, ao, valid, mapper.solve(ao, valid), options)
    at_zero = np.flatnonzero(adjoint.values[:, 0] == 0.0)
    found = adjoint.derivative(at_zero[:1], np.ones(1), 0)
    assert np.abs(found.weight).sum() == 0.0
    assert found.effect[:, 0].sum() == 0.0
    pulled = adjoint.weights(at_zero[:1], np.ones(1))
    assert pulled.weight @ ao[pulled.sample, 0].astype(float) < -1e-4, "its samples ask for less than nothing"


@settings(max_examples=25, deadline=None)
@given(
    slope=st.floats(-0.4, 0.4),
    alpha=st.sampled_from([0.0, 0.01, 0.1, 1.0]),
    weights=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)),
)
def test_weights_know_constants_and_slopes(slope: float, alpha: float, weights: tuple[float, float]) -> None:
    """Anywhere on a flat grid, the weighed samples of a linear function give the function there."""
    world = make_world(grid(5, 5))
    samples = random_samples(world, 5)
    ao = ao_of(world, samples, lambda p: 0.5 + slope * (p[:, 0] - 0.5))
    options = BakeSettings(distances=(2.0,), alpha=alpha)
    mapper, valid = VertexMapper(world, samples, options), np.ones(len(samples), np.bool_)
    adjoint = Adjoint(mapper, samples, ao, valid, mapper.solve(ao, valid), options)
    u, v = weights if sum(weights) <= 1.0 else (1.0 - weights[0], 1.0 - weights[1])
    bary = np.array([u, v, 1.0 - u - v])
    corners = world.faces[17]
    found = adjoint.weights(adjoint.surface.unknown[corners], bary)
    x = bary @ world.positions[corners, 0]
    assert found.weight.sum() == pytest.approx(1.0, abs=1e-6)
    assert found.weight @ ao[found.sample, 0].astype(float) == pytest.approx(0.5 + slope * (x - 0.5), abs=1e-5)


def test_nothing_valid_means_a_constant() -> None:
    """Where the scene has no valid sample, values are 1 and no sample weighs anything."""
    mapper, samples, ao, options = plain_fit(0.03, 1)
    valid = np.zeros(len(ao), np.bool_)
    adjoint = Adjoint(mapper, samples, ao, valid, mapper.solve(ao, valid), options)
    found = adjoint.weights(np.array([3]), np.ones(1))
    assert found.constant == pytest.approx(1.0, abs=1e-6)
    assert np.abs(found.weight).sum() == 0.0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_column_of_the_inverse_is_bounded_by_its_cut_off(seed: int) -> None:
    """On a long chain the patch stays small, and what is left out is within the bound."""
    from scipy.sparse import csr_array, diags_array

    n, rng = 2000, np.random.default_rng(seed)
    off = -rng.uniform(0.1, 1.0, n - 1)
    main = 0.3 + np.abs(np.append(off, 0.0)) + np.abs(np.append(0.0, off))
    matrix = csr_array(diags_array([off, main, off], offsets=[-1, 0, 1]))
    at = int(rng.integers(0, n))
    column = Greens(matrix).column(np.array([at]), np.ones(1), tolerance=1e-6)
    whole = np.zeros(n)
    whole[column.unknowns] = column.values
    unit = np.zeros(n)
    unit[at] = 1.0
    assert len(column.unknowns) < 200
    assert np.abs(unit - matrix @ whole).sum() <= column.cut_off * (1 + 1e-9) + 1e-15
    assert column.cut_off <= 1e-6
