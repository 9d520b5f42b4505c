"""The disc of an explained spot's rays: where directions fall, and what they count for."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bake.explain.explainer import Explainer
from bake.explain.types import Explanation
from tests.explain.baked_worlds import baked, courtyard
from viewer.explain_dome import belongs, dome_of, horizon_of, tangents_of

unit = st.floats(-1.0, 1.0, allow_nan=False)


@pytest.fixture(scope="module")
def explanation() -> Explanation:
    """A spot on the courtyard's floor."""
    with Explainer(baked(courtyard())) as explainer:
        return explainer.explain_vertex(40)


@given(x=unit, y=unit, z=unit)
def test_tangents_stand_on_the_normal(x: float, y: float, z: float) -> None:
    """They are unit, at right angles and right-handed, and what is up is up on the disc."""
    normal = np.array([x, y, z])
    if np.linalg.norm(normal) < 0.01:
        return
    normal /= np.linalg.norm(normal)
    tangents = tangents_of(normal)
    np.testing.assert_allclose(tangents @ tangents.T, np.eye(2), atol=1e-9)
    np.testing.assert_allclose(np.cross(tangents[0], tangents[1]), normal, atol=1e-9)
    if abs(normal[1]) < 0.94:
        assert tangents[1, 1] > 0.0


def test_dots_count_what_their_samples_do(explanation: Explanation) -> None:
    """All rays of the samples that count for the value are there, and mean what the samples' AO is."""
    for column in range(2):
        dome = dome_of(explanation, column)
        rows = np.flatnonzero(explanation.samples.weight[: explanation.samples.traced] > 0.0)
        assert dome.samples == len(rows)
        assert dome.counts.mean() == pytest.approx(float(explanation.samples.ao[rows, column].mean()), abs=1e-5)
        assert np.linalg.norm(dome.position, axis=1).max() < 1.06
        assert np.isinf(dome.distance[dome.object < 0]).all()
        assert (dome.counts[dome.object < 0] == 1.0).all()


def test_dots_are_found_and_told_apart(explanation: Explanation) -> None:
    """The nearest dot is the one at a place; an object's dots are those that it stops."""
    dome = dome_of(explanation, 0)
    for ray in range(0, len(dome), 17):
        x, y = dome.position[ray].tolist()
        found = dome.nearest(x, y, 1e-4)
        np.testing.assert_allclose(dome.position[found], dome.position[ray], atol=1e-4)
    assert dome.nearest(3.0, 0.0, 0.1) == -1
    assert belongs(dome, -1).all()
    owner = int(dome.object.max())
    assert 0 < int(belongs(dome, owner).sum()) < len(dome)


def test_level_line_and_what_is_up(explanation: Explanation) -> None:
    """Over a level floor nothing is marked as level and up has no place; beside a wall both have."""
    dome = dome_of(explanation, 0)
    assert dome.angle_of(explanation.spot.normal) is None
    assert dome.angle_of(dome.tangents[1]) == pytest.approx(np.pi / 2)
    assert len(horizon_of(dome, np.array([0.0, 1.0, 0.0]))) == 0
    level = horizon_of(dome, np.array([0.6, 0.8, 0.0]))
    assert (np.linalg.norm(level, axis=1) <= 1.0 + 1e-9).all()
