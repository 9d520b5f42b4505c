"""Whole explanations: shares that add up, objects that are named, spots that are refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.decorator_types import FogBoxes
from bake.errors import InputError, SettingsError
from bake.explain.explainer import Explainer
from bake.explain.spot import named_vertex, nearest_spot, nearest_weights, object_number
from bake.explain.types import Explanation, ShareKind
from bake.settings import BakeSettings, Kernel, MappingKind
from bake.types import BakeResult, Role, VertexState, World
from tests.explain.baked_worlds import SETTINGS, baked, courtyard, floor
from tests.worlds import icosphere, make_world, quad


def total(explanation: Explanation) -> np.ndarray:
    """Sum of the shares without what rounding leaves, shape (k,)."""
    told = [share.share for share in explanation.shares if share.kind is not ShareKind.RESIDUAL]
    return np.sum(told, axis=0)


CASES: dict[str, BakeSettings] = {
    "least-squares": SETTINGS,
    "average": SETTINGS.replaced(mapping=MappingKind.AVERAGE),
    "occlusion": SETTINGS.replaced(kernel=Kernel.OCCLUSION, max_distance=4.0),
    "one-distance": SETTINGS.replaced(distances=(0.5,), alpha=1.0),
}


@pytest.fixture(scope="module", params=list(CASES))
def explainer(request: pytest.FixtureRequest):
    """An explainer of the courtyard under several settings."""
    with Explainer(baked(courtyard(), CASES[request.param])) as found:
        yield found


def test_shares_add_up_at_every_vertex(explainer: Explainer) -> None:
    """Objects, bounds and samples of little weight make up 1 - value everywhere; rounding has nothing left."""
    result = explainer.result
    for vertex in np.flatnonzero(result.field.state <= VertexState.FILLED)[::3]:
        found = explainer.explain_vertex(int(vertex))
        np.testing.assert_allclose(found.value, result.field.ao[vertex], atol=1e-7)
        np.testing.assert_allclose(total(found), found.darkness, atol=1e-5)
        np.testing.assert_allclose(np.sum([item.share for item in found.shares], axis=0), found.darkness, atol=1e-12)
        assert found.weight_sum == pytest.approx(1.0, abs=1e-6)
        assert found.retrace_error < 1e-6


@settings(max_examples=30, deadline=None)
@given(face=st.integers(0, 127), u=st.floats(0.0, 1.0), v=st.floats(0.0, 1.0))
def test_shares_add_up_inside_faces(face: int, u: float, v: float) -> None:
    """The same anywhere on the floor, where the value is the interpolated one."""
    explainer = shared_explainer()
    u, v = (u, v) if u + v <= 1.0 else (1.0 - u, 1.0 - v)
    weights = np.array([u, v, 1.0 - u - v])
    found = explainer.explain_face(face, weights)
    expected = weights @ explainer.result.field.ao[explainer.result.world.faces[face]]
    np.testing.assert_allclose(found.value, expected, atol=1e-6)
    np.testing.assert_allclose(total(found), 1.0 - expected, atol=1e-5)


_SHARED: list[Explainer] = []


def shared_explainer() -> Explainer:
    """One explainer for all examples."""
    if not _SHARED:
        _SHARED.append(Explainer(baked(courtyard())))
    return _SHARED[0]


def test_own_and_carried_parts() -> None:
    """What samples on the spot's own faces saw, and what the fit brought from others, make up the shares."""
    explainer = shared_explainer()
    found = explainer.explain_vertex(40)
    own = np.sum([share.own for share in found.occluders], axis=0)
    samples = found.samples
    expected = samples.weight[samples.own] @ (1.0 - samples.ao[samples.own].astype(float))
    np.testing.assert_allclose(own, expected, atol=3e-4)
    brought = np.sum([item.share for item in found.carried], axis=0)
    away = ~samples.own
    np.testing.assert_allclose(brought, samples.weight[away] @ (1.0 - samples.ao[away].astype(float)), atol=1e-9)
    assert sum(item.samples for item in found.carried) == int(away.sum())
    assert sum(item.weight for item in found.carried) + found.own_weight == pytest.approx(found.weight_sum)
    for item in found.carried:
        assert item.nearest < item.farthest


