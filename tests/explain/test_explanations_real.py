"""Explanations on real levels: shares add up to 1 - AO, counterfactuals are what a bake without the object gives."""

from __future__ import annotations

from pathlib import Path

import pytest

from bake.bench.explain import SPOTS, SUM_GATE, WITHOUT_GATE, explain_scene

SCENES = Path(__file__).resolve().parents[2] / "../shared/scenes"
QUICK = {"device": "cpu", "quality": "preview"}


def measured(name: str, scale: float) -> dict[str, object]:
    """The benchmark's rows of a scene; skips where it is absent."""
    found = sorted((SCENES / name).glob("*.glb")) or sorted((SCENES / name).glob("*.obj"))
    if not found:
        pytest.skip("the real scenes are not here")
    return explain_scene(found[0], QUICK, scale=scale)


@pytest.mark.shared
@pytest.mark.parametrize(
    ("name", "scale"),
    [
        ("japanese_bridge_garden", 1.0),
        pytest.param("cube2_pandora", 0.05, marks=pytest.mark.slow),
        pytest.param("stk_mines", 1.0, marks=pytest.mark.slow),
        pytest.param("stk_candela_city", 1.0, marks=pytest.mark.slow),
    ],
)
def test_sums_and_counterfactuals_hold(name: str, scale: float) -> None:
    """At random vertices named shares and weights add up, and values without an object are those of a whole bake."""
    rows = measured(name, scale)
    shares, without = rows["shares"], rows["without"]
    assert isinstance(shares, dict)
    assert isinstance(without, list)
    assert shares["sum"] <= SUM_GATE
    assert shares["weights"] <= SUM_GATE
    assert without
    for row in without:
        assert row["spot error"] <= WITHOUT_GATE, row["object"]
        assert row["apart"] <= 1e-3 * row["vertices"], row["object"]
    assert sum(row["spots"] for row in without) > SPOTS / 8
