from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from bake.explain.cause_names import CauseKind
from bake.explain.explainer import Explainer
from bake.explain.spot_looks import refine_spots
from bake.explain.spots import Spots, find_spots
from tests.explain.dark_corner import baked, dark_corner


@pytest.fixture(scope="module")
def explainer() -> Iterator[Explainer]:
    """Of the dark corner."""
    with Explainer(baked(dark_corner())) as made:
        yield made


@pytest.fixture(scope="module")
def refined(explainer: Explainer) -> Spots:
    """Its spots, looked at."""
    return refine_spots(find_spots(explainer.result), explainer.tracer)


def test_the_same_spots_in_another_order(explainer: Explainer, refined: Spots) -> None:
    """Nothing is lost, members stay with their spot, and the list is sorted."""
    before = find_spots(explainer.result)
    assert sorted(refined.vertex.tolist()) == sorted(before.vertex.tolist())
    assert np.all(np.diff(refined.severity) <= 0)
    assert list(np.diff(refined.first)) == list(refined.vertices)
    members = {int(before.vertex[row]): before.members_of(row) for row in range(len(before))}
    for row in range(len(refined)):
        np.testing.assert_array_equal(refined.members_of(row), members[int(refined.vertex[row])])


def test_what_nobody_sees_sinks(explainer: Explainer, refined: Spots) -> None:
    """Spots inside something are told so and weigh a quarter of what they did."""
    assert refined.unseen is not None
    assert refined.unseen.any()
    assert not refined.unseen.all()
    before = find_spots(explainer.result)
    was = dict(zip(before.vertex.tolist(), before.severity.tolist(), strict=True))
    for row in np.flatnonzero(refined.unseen).tolist():
        assert refined.guess[row] is CauseKind.BURIED
        assert refined.severity[row] == pytest.approx(0.25 * was[int(refined.vertex[row])], rel=1e-5)


def test_what_is_seen_is_a_share(refined: Spots) -> None:
    """AO by the spots' own rays lies within 0 to 1."""
    assert refined.seen is not None
    assert np.all((refined.seen >= 0.0) & (refined.seen <= 1.0))


def test_no_spots_stay_none(explainer: Explainer) -> None:
    """An empty list is given back as it is."""
    nothing = find_spots(explainer.result, least=2.0)
    assert refine_spots(nothing, explainer.tracer) is nothing
