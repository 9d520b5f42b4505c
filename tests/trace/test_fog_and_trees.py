"""What dims rays without stopping them: closed forms on every tracer, and every tracer against brute force."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from bake.decorator_types import FogBoxes
from bake.settings import BakeSettings, Kernel
from bake.types import ObjectKeys, Role, World
from tests.trace.clutter import clutter
from tests.trace.conftest import open_tracer, trace_all
from tests.worlds import icosphere, make_world, quad

OPEN = BakeSettings(kernel=Kernel.OCCLUSION, max_distance=1e4, rays=256, samples_per_face=(4, 4))
OBSCURANCE = BakeSettings(rays=32, samples_per_face=(2, 4), sample_spacing=1.0)
SQRT_4PI = math.sqrt(4.0 * math.pi)


def fog(*boxes: tuple[tuple[float, ...], tuple[float, ...], float]) -> FogBoxes:
    """Boxes from (low, high, density)."""
    density = np.array([b[2] for b in boxes], np.float32)
    low, high = (np.array([b[i] for b in boxes], np.float32).reshape(-1, 3) for i in (0, 1))
    return FogBoxes(np.arange(len(boxes), dtype=np.int32), low, high, density, density)


def shot(body: str, world: World, origin: tuple[float, ...], boxes: FogBoxes | None, seed: int = 1) -> np.ndarray:
    """Nine coefficients of what is open around a point, with nothing opaque near."""
    with open_tracer(body, world, OPEN, fog=boxes) as tracer:
        return tracer.gather_sphere(np.array([origin], np.float32), np.array([seed], np.uint32), 4096).sh[0, :, 0]


FAR = quad(1e-3, -5e4)
WIDE = 1e6


def slab_share(depth: float) -> float:
    """∫ exp(-τ / cos θ) over a hemisphere, as a share of it: the exponential integral E₂."""
    from scipy.special import expn

    return float(expn(2, depth))


@pytest.mark.parametrize(("density", "thickness"), [(0.5, 2.0), (0.05, 1.0), (3.0, 1.0)])
def test_endless_slab_above_dims_as_the_integral_says(body: str, density: float, thickness: float) -> None:
    """Every direction up crosses the slab on a length thickness / cos θ, so that E₂(σ thickness) is left of it."""
    slab = fog(((-WIDE, 1.0, -WIDE), (WIDE, 1.0 + thickness, WIDE), density))
    found = shot(body, make_world(FAR), (0.0, 0.0, 0.0), slab)
    expected = 0.5 * (1.0 + slab_share(density * thickness))
    assert found[0] / SQRT_4PI == pytest.approx(expected, abs=0.002)


def test_slab_dims_surface_samples(body: str) -> None:
    """On a surface the share is weighted by cos θ: 2 E₃(σ thickness)."""
    from scipy.special import expn

    world = make_world(quad(0.1))
    _, tally = trace_all(body, world, OPEN, fog=fog(((-WIDE, 1.0, -WIDE), (WIDE, 2.0, WIDE), 0.8)))
    assert tally.ao.mean() == pytest.approx(2.0 * float(expn(3, 0.8)), abs=0.002)
    assert tally.hits.sum() == 0


@pytest.mark.parametrize("radius", [0.5, 30.0])
def test_fog_counts_up_to_the_opaque_hit(body: str, radius: float) -> None:
    """In a sphere full of fog a ray counts for ρ(r) exp(-σ r): from its origin inside the box to what stops it."""
    sphere = icosphere(3 if body == "brute" else 4, radius, inward=True)
    world, boxes = make_world(sphere), fog(((-WIDE,) * 3, (WIDE,) * 3, 0.1))
    with open_tracer(body, world, BakeSettings(), fog=boxes) as tracer:
        found = tracer.gather_sphere(np.zeros((1, 3), np.float32), np.zeros(1, np.uint32), 1024)
    rho = 1.0 - 2.0 ** (-radius / np.array([2.0, 300.0]))
    np.testing.assert_allclose(found.sh[0, 0] / SQRT_4PI, rho * math.exp(-0.1 * radius), rtol=0.012)


def test_coincident_boxes_of_shared_density_equal_one(body: str) -> None:
    """Five boxes of a fifth of the density dim as one of the whole."""
    low, high = (-1.0, 0.5, -2.0), (1.5, 3.0, 2.0)
    world = make_world(FAR)
    one = shot(body, world, (0.0, 0.0, 0.0), fog((low, high, 1.0)))
    five = shot(body, world, (0.0, 0.0, 0.0), fog(*[(low, high, 0.2)] * 5))
    np.testing.assert_allclose(five, one, atol=2e-5)


@pytest.mark.parametrize("leaves", [1, 2, 5])
def test_each_leaf_halves(body: str, leaves: int) -> None:
    """Above k endless leaves the lower half keeps 2⁻ᵏ."""
    cards = [quad(1e6, -1.0 - i, centre=(2e5, -1e5)) for i in range(leaves)]
    world = trees_world(cards)
    found = shot(body, world, (0.0, 0.0, 0.0), None)
    assert found[0] / SQRT_4PI == pytest.approx(0.5 + 0.5**leaves / 2.0, abs=1e-3)


@pytest.mark.parametrize(("openness", "transmission"), [(0.3, 0.5), (0.0, 0.25), (0.6, 0.0), (0.0, 0.0), (1.0, 0.5)])
def test_openness_and_transmission_combine(body: str, openness: float, transmission: float) -> None:
    """A card of openness o lets o + (1 - o) τ through."""
    world = trees_world([quad(1e6, -1.0, centre=(2e5, -1e5))], openness=openness, transmission=transmission)
    found = shot(body, world, (0.0, 0.0, 0.0), None)
    passes = openness + (1.0 - openness) * transmission
    assert found[0] / SQRT_4PI == pytest.approx(0.5 + 0.5 * passes, abs=1e-3)


def test_leaf_textures_are_looked_up(body: str) -> None:
    """With look-up at the hit, stripes that are half open and half closed average."""
    world = trees_world([quad(400.0, -1.0, centre=(80.0, -40.0))], transmission=0.0)
    stripes = np.tile(np.array([0.0, 1.0], np.float32), (4, 8))
    leaf = np.array([-1] * (world.face_count - 2) + [0, 0], np.int32)
    uv = (world.positions[:, [0, 2]] * 0.3).astype(np.float32)
    world = replace(world, vertex_uv=uv, face_texture=leaf, textures=(stripes,))
    found = shot(body, world, (0.0, 0.0, 0.0), None)
    assert found[0] / SQRT_4PI == pytest.approx(0.75, abs=0.03)


def trees_world(
    leaves: list[tuple[np.ndarray, np.ndarray]], *, openness: float = 0.0, transmission: float | None = None
):
    """A far quad that casts, and a tree of some leaves."""
    positions = np.concatenate([p for p, _ in leaves])
    first = np.cumsum([0, *(len(p) for p, _ in leaves)])
    faces = np.concatenate([f + v for (_, f), v in zip(leaves, first, strict=False)])
    flags = np.array([True, True] + [False] * len(faces))
    return make_world(
        FAR,
        (positions, faces),
        casts=flags,
        samples=flags,
        openness=np.where(flags, 0.0, openness),
        roles=(Role.STATIC, Role.TREE),
        keys=(ObjectKeys(), ObjectKeys(transmission=transmission)),
    )


def aimed(body: str, origin: tuple[float, ...], direction: tuple[float, ...], box: FogBoxes) -> float:
    """What passes along one ray of 100 m."""
    d = np.asarray(direction, float)
    with open_tracer(body, make_world(FAR), OPEN, fog=box) as tracer:
        return float(tracer.transmittance(np.array([origin], np.float32), d[None].astype(np.float32), 100.0)[0])


@pytest.mark.parametrize(
    ("origin", "direction", "length"),
    [
        ((-1.0, 0.5, 0.5), (1, 0, 0), 2.0),  # straight through
        ((-1.0, 0.0, 0.5), (1, 0, 0), 2.0),  # along the low face: inside
        ((-1.0, 1.0, 0.5), (1, 0, 0), 0.0),  # along the high face: outside
        ((-1.0, 0.0, 0.0), (1, 0, 0), 2.0),  # along a low edge
        ((3.0, 0.0, 0.5), (-1, 0, 0), 2.0),
        ((0.5, 0.5, 0.5), (1, 0, 0), 1.5),  # from inside
        ((0.0, 0.5, 0.5), (1, 0, 0), 2.0),  # from a face
        ((2.0, 0.5, 0.5), (1, 0, 0), 0.0),  # away from a face
        ((0.5, 0.5, -3.0), (0, 0, -1), 0.0),  # away
        ((0.0, 0.0, 0.0), (0.6, 0.8, 0.0), 1.25),  # out of a corner
        ((-1.0, -1.0, 0.5), (-1, 0, 0), 0.0),
    ],
)
def test_lengths_in_a_box(body: str, origin: tuple[float, ...], direction: tuple[float, ...], length: float) -> None:
    """exp(-σ L), also along faces and edges and from inside."""
    box = fog(((0.0, 0.0, 0.0), (2.0, 1.0, 1.0), 0.7))
    assert aimed(body, origin, direction, box) == pytest.approx(math.exp(-0.7 * length), abs=1e-6)


@pytest.mark.parametrize("axis", range(3))
def test_box_without_thickness_is_nothing(body: str, axis: int) -> None:
    """Neither across nor along a flat box is anything dimmed."""
    high = np.ones(3)
    high[axis] = 0.0
    box = fog(((0.0, 0.0, 0.0), tuple(high), 5.0))
    for direction in np.eye(3):
        assert aimed(body, tuple(np.full(3, 0.5) * (high > 0) - direction), tuple(direction), box) == 1.0


def test_boxes_that_share_a_face_count_once_along_it(body: str) -> None:
    """A ray in the face between two boxes is in one of them."""
    two = fog(((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 1.0), ((0.0, 1.0, 0.0), (1.0, 2.0, 1.0), 1.0))
    assert aimed(body, (-1.0, 1.0, 0.5), (1, 0, 0), two) == pytest.approx(math.exp(-1.0), abs=1e-6)


def test_depth_is_clamped(body: str) -> None:
    """Thousands of kilometres of fog leave e⁻⁴⁰ and no infinity or NaN."""
    box = fog(((-WIDE,) * 3, (WIDE,) * 3, 1000.0))
    assert aimed(body, (0.0, 0.0, 0.0), (0, 1, 0), box) == pytest.approx(math.exp(-40.0), rel=1e-4)


def veiled_clutter(seed: int, *, leaves: bool) -> World:
    """Clutter of which every third object is a tree."""
    world = clutter(seed)
    if not leaves:
        return world
    tree = np.arange(world.object_count) % 3 == 2
    rng = np.random.default_rng(seed)
    keys = tuple(
        ObjectKeys(offset=k.offset, transmission=float(rng.random()) if t and rng.random() < 0.5 else None)
        for k, t in zip(world.object_keys, tree, strict=True)
    )
    of_tree = tree[world.face_object]
    return replace(
        world,
        object_roles=tuple(Role.TREE if t else Role.STATIC for t in tree),
        object_keys=keys,
        face_casts=world.face_casts & ~of_tree,
        face_samples=world.face_samples & ~of_tree,
    )


def scattered(seed: int, count: int = 60) -> FogBoxes:
    """Boxes of fog all over the clutter, some coincident, some flat, some without density."""
    rng = np.random.default_rng(seed)
    low = rng.uniform(-5, 4, (count, 3)) * [1, 0.4, 1]
    size = rng.uniform(0.2, 2.0, (count, 3))
    size[::11, 1] = 0.0
    low[1::7], size[1::7] = low[0], size[0]
    density = np.where(rng.random(count) < 0.1, 0.0, rng.uniform(0.02, 1.0, count)).astype(np.float32)
    high = (low + size).astype(np.float32)
    return FogBoxes(np.arange(count, dtype=np.int32), low.astype(np.float32), high, density, density)


@pytest.mark.parametrize("kernel", list(Kernel))
@pytest.mark.parametrize(("boxes", "leaves"), [(True, False), (False, True), (True, True)])
def test_fast_tracers_equal_brute_force(fast_body: str, boxes: bool, leaves: bool, kernel: Kernel) -> None:
    """Per sample the fused kernels agree with NumPy, with fog, trees and both."""
    settings = OBSCURANCE.replaced(kernel=kernel, max_distance=50.0 if kernel is Kernel.OCCLUSION else None)
    world, some = veiled_clutter(3, leaves=leaves), scattered(4) if boxes else None
    _, expected = trace_all("brute", world, settings, fog=some)
    _, tally = trace_all(fast_body, world, settings, fog=some)
    _, plain = trace_all(fast_body, world, settings.replaced(skip=("trees",)))
    difference = np.abs(tally.ao - expected.ao).max(1)
    assert np.quantile(difference, 0.98) < 3e-5
    assert difference.max() <= 2.0 / settings.rays
    np.testing.assert_array_equal(tally.hits, plain.hits)
    np.testing.assert_array_equal(tally.back_faces, plain.back_faces)
    assert tally.ao.mean() < plain.ao.mean() - 0.01


@pytest.mark.parametrize("leaves", [False, True])
def test_spheres_equal_brute_force(fast_body: str, leaves: bool) -> None:
    """Point for point the gather agrees, with trees and without them."""
    world, some = veiled_clutter(3, leaves=True), scattered(4)
    points = np.random.default_rng(8).uniform(-4, 4, (64, 3)).astype(np.float32)
    found, expected = [], []
    for body, into in ((fast_body, found), ("brute", expected)):
        with open_tracer(body, world, OBSCURANCE, fog=some) as tracer:
            into.append(tracer.gather_sphere(points, np.arange(64, dtype=np.uint32), 64, trees=leaves).sh)
    difference = np.abs(found[0] - expected[0]).max(axis=(1, 2))
    assert np.quantile(difference, 0.9) < 2e-4
    assert difference.max() < 2.0 * 4.0 * math.pi / 64


def test_many_boxes_equal_brute_force(fast_body: str) -> None:
    """A tree of several levels finds what trying every box finds, whatever the number of boxes."""
    rng = np.random.default_rng(5)
    for count in (1, 7, 8, 9, 65, 700):
        low = rng.uniform(-20, 20, (count, 3)).astype(np.float32)
        high = low + rng.uniform(0.1, 3.0, (count, 3)).astype(np.float32)
        density = rng.uniform(0.01, 0.3, count).astype(np.float32)
        boxes = FogBoxes(np.arange(count, dtype=np.int32), low, high, density, density)
        origins = rng.uniform(-20, 20, (500, 3)).astype(np.float32)
        ways = rng.normal(size=(500, 3))
        ways = (ways / np.linalg.norm(ways, axis=1, keepdims=True)).astype(np.float32)
        passes = []
        for body in ("brute", fast_body):
            with open_tracer(body, make_world(FAR), OPEN, fog=boxes) as tracer:
                passes.append(tracer.transmittance(origins, ways, 15.0))
        np.testing.assert_allclose(passes[1], passes[0], atol=2e-5)


def test_scene_without_shrubs_and_trees_builds_nothing() -> None:
    """Without fog and trees no structure is built."""
    for body in ("embree", "warp-cpu"):
        with open_tracer(body, make_world(quad()), OPEN) as tracer:
            assert (tracer.fog_boxes, tracer.tree_triangles) == (0, 0)
