"""Small decorators take on the baked AO around them."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np
import pytest

from bake.decorators.lods import RAYS as LOD_RAYS
from bake.decorators.resample import BakedSurface, sphere_directions, sphere_reader, spheres_of
from bake.decorators.small import RAYS, REACH, SmallBake, bake_small, spheres
from bake.devices import resolve
from bake.settings import BakeSettings, TracerKind
from bake.trace import create_tracer
from bake.types import Role, SolveReport, VertexField, World
from tests.worlds import box, icosphere, make_world, quad

SETTINGS = BakeSettings(device="cpu")
REPORT = SolveReport(0, 0, 0, 0.0, 0, (0, 0), (0.0, 0.0))


def field_of(world: World, values: list[tuple[float, float] | None]) -> VertexField:
    """The same AO all over an object; None: not baked."""
    counts = np.diff(world.first_vertex)
    rows = [(np.nan, np.nan) if value is None else value for value in values]
    ao = np.repeat(np.float32(rows), counts, axis=0)
    state = np.where(np.isnan(ao[:, 0]), 3, 0).astype(np.uint8)
    return VertexField(ao, state, REPORT)


def finished(work: Generator[Any, None, Any]) -> Any:
    """Runs a stage to its end."""
    while True:
        try:
            next(work)
        except StopIteration as done:
            return done.value


def baked(world: World, field: VertexField, *, tracer: str = "embree", **options: Any) -> SmallBake:
    """Small decorators of a world in which everything that casts stops rays."""
    settings = SETTINGS.replaced(tracer=TracerKind(tracer), **options)
    with create_tracer(world, settings, resolve("cpu")) as caster:
        return finished(bake_small(world, BakedSurface.of(world, field), settings, caster))


def clump(x: float = 0.0, y: float = 0.0, size: float = 0.4) -> tuple[np.ndarray, np.ndarray]:
    """A crossed pair of upright cards standing at (x, y, 0)."""
    h = size / 2
    card = np.array([[-h, 0, 0], [h, 0, 0], [h, size, 0], [-h, size, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    positions = np.concatenate([card, card[:, [2, 1, 0]]])
    return positions + np.array([x, y, 0.0]), np.concatenate([faces, faces + 4])


def world_with_clumps(
    *surfaces: tuple[np.ndarray, np.ndarray], clumps: int = 1, role: Role = Role.SMALL, **where: float
) -> World:
    """Static surfaces and small decorators that neither cast nor receive."""
    objects = [*surfaces, *(clump(**where) for _ in range(clumps))]
    face_counts = [len(faces) for _, faces in objects]
    is_static = np.repeat([i < len(surfaces) for i in range(len(objects))], face_counts)
    roles = (Role.STATIC,) * len(surfaces) + (role,) * clumps
    return make_world(*objects, roles=roles, casts=is_static, samples=is_static)


@pytest.mark.parametrize("count", [LOD_RAYS, RAYS])
def test_no_ray_runs_inside_a_plane_of_two_axes(count: int) -> None:
    """Floors, ledges and walls lie in such planes: a ray inside one would strike them or not as rounding has it."""
    outward = sphere_directions(count)
    np.testing.assert_allclose(np.linalg.norm(outward, axis=1), 1.0)
    assert np.abs(outward).min() > 1e-3


@pytest.mark.parametrize("tracer", ["embree", "warp", "brute"])
def test_a_uniform_surface_gives_its_value(tracer: str) -> None:
    """A clump on a floor of one value takes on exactly that value, at every distance."""
    world = world_with_clumps(quad(8.0))
    result = baked(world, field_of(world, [(0.3, 0.7), None]), tracer=tracer)
    assert result.small is not None
    assert result.shrubs is None
    np.testing.assert_array_equal(result.small.object, [1])
    np.testing.assert_allclose(result.small.ao, [[0.3, 0.7]], atol=1e-7)
    assert result.small.found.all()
    assert not result.findings
    assert result.rays >= RAYS


def test_two_surfaces_are_weighted_by_depth_and_solid_angle() -> None:
    """Floor and wall at known distances: the weights are the mean depths of the rays that strike them."""
    h, x, r = 0.2, 0.3, 0.5
    wall = (np.array([[x, -9, -9], [x, 9, -9], [x, 9, 9], [x, -9, 9.0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    world = world_with_clumps(quad(18.0), wall, y=0.0)
    result = baked(world, field_of(world, [(0.0, 1.0), (1.0, 0.0), None]), decorator_radius=r)
    outward = sphere_directions(200_000)
    # Of the surfaces on a ray the one nearer to the centre counts: the smaller of the two distances.
    with np.errstate(divide="ignore"):
        floor = np.where(outward[:, 1] < 0, h / -outward[:, 1], np.inf)
        side = np.where(outward[:, 0] > 0, x / outward[:, 0], np.inf)
    nearest = np.minimum(floor, side)
    weight = np.where(nearest < r, r - nearest, 0.0)
    expected = weight[side < floor].sum() / weight.sum()
    assert result.small is not None
    np.testing.assert_allclose(result.small.ao[0], [expected, 1.0 - expected], atol=0.02)


def test_the_underside_of_a_slab_does_not_count() -> None:
    """On a thin slab the clump takes the top's value although rays from below meet the underside first."""
    world = world_with_clumps(quad(8.0), quad(8.0, -0.05, up=False))
    result = baked(world, field_of(world, [(0.9, 0.8), (0.0, 0.0), None]))
    assert result.small is not None
    np.testing.assert_allclose(result.small.ao, [[0.9, 0.8]], atol=1e-6)


