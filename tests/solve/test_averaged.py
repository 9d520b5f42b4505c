"""The average of a whole scene, made without a surface to solve on."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bake.errors import SolveError
from bake.settings import BakeSettings, MappingKind
from bake.solve import VertexMapper, map_to_vertices
from tests.solve.solve_cases import moved, random_samples, soup
from tests.worlds import box, icosphere, make_world

AVERAGE = BakeSettings(mapping=MappingKind.AVERAGE)


@given(seed=st.integers(0, 2**32 - 1), kept=st.sampled_from([0.0, 0.02, 0.3, 1.0]), weld=st.booleans())
@example(seed=216, kept=0.02, weld=False)
def test_it_is_the_mappers_average(seed: int, kept: float, weld: bool) -> None:
    """With vertices and whole components that have no valid sample, welded across objects or not."""
    rng = np.random.default_rng(seed)
    ball, crate = icosphere(1), box()
    world = make_world(soup(*ball), (moved(crate[0], 2.5), crate[1]), (moved(ball[0], 5.0), ball[1]))
    samples = random_samples(world, 2, seed=seed)
    ao = rng.random((len(samples), 2)).astype(np.float32)
    valid = (rng.random(len(samples)) < kept) & (world.face_object[samples.face] != 2)
    options = AVERAGE.replaced(weld_instances=weld)
    field = map_to_vertices(world, samples, ao, valid, options)
    expected = VertexMapper(world, samples, options).solve(ao, valid)
    # Fills by rings add up the same neighbours in another order.
    np.testing.assert_allclose(field.ao, expected.ao, rtol=0.0, atol=2e-7)
    np.testing.assert_array_equal(field.state, expected.state)
    assert field.report.rmse == pytest.approx(expected.report.rmse)


def test_values_that_are_no_numbers_are_refused() -> None:
    """If their samples are valid."""
    world = make_world(icosphere(1))
    samples = random_samples(world, 1)
    ao = np.full((len(samples), 1), np.nan, np.float32)
    with pytest.raises(SolveError, match="finite"):
        map_to_vertices(world, samples, ao, np.ones(len(samples), bool), AVERAGE)
