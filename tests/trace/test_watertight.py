"""No ray escapes a closed mesh, and none hits the face that it starts from."""

from __future__ import annotations

import numpy as np
import pytest

from bake.samples import place_samples
from bake.settings import BakeSettings, Kernel
from bake.types import Tally
from tests.trace.conftest import open_tracer
from tests.worlds import box, icosphere, make_world

CLOSED = {
    "sphere": icosphere(4, 1.0, inward=True),
    "box": box((2.0, 1.0, 3.0), inward=True),
    "far sphere": icosphere(4, 3.0, inward=True, centre=(700.0, -300.0, 250.0)),
}


def unit(vectors: np.ndarray) -> np.ndarray:
    """Unit vectors in float32."""
    return (vectors / np.linalg.norm(vectors, axis=1, keepdims=True)).astype(np.float32)


def leaks(body: str, shape: tuple[np.ndarray, np.ndarray], targets: np.ndarray, seed: int) -> int:
    """How many rays from inside the shape toward targets (or anywhere, where NaN) hit nothing."""
    rng = np.random.default_rng(seed)
    centre = shape[0].mean(0)
    origins = (centre + rng.uniform(-0.2, 0.2, (len(targets), 3))).astype(np.float32)
    directions = np.where(np.isnan(targets), rng.normal(size=targets.shape), targets - origins)
    with open_tracer(body, make_world(shape), BakeSettings()) as tracer:
        return int((tracer.nearest(origins, unit(directions), 1e6).face < 0).sum())


@pytest.mark.parametrize("name", CLOSED)
def test_random_rays_do_not_leak(fast_body: str, name: str) -> None:
    """A million random rays into closed meshes: none gets out."""
    count = 1_000_000 // len(CLOSED) + 1
    assert leaks(fast_body, CLOSED[name], np.full((count, 3), np.nan), seed=1) == 0


@pytest.mark.parametrize("name", CLOSED)
def test_rays_at_vertices_do_not_leak(fast_body: str, name: str) -> None:
    """Rays aimed exactly at vertices, where boxes and triangles meet: under 10⁻⁴ get out."""
    positions = CLOSED[name][0].astype(np.float32).astype(np.float64)
    targets = positions[np.random.default_rng(2).integers(0, len(positions), 200_000)]
    assert leaks(fast_body, CLOSED[name], targets, seed=3) < 20


@pytest.mark.parametrize("name", CLOSED)
def test_rays_at_edges_do_not_leak(fast_body: str, name: str) -> None:
    """Rays aimed at points of edges: under 10⁻⁴ get out."""
    positions, faces = CLOSED[name][0].astype(np.float32).astype(np.float64), CLOSED[name][1]
    rng = np.random.default_rng(4)
    face = faces[rng.integers(0, len(faces), 200_000)]
    share = rng.random((200_000, 1))
    targets = share * positions[face[:, 0]] + (1.0 - share) * positions[face[:, 1]]
    assert leaks(fast_body, CLOSED[name], targets, seed=5) < 20


@pytest.mark.parametrize("shift", [0.0, 1e2, 1e3, 1e4], ids=lambda d: f"{d:g} m off")
@pytest.mark.parametrize("radius", [0.05, 1.0, 100.0], ids=lambda r: f"radius {r:g} m")
def test_no_ray_hits_its_own_surface(fast_body: str, shift: float, radius: float) -> None:
    """A quarter of a million rays leave a convex body and meet nothing, wherever it stands."""
    if radius * 1e4 < shift:
        pytest.skip("too far off for float32 to hold the shape at all")
    positions, faces = icosphere(3, radius, centre=(shift, -shift, shift / 3.0))
    world = make_world((positions, faces))
    settings = BakeSettings(kernel=Kernel.OCCLUSION, max_distance=1e5, rays=64, samples_per_face=(3, 3))
    samples = place_samples(world, settings)
    tally = Tally.empty(len(samples), 1)
    with open_tracer(fast_body, world, settings) as tracer:
        tracer.accumulate(samples, slice(0, len(samples)), tally)
    # Rounding dents a shape this far out; a ray may then truly strike a neighbouring face, but only near its plane.
    dents = shift * 2.0**-24 / (radius * 0.15)
    assert tally.hits.sum() <= 4.0 * dents * tally.rays.sum()


def test_flat_grid_sees_nothing_of_itself(fast_body: str) -> None:
    """Coplanar neighbours of very different size do not block each other's rays."""
    rng = np.random.default_rng(7)
    edges = np.sort(np.concatenate([[-900.0, 900.0], rng.uniform(-900, 900, 6), rng.uniform(-1, 1, 60)]))
    x, z = np.meshgrid(edges, edges)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    positions = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=1)
    n = len(edges)
    i = np.arange(n * (n - 1)).reshape(n - 1, n)[:, :-1].ravel()
    faces = np.concatenate([np.stack([i, i + n, i + 1], 1), np.stack([i + 1, i + n, i + n + 1], 1)])
    for name, points in (("axis-aligned", positions + np.array([0, 12.3, 0])), ("turned", positions @ turn.T)):
        world = make_world((points, faces))
        settings = BakeSettings(kernel=Kernel.OCCLUSION, max_distance=1e5, rays=64, samples_per_face=(1, 1))
        samples = place_samples(world, settings)
        tally = Tally.empty(len(samples), 1)
        with open_tracer(fast_body, world, settings) as tracer:
            tracer.accumulate(samples, slice(0, len(samples)), tally)
        # Turned, the rounded grid is not quite flat any more: slopes of 5e-5 m over 1 cm.
        allowed = 0 if name == "axis-aligned" else 5e-4 * tally.rays.sum()
        assert tally.hits.sum() <= allowed, name