def test_the_occluder_is_named() -> None:
    """Under a lid, the lid takes most; on its own top side nothing does."""
    world = make_world(floor(6, 6.0), quad(6.0, 0.5, up=False), quad(1.0, 3.0))
    explainer = Explainer(baked(world))
    with explainer:
        middle = explainer.explain_vertex(24)
        assert middle.occluders[0].name == "object_1"
        assert middle.occluders[0].share[-1] > 0.9 * middle.darkness[-1]
        assert middle.occluders[0].nearest == pytest.approx(0.5, abs=0.05)
        assert not middle.occluders[0].is_self
        roof = explainer.explain_vertex(int(world.first_vertex[2]))
        assert roof.value == pytest.approx(1.0)
        assert roof.occluders == ()


def test_an_object_darkens_itself() -> None:
    """Inside a hollow sphere everything is its own doing."""
    world = make_world(icosphere(2, 2.0, inward=True))
    with Explainer(baked(world)) as explainer:
        found = explainer.explain_vertex(5)
    assert [share.name for share in found.occluders] == ["object_0"]
    assert found.occluders[0].is_self
    assert found.value[-1] < 0.02


def test_fog_and_trees_have_shares() -> None:
    """A shrub's box and a tree's leaves take what they dim, and the block behind them what is left of it."""
    world = make_world(
        floor(4, 4.0),
        quad(8.0, 3.0, up=False),
        icosphere(1, 1.0, centre=(0.0, 1.5, 0.0)),
        quad(0.1, -5.0),
        roles=(Role.STATIC, Role.BLOCKER, Role.TREE, Role.SHRUB),
    )
    casts = (world.face_object == 1) | (world.face_object == 0)
    world = replace(world, face_casts=casts, face_samples=world.face_object == 0)
    low, high = np.array([[-4.0, 0.1, -4.0]], np.float32), np.array([[4.0, 1.1, 4.0]], np.float32)
    dense = np.array([0.7], np.float32)
    result = baked(world, SETTINGS, FogBoxes(np.array([3], np.int32), low, high, dense, dense))
    with Explainer(result) as explainer:
        found = explainer.explain_vertex(12)
    names = {share.name: share for share in found.occluders}
    assert set(names) == {"object_1", "object_2", "object_3"}
    np.testing.assert_allclose(total(found), found.darkness, atol=1e-5)
    assert names["object_3"].share[0] == pytest.approx(names["object_3"].share[1], abs=1e-6), "fog has no falloff"
    assert names["object_3"].share[1] > 0.4
    assert names["object_2"].share[1] > 0.05
    assert names["object_1"].share[1] > names["object_1"].share[0]


def test_partly_open_faces_pass_rays_on() -> None:
    """A lid that lets half of the light through takes half; what stands above it takes of the rest."""
    world = make_world(floor(4, 2.0), quad(40.0, 0.5, up=False), quad(40.0, 1.0, up=False))
    openness = np.where(world.face_object == 1, 0.5, 0.0).astype(np.float32)
    with Explainer(baked(replace(world, face_openness=openness), SETTINGS.replaced(rays=64))) as explainer:
        found = explainer.explain_vertex(12)
    lid, above = (next(share for share in found.occluders if share.object == number) for number in (1, 2))
    assert lid.share[1] == pytest.approx(0.5, abs=0.03)
    assert above.share[1] == pytest.approx(0.5, abs=0.03)


def test_other_settings_of_the_mapping_are_explained() -> None:
    """Another alpha is solved for and explained; another number of rays is refused."""
    result = baked(courtyard())
    with Explainer(result, result.settings.replaced(alpha=2.0)) as explainer:
        found = explainer.explain_vertex(30)
        assert np.abs(explainer.field.ao[30] - result.field.ao[30]).max() > 1e-3
        np.testing.assert_allclose(found.value, explainer.field.ao[30], atol=1e-7)
        np.testing.assert_allclose(total(found), found.darkness, atol=1e-5)
    with pytest.raises(SettingsError, match="--rays"):
        Explainer(result, result.settings.replaced(rays=32))