def test_surfaces_without_values_are_passed() -> None:
    """A blocker right under the clump hides nothing: the baked floor below it counts."""
    world = world_with_clumps(quad(8.0, -0.05), quad(8.0, 0.0))
    result = baked(world, field_of(world, [(0.4, 0.5), None, None]))
    assert result.small is not None
    np.testing.assert_allclose(result.small.ao, [[0.4, 0.5]], atol=1e-6)


def test_nothing_around_is_open_and_said() -> None:
    """Without any surface in reach the value is 1, the flag is off, and one finding counts the objects."""
    world = world_with_clumps(quad(8.0), y=50.0, clumps=3)
    result = baked(world, field_of(world, [(0.3, 0.7), None, None, None]))
    assert result.small is not None
    np.testing.assert_array_equal(result.small.ao, np.ones((3, 2)))
    assert not result.small.found.any()
    (finding,) = result.findings
    assert (finding.object, finding.what, finding.count) == ("object_1", "no-surface-around", 3)


def test_nothing_baked_at_all() -> None:
    """A world in which nothing carries AO leaves every decorator open."""
    world = world_with_clumps(quad(8.0))
    result = baked(world, field_of(world, [None, None]))
    assert result.small is not None
    np.testing.assert_array_equal(result.small.ao, [[1.0, 1.0]])


def test_inside_a_solid() -> None:
    """A clump sunk into a box takes the box's value; wholly inside, out of reach, it is open."""
    near = world_with_clumps(box((0.6, 0.6, 0.6), centre=(0.0, 0.2, 0.0)))
    result = baked(near, field_of(near, [(0.2, 0.6), None]))
    assert result.small is not None
    np.testing.assert_allclose(result.small.ao, [[0.2, 0.6]], atol=1e-6)
    far = world_with_clumps(box((9.0, 9.0, 9.0)))
    result = baked(far, field_of(far, [(0.2, 0.6), None]))
    assert result.small is not None
    assert not result.small.found.any()


