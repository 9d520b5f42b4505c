"""Ways to choose directions: their points, and what is said of their errors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.bench.point_sets import POINT_SETS, jittered
from bake.bench.samplers import JITTER, OURS, RANDOM, RAYS, ROOM, SamplerCurve, SamplerScene, samplers_table
from bake.low_discrepancy import owen_sobol
from bake.settings import BakeSettings


@pytest.mark.parametrize("name", POINT_SETS)
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31), power=st.integers(0, 4))
def test_sets_lie_in_the_square_and_differ(name: str, seed: int, power: int) -> None:
    """Every set has its points in [0, 1)², the same for the same seed, and no two sets are equal."""
    made = POINT_SETS[name](4**power, 3, seed)
    assert made.shape == (3, 4**power, 2)
    assert made.min() >= 0.0
    assert made.max() < 1.0
    assert np.array_equal(made, POINT_SETS[name](4**power, 3, seed))
    assert not np.array_equal(made[0], made[1])


@pytest.mark.parametrize("name", [name for name in POINT_SETS if name != RANDOM])
def test_sets_are_even(name: str) -> None:
    """Every way but the random one has about as many points in each quarter of the square."""
    made = POINT_SETS[name](256, 8, 1)
    quarter = (made >= 0.5) @ [1, 2]
    for one in quarter:
        assert np.abs(np.bincount(one, minlength=4) - 64).max() <= 6


def test_jitter_needs_a_square() -> None:
    """A grid of cells has as many columns as rows."""
    with pytest.raises(ValueError, match="32"):
        jittered(32, 1, 1)


def test_ours_are_those_of_bakes() -> None:
    """The scrambled sets are sequences of the function that the bake's kernel is held equal to."""
    made = POINT_SETS[OURS](16, 2, 7)
    seeds = np.random.default_rng(7).integers(0, 2**32, 2, dtype=np.uint32)
    assert np.array_equal(made[1], np.stack(owen_sobol(np.arange(16), np.full(16, seeds[1])), axis=1))


def _scene(own_slope: float, own_at_256: float) -> SamplerScene:
    def curve(name: str, at_256: float, slope: float) -> SamplerCurve:
        return SamplerCurve(name, "concentric", tuple(at_256 * (rays / 256) ** slope for rays in RAYS))

    curves = [curve(RANDOM, 0.01, -0.5), curve(JITTER, 0.001, -1.0), curve(OURS, own_at_256, own_slope)]
    return SamplerScene(ROOM, curves, 1e-6, BakeSettings())


@pytest.mark.parametrize(("slope", "error", "passed"), [(-1.2, 5e-4, True), (-1.0, 5e-4, False), (-1.2, 7e-4, False)])
def test_gates_ask_for_slope_and_error(slope: float, error: float, passed: bool) -> None:
    """In the room ours has to fall fast and to lie well below jitter's."""
    table = samplers_table([_scene(slope, error)])
    ours = next(row for row in table.rows if row["directions"] == OURS)
    assert ours["slope"] == pytest.approx(slope)
    assert ours["random rays as good as 256"] == round(256 * (0.01 / error) ** 2)
    assert ours["passed"] is passed
    assert table.passed is passed