def test_a_value_held_at_a_bound_says_so() -> None:
    """Where the bounds hold a value, their part is told apart, and the held vertex is listed."""
    explainer = shared_explainer()
    result = explainer.result
    at_bound = np.flatnonzero((result.field.ao == 0.0).any(axis=1) | (result.field.ao == 1.0).any(axis=1))
    seen = 0
    for vertex in at_bound:
        found = explainer.explain_vertex(int(vertex))
        bounds = [share for share in found.shares if share.kind is ShareKind.BOUNDS]
        if not bounds:
            continue
        seen += 1
        np.testing.assert_allclose(found.unbounded - bounds[0].share, found.value, atol=1e-5)
        assert found.held
        assert np.abs(found.held[0].effect).max() > 0.0
        assert {0.0, 1.0} >= set(found.held[0].bound[np.isfinite(found.held[0].bound)])
    assert seen > 3


@pytest.mark.parametrize("seed", range(4))
def test_nearest_point_of_triangles(seed: int) -> None:
    """No point of a fine net on a triangle is nearer to the origin than the one found."""
    rng = np.random.default_rng(seed)
    corner = rng.normal(size=(40, 3, 3)) + rng.normal(size=(40, 1, 3))
    corner[0, 1] = corner[0, 0]  # a line
    corner[1] = corner[1, :1]  # a point
    weights = nearest_weights(corner)
    assert (weights >= -1e-12).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    found = np.linalg.norm(np.einsum("ij,ijk->ik", weights, corner), axis=1)
    u, v = np.meshgrid(np.linspace(0, 1, 30), np.linspace(0, 1, 30))
    net = np.column_stack([u.ravel(), v.ravel(), 1 - u.ravel() - v.ravel()])
    net = net[net[:, 2] >= 0]
    nearest = np.linalg.norm(np.einsum("pj,ijk->ipk", net, corner), axis=2).min(axis=1)
    assert (found <= nearest + 1e-9).all()


def test_points_snap_to_surfaces_that_have_values() -> None:
    """The nearest receiving surface is taken, even if a blocker is nearer."""
    world = make_world(quad(2.0), quad(2.0, 0.9), roles=(Role.STATIC, Role.BLOCKER))
    spot = nearest_spot(world, np.array([0.3, 0.8, -0.2]))
    assert spot.object == 0
    np.testing.assert_allclose(spot.position, [0.3, 0.0, -0.2], atol=1e-12)
    np.testing.assert_allclose(spot.normal, [0.0, 1.0, 0.0], atol=1e-12)


def _with_role(world: World, role: Role) -> BakeResult:
    result = baked(world)
    return replace(result, world=replace(world, object_roles=(Role.STATIC, role)))


@pytest.mark.parametrize("role", [Role.LOD, Role.TREE, Role.SHRUB, Role.SMALL, Role.BLOCKER, Role.IGNORE])
def test_spots_without_fitted_values_are_refused(role: Role) -> None:
    """An object that takes its values from elsewhere says from where."""
    explainer = Explainer(_with_role(make_world(quad(2.0), quad(1.0, 1.0)), role))
    with pytest.raises(InputError, match="object_1"):
        explainer.explain_vertex(5)


def test_names_of_vertices() -> None:
    """OBJECT:I counts within the object; what is wrong is said with what would be right."""
    world = make_world(quad(2.0), quad(1.0, 1.0))
    assert named_vertex(world, "object_1:2") == 6
    assert object_number(world, "object_1", "--x") == 1
    for text, hint in (("object_1", "OBJECT:NUMBER"), ("objekt_1:2", "object_1"), ("object_0:4", "0 to 3")):
        with pytest.raises(InputError, match=hint):
            named_vertex(world, text)


def test_unreferenced_vertices_are_refused() -> None:
    """A vertex that no face uses has nothing to explain."""
    positions, faces = quad(2.0)
    world = make_world((np.concatenate([positions, [[9.0, 0.0, 0.0]]]), faces))
    with pytest.raises(InputError, match="no triangle"):
        Explainer(baked(world)).explain_vertex(4)


def test_light_explanations_for_the_window() -> None:
    """The rays of the heaviest samples alone are still those samples' rays."""
    found = shared_explainer().explain_vertex(40)
    light = found.with_rays_of(3)
    assert light.rays.direction.shape == (3, 16, 3)
    np.testing.assert_array_equal(light.rays.open_share, found.rays.open_share[:3])
    np.testing.assert_array_equal(light.rays.sample, found.samples.index[:3])