@pytest.mark.parametrize("mirrored", [False, True])
def test_turned_and_mirrored_scenes(mirrored: bool) -> None:
    """The values follow a scene that is turned, mirrored and far away: floor and wall keep their shares."""
    wall = (np.array([[0.3, -9, -9], [0.3, 9, -9], [0.3, 9, 9], [0.3, -9, 9.0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    plain = world_with_clumps(quad(18.0), wall)
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn)) * (-1.0 if mirrored else 1.0)
    objects = [
        (plain.positions[plain.first_vertex[i] : plain.first_vertex[i + 1]] @ turn.T + 800.0,
         plain.faces[plain.first_face[i] : plain.first_face[i + 1]] - plain.first_vertex[i])
        for i in range(3)
    ]  # fmt: skip
    turned = make_world(*objects, roles=plain.object_roles, casts=plain.face_casts, samples=plain.face_samples)
    values: list[tuple[float, float] | None] = [(0.0, 1.0), (1.0, 0.0), None]
    a = baked(plain, field_of(plain, values), decorator_radius=0.5).small
    b = baked(turned, field_of(turned, values), decorator_radius=0.5).small
    assert a is not None
    assert b is not None
    # The box of a turned clump is another one, so that its middle may move a little.
    np.testing.assert_allclose(b.ao, a.ao, atol=0.08)
    uniform = baked(turned, field_of(turned, [(0.25, 0.5), (0.25, 0.5), None])).small
    assert uniform is not None
    np.testing.assert_allclose(uniform.ao, [[0.25, 0.5]], atol=1e-6)


def test_a_gradient_is_read_at_its_place() -> None:
    """On a floor whose AO grows along x, each of many clumps reads the value under it."""
    places = np.linspace(-3.0, 3.0, 9)
    objects = [quad(8.0), *(clump(x=float(x)) for x in places)]
    static = np.repeat([True] + [False] * 9, [len(f) for _, f in objects])
    world = make_world(*objects, roles=(Role.STATIC,) + (Role.SHRUB,) * 9, casts=static, samples=static)
    field = field_of(world, [(0.0, 0.0)] + [None] * 9)
    field.ao[:4] = (0.5 + world.positions[:4, :1] / 8.0).astype(np.float32)
    result = baked(world, field)
    assert result.small is None
    assert result.shrubs is not None
    np.testing.assert_allclose(result.shrubs.ao[:, 0], 0.5 + places / 8.0, atol=0.01)


def test_spheres_follow_the_vertices_that_are_used() -> None:
    """A stray vertex that no face uses moves nothing; a point has the least radius; a setting replaces all radii."""
    positions, faces = clump()
    stray = (np.concatenate([positions, [[90.0, 0.0, 0.0]]]), faces)
    point = (np.zeros((3, 3)), np.array([[0, 1, 2]]))
    world = make_world(stray, point, roles=(Role.SMALL,) * 2)
    centres, radii = spheres(world, np.int32([0, 1]), None)
    np.testing.assert_allclose(centres, [[0.0, 0.2, 0.0], [0.0, 0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(radii, [0.5 * REACH * 0.4 * np.sqrt(3), 0.05])
    np.testing.assert_array_equal(spheres(world, np.int32([0, 1]), 0.7)[1], [0.7, 0.7])


def test_a_surface_through_the_centre_is_found() -> None:
    """A centre that lies on a surface, anywhere in a wide level, reads that surface at the very point."""
    positions, faces = icosphere(3, 5.0, centre=(900.0, -400.0, 300.0))
    world = make_world((positions, faces))
    random = np.random.default_rng(5)
    field = VertexField(
        random.random((len(positions), 2)).astype(np.float32), np.zeros(len(positions), np.uint8), REPORT
    )
    face = random.integers(0, len(faces), 50)
    weights = random.dirichlet(np.ones(3), 50)
    corners = world.positions.astype(np.float32)[world.faces[face]].astype(np.float64)
    points = np.einsum("ij,ijk->ik", weights, corners)
    expected = np.einsum("ij,ijk->ik", weights, field.ao[world.faces[face]].astype(np.float64))
    with create_tracer(world, SETTINGS, resolve("cpu")) as caster:
        reader = sphere_reader(BakedSurface.of(world, field), caster, rays=32)
        around = reader.read(spheres_of(points, np.full(50, 0.3)))
    np.testing.assert_allclose(around.ao, expected, atol=2e-3)
    assert (around.hits == 32).mean() > 0.9
