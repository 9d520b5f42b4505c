"""Explanations and counterfactuals of bakes whose samples sent different numbers of rays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bake.decorator_types import FogBoxes
from bake.explain.explainer import Explainer
from bake.explain.types import ShareKind
from bake.explain.without import Without
from bake.trace import create_tracer
from bake.types import BakeResult, Tally, VertexState
from tests.explain.baked_worlds import CPU, SETTINGS, baked, courtyard

ADAPTIVE = SETTINGS.replaced(rays=64, adaptive_error=0.015)


@pytest.fixture(scope="module")
def result() -> BakeResult:
    """The courtyard with a hedge, baked with adaptive rays."""
    low, high = np.array([[-3.0, 0.0, 1.0]], np.float32), np.array([[-1.0, 1.0, 3.0]], np.float32)
    density = np.array([0.7], np.float32)
    fog = FogBoxes(np.array([4], np.int32), low, high, density, density)
    return baked(courtyard(), ADAPTIVE, fog)


def test_shares_add_up_with_each_samples_own_rays(result: BakeResult) -> None:
    """Every sample is traced with as many rays as it sent, and the shares make up 1 - value."""
    assert len(np.unique(result.tally.rays)) >= 3
    with Explainer(result) as explainer:
        for vertex in np.flatnonzero(result.field.state <= VertexState.FILLED)[::5]:
            found = explainer.explain_vertex(int(vertex))
            told = np.sum([share.share for share in found.shares if share.kind is not ShareKind.RESIDUAL], axis=0)
            np.testing.assert_allclose(told, found.darkness, atol=1e-5)
            assert found.retrace_error < 1e-5
            sent = result.tally.rays[found.rays.sample]
            np.testing.assert_array_equal(found.rays.sent, sent)
            assert sum(share.rays for share in found.shares) <= 2 * int(sent.sum()), "a ray counts once an object"


def test_hidden_objects_are_taken_away_from_the_same_rays(result: BakeResult) -> None:
    """Without an object a sample sends the rays that it sent, and finds what a bake of them finds."""
    wanted = 1
    world = result.world
    gone = replace(world, face_casts=world.face_casts & (world.face_object != wanted))
    fog = None if result.decorators is None else result.decorators.fog
    rows = np.arange(0, len(result.samples), 3, dtype=np.int64)
    with Explainer(result) as explainer, create_tracer(gone, result.settings, CPU, fog=fog) as tracer:
        scene = Without(result, explainer.tracer, wanted)
        found, noticed = scene.traced(rows), scene.noticed(rows)
        surface = explainer.without_object(wanted)
        np.testing.assert_array_equal(found.rays, result.tally.rays[rows])
        for count in np.unique(found.rays).tolist():
            at = np.flatnonzero(found.rays == count)
            samples = result.samples.only(rows[at])
            samples = replace(samples, index=samples.index * np.int32(ADAPTIVE.rays // count))
            expected = Tally.empty(len(at), ADAPTIVE.distance_count)
            tracer.accumulate(samples, slice(0, len(at)), expected, rays=count)
            np.testing.assert_allclose(found.ao[at], expected.ao, atol=1e-6)
    same = ~noticed
    np.testing.assert_allclose(found.ao[same], result.tally.ao[rows[same]], atol=1e-5)
    assert 0 < surface.rays < surface.samples * ADAPTIVE.rays
