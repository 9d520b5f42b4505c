"""Region models made again without tracing, state and table: no window needed."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "viewer"))

from synthetic_regions import row_of_regions

from app.region_model_group import beta_at, energy_text, position_of
from app.region_models import Fit, pending_bits, reachable_bits, refit, summed, traced_bits, with_bits
from bake.region_types import GRID, PointState
from bake.regions.models import fit_and_absorb, regularised_regions
from bake.settings import BakeSettings

SETTINGS = BakeSettings(region_smallest=0.0)
STORED = Fit(None, False, is_new=False)


def _baked(count: int = 4):
    regions = row_of_regions(count)
    fitted = fit_and_absorb(regions.points, regions.graph, SETTINGS)
    return regularised_regions(regions.points, regions.graph, fitted, SETTINGS)[0]


def test_same_settings_give_the_same_models() -> None:
    """A refit with the settings of the bake is the bake."""
    baked = _baked()
    made = refit(baked, SETTINGS, STORED).regions
    assert np.array_equal(made.regularised.coefficients, baked.regularised.coefficients)
    assert np.array_equal(made.mismatch_after, baked.mismatch_after)
    assert made.regularised.rmse == pytest.approx(baked.regularised.rmse)


def test_without_regularisation_models_are_as_fitted() -> None:
    """β = 0 gives the fit, and the mismatch after it is the one before."""
    baked = _baked()
    made = refit(baked, SETTINGS.replaced(region_beta=0.0), STORED)
    assert np.array_equal(made.regions.regularised.coefficients, baked.fitted.coefficients)
    assert np.array_equal(made.regions.mismatch_after, made.regions.mismatch_before)
    assert energy_text(made.energies, as_baked=False).startswith("Nothing to regularise")


def test_known_refit_is_used_for_other_regularisation() -> None:
    """Moving a slider from an earlier refit gives what a refit from nothing gives."""
    baked = _baked()
    first = refit(baked, SETTINGS.replaced(region_beta=3.0), STORED)
    strong = SETTINGS.replaced(region_beta=40.0)
    again, fresh = refit(baked, strong, STORED, first), refit(baked, strong, STORED)
    assert np.array_equal(again.regions.regularised.coefficients, fresh.regions.regularised.coefficients)
    assert again.sums is first.sums


def test_switched_points_are_left_out_and_their_region_alone_is_summed_again() -> None:
    """Sums updated for one region equal sums over everything; the other regions' fits do not change."""
    baked = _baked()
    bits = reachable_bits(baked)
    bits[GRID**3 : GRID**3 + 200] = False
    points = with_bits(baked.points, bits, 0.25)
    updated, whole = summed(points, baked.graph, summed(baked.points, baked.graph)), summed(points, baked.graph)
    for item in dataclasses.fields(whole.moments):
        assert getattr(updated.moments, item.name) == pytest.approx(getattr(whole.moments, item.name))
    made = refit(baked, SETTINGS, Fit(bits, False, is_new=True), sums=summed(baked.points, baked.graph)).regions
    assert not np.allclose(made.fitted.coefficients[1], baked.fitted.coefficients[1])
    assert np.allclose(made.fitted.coefficients[2], baked.fitted.coefficients[2], atol=1e-6)
    assert (made.points.state[GRID**3 : GRID**3 + 200] == PointState.UNREACHABLE).all()


@given(st.lists(st.integers(0, 2 * GRID**3 - 1), max_size=40))
@settings(max_examples=25, deadline=None)
def test_bits_there_and_back_leave_the_points_as_baked(chosen: list[int]) -> None:
    """Switching points and switching them back gives the states of the bake; untraced ones only wait."""
    baked = row_of_regions(2)
    bits = reachable_bits(baked)
    turned = bits.copy()
    turned[chosen] = ~turned[chosen]
    there = with_bits(baked.points, turned, 0.25)
    waiting = pending_bits(baked, turned)
    assert not (waiting & traced_bits(baked)).any()
    assert (there.state[~turned] == PointState.UNREACHABLE).all()
    assert (there.state[waiting] == PointState.UNREACHABLE).all()
    assert np.array_equal(with_bits(there, bits, 0.25).state, baked.points.state)


def test_dropped_points_stay_dropped_when_switched_off_and_on() -> None:
    """A point that sees too many back faces does not become valid by the brush."""
    baked = row_of_regions(1)
    bits = np.ones(GRID**3, bool)
    assert with_bits(baked.points, bits, 0.25).state[3] == PointState.BACK_FACES
    assert with_bits(baked.points, bits, 0.75).state[3] == PointState.VALID


def test_slider_of_beta_covers_its_range() -> None:
    """Zero at the left end, then powers of ten; every position comes back."""
    assert beta_at(0) == 0.0
    assert beta_at(1) == 0.01
    assert beta_at(200) == 10_000.0
    assert [position_of(beta_at(position)) for position in range(201)] == list(range(201))
    assert position_of(1e9) == 200


def test_energy_is_told_in_a_line() -> None:
    """As baked, nothing to do, or how far it fell in the end."""
    assert energy_text(np.zeros(0), as_baked=True) == "As baked."
    assert energy_text(np.array([[4.0, 1.0]]), as_baked=False) == "1 sweep; the last lowered the energy by 75.00%."
