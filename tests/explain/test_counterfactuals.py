"""AO without an object: a spot and the whole surface, against a bake without it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bake.decorator_types import FogBoxes
from bake.decorators.fog_density import without_overlap
from bake.errors import InputError
from bake.explain.explainer import Explainer
from bake.explain.spot import vertex_spot
from bake.settings import BakeSettings, MappingKind
from bake.types import BakeResult, Role, VertexState, World
from tests.explain.baked_worlds import SETTINGS, baked, baked_without, courtyard, floor
from tests.worlds import box, icosphere, make_world, quad

CASES: dict[str, BakeSettings] = {
    "least-squares": SETTINGS,
    "smooth": SETTINGS.replaced(alpha=1.0),
    "average": SETTINGS.replaced(mapping=MappingKind.AVERAGE),
    "two-samples": SETTINGS.replaced(samples_per_face=(2, 3)),
}


def receiving(result: BakeResult) -> np.ndarray:
    """Vertices with values of their own."""
    return np.flatnonzero(result.field.state <= VertexState.FILLED)


@pytest.mark.parametrize("case", list(CASES))
@pytest.mark.parametrize("wanted", range(5))
def test_surface_and_spots_equal_a_bake_without_the_object(case: str, wanted: int) -> None:
    """Every value, the filled ones and those that lose or gain all their samples among them."""
    result = baked(courtyard(), CASES[case])
    expected = baked_without(result, wanted)
    with Explainer(result) as explainer:
        surface = explainer.without_object(wanted)
        np.testing.assert_allclose(surface.ao, expected.field.ao, atol=1e-6, equal_nan=True)
        np.testing.assert_array_equal(surface.state, expected.field.state)
        was, now = (r.tally.valid(r.settings.back_face_threshold) for r in (result, expected))
        assert (surface.became_valid, surface.became_invalid) == ((now & ~was).sum(), (was & ~now).sum())
        for vertex in receiving(result)[::2]:
            found = explainer.spot_without(vertex_spot(result, int(vertex)), wanted)
            np.testing.assert_allclose(found.after, expected.field.ao[vertex], atol=1e-4)
            assert not found.is_estimate


def test_the_level_changes_as_it_should() -> None:
    """Without the block the small box in it sees daylight, and the vertices it had buried are no longer filled."""
    result = baked(courtyard())
    small = slice(int(result.world.first_vertex[4]), int(result.world.first_vertex[5]))
    with Explainer(result) as explainer:
        found = explainer.without_object(1)
        assert found.samples > 100
        assert found.became_valid > 0
        assert (found.ao[small, 1] > result.field.ao[small, 1]).mean() > 0.5
        spot = vertex_spot(result, small.start)
        assert explainer.spot_without(spot, 1).became_valid > 0


def test_before_the_surface_is_known_a_spot_is_close() -> None:
    """A spot alone is right but for the scene's noise, and says when that may matter."""
    result = baked(courtyard())
    expected = baked_without(result, 1)
    with Explainer(result) as explainer:
        estimates = [explainer.spot_without(vertex_spot(result, int(v)), 1) for v in receiving(result)[::3]]
    vertices = receiving(result)[::3]
    apart = [np.abs(e.after - expected.field.ao[v]).max() for e, v in zip(estimates, vertices, strict=True)]
    assert np.median(apart) < 2e-3
    assert max(apart) < 0.05
    assert all(estimate.is_estimate for estimate in estimates), "in so small a level everybody sees the block"


def test_an_object_that_nobody_sees_changes_nothing() -> None:
    """No ray meets it, nothing is traced, and the values are the stored ones."""
    world = make_world(floor(4, 4.0), box((0.1, 0.1, 0.1), centre=(0.0, -2.0, 0.0)))
    result = baked(world)
    with Explainer(result) as explainer:
        surface = explainer.without_object(0)
        assert surface.samples > 0, "the small box sees the floor"
        spot = explainer.spot_without(vertex_spot(result, 3), 1)
    assert spot.samples == 0
    np.testing.assert_array_equal(spot.before, spot.after)


def test_an_object_that_casts_nothing_is_no_cause() -> None:
    """A receiver can be asked about; the answer is that nothing changes."""
    world = make_world(floor(4, 4.0), quad(1.0, 1.0), roles=(Role.STATIC, Role.RECEIVER))
    world = replace(world, face_casts=world.face_object == 0)
    result = baked(world)
    with Explainer(result) as explainer:
        np.testing.assert_array_equal(explainer.without_object(1).ao, result.field.ao)
        with pytest.raises(InputError, match="no object 7"):
            explainer.without_object(7)


def garden() -> tuple[World, FogBoxes]:
    """A floor with a tree and two shrubs whose boxes overlap."""
    world = make_world(
        floor(6, 6.0),
        icosphere(1, 1.0, centre=(1.0, 1.5, 0.0)),
        quad(0.1, -5.0),
        quad(0.1, -6.0),
        roles=(Role.STATIC, Role.TREE, Role.SHRUB, Role.SHRUB),
    )
    on_floor = world.face_object == 0
    low = np.array([[-2.0, 0.1, -2.0], [-1.5, 0.1, -1.0]], np.float32)
    high = np.array([[0.0, 1.1, 0.0], [1.0, 1.5, 1.0]], np.float32)
    given = np.array([1.0, 0.6], np.float32)
    boxes = FogBoxes(np.array([2, 3], np.int32), low, high, given, without_overlap(low, high, given))
    return replace(world, face_casts=on_floor, face_samples=on_floor), boxes


@pytest.mark.parametrize("wanted", [1, 2, 3])
def test_trees_and_shrubs(wanted: int) -> None:
    """Without a shrub the other one is as dense as it was made; without a tree its leaves are gone."""
    world, boxes = garden()
    result = baked(world, SETTINGS, boxes)
    rest: FogBoxes | None = boxes
    if wanted > 1:
        there = boxes.object != wanted
        kept = [getattr(boxes, name)[there] for name in ("object", "minimum", "maximum", "given_density")]
        rest = FogBoxes(*kept, density=without_overlap(kept[1], kept[2], kept[3]))
        assert rest.density[0] > boxes.density[there][0]
    expected = baked_without(result, wanted, rest)
    with Explainer(result) as explainer:
        surface = explainer.without_object(wanted)
        np.testing.assert_allclose(surface.ao, expected.field.ao, atol=2e-5, equal_nan=True)
        for vertex in receiving(result)[::5]:
            found = explainer.spot_without(vertex_spot(result, int(vertex)), wanted)
            np.testing.assert_allclose(found.after, expected.field.ao[vertex], atol=1e-4)


def test_closing_the_steps_cancels() -> None:
    """The work can be stopped between two steps, and the explainer goes on."""
    result = baked(courtyard())
    with Explainer(result) as explainer:
        steps = explainer.without_steps(1)
        assert next(steps).stage == "trace"
        steps.close()
        assert explainer.without_object(1).samples > 0
