"""Every tracer against the others, ray for ray and sample for sample."""

from __future__ import annotations

import numpy as np
import pytest

from bake.kernels import rays
from bake.low_discrepancy import owen_sobol
from bake.settings import BakeSettings, Kernel
from tests.trace.clutter import clutter
from tests.trace.conftest import open_tracer, trace_all
from tests.worlds import make_world, quad

SETTINGS = BakeSettings(rays=32, samples_per_face=(2, 8), sample_spacing=0.7)


@pytest.mark.parametrize("kernel", list(Kernel))
@pytest.mark.parametrize("seed", [1, 2])
def test_fast_tracers_equal_brute_force(fast_body: str, seed: int, kernel: Kernel) -> None:
    """Per sample the fused kernels agree with NumPy; a ray within rounding of an edge may fall on either side."""
    settings = SETTINGS.replaced(kernel=kernel, max_distance=5.0 if kernel is Kernel.OCCLUSION else None)
    world = clutter(seed)
    _, expected = trace_all("brute", world, settings)
    _, tally = trace_all(fast_body, world, settings)
    difference = np.abs(tally.ao - expected.ao).max(1)
    assert np.quantile(difference, 0.99) < 2e-5
    assert difference.max() <= 2.0 / settings.rays
    assert (tally.hits != expected.hits).mean() < 0.01
    assert (tally.back_faces != expected.back_faces).mean() < 0.01
    np.testing.assert_array_equal(tally.rays, settings.rays)


def test_nearest_agrees(fast_body: str) -> None:
    """Plain rays: same face and distance as brute force, but for ties between coincident faces."""
    world = clutter(3)
    rng = np.random.default_rng(5)
    origins = rng.uniform(-6, 6, (2000, 3)).astype(np.float32)
    directions = rng.normal(size=(2000, 3))
    directions = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
    with open_tracer("brute", world, SETTINGS) as brute, open_tracer(fast_body, world, SETTINGS) as tracer:
        expected = brute.nearest(origins, directions, 100.0)
        hits = tracer.nearest(origins, directions, 100.0)
    same = hits.face == expected.face
    assert same.mean() > 0.998
    struck = same & (hits.face >= 0)
    assert struck.sum() > 500
    np.testing.assert_allclose(hits.distance[struck], expected.distance[struck], rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(hits.cosine[struck], expected.cosine[struck], atol=1e-4)
    np.testing.assert_allclose(hits.weights[struck], expected.weights[struck], atol=2e-3)


def test_textured_openness_agrees(fast_body: str) -> None:
    """Openness looked up at the hit: half of a striped ceiling lets light through."""
    from dataclasses import replace

    ceiling = quad(60.0, 1.0, up=False)
    world = make_world(quad(0.5), ceiling, samples=np.array([True, True, False, False]))
    stripes = np.tile(np.array([0.0, 1.0], np.float32), (4, 8))
    world = replace(
        world,
        vertex_uv=(world.positions[:, [0, 2]] * 0.3).astype(np.float32),
        face_texture=np.array([-1, -1, 0, 0], np.int32),
        textures=(stripes,),
    )
    _, expected = trace_all("brute", world, SETTINGS)
    _, tally = trace_all(fast_body, world, SETTINGS)
    assert 0.3 < tally.ao[:, 1].mean() < 0.7
    assert np.abs(tally.ao - expected.ao).max() <= 2.0 / SETTINGS.rays


def test_batches_do_not_matter(fast_body: str) -> None:
    """The same bits come out whatever the batches, and again on a second run."""
    world = clutter(4)
    samples, whole = trace_all(fast_body, world, SETTINGS)
    from bake.types import Tally

    parts = Tally.empty(len(samples), 2)
    with open_tracer(fast_body, world, SETTINGS) as tracer:
        for batch in samples.batches(37):
            tracer.accumulate(samples, batch, parts)
    np.testing.assert_array_equal(parts.ao, whole.ao)
    np.testing.assert_array_equal(parts.back_faces, whole.back_faces)


def test_device_twins_equal_numpy() -> None:
    """The device's sequence is the one of `low_discrepancy`, bit for bit."""
    import warp as wp

    count = 512

    @wp.kernel(enable_backward=False)
    def points(seed: wp.uint32, out: wp.array(dtype=wp.vec2)):
        i = wp.tid()
        first = rays.hash_u32(seed)
        second = rays.hash_u32(seed ^ rays.SECOND_DIMENSION)
        out[i] = rays.owen_sobol(wp.uint32(i), first, second)

    out = wp.zeros(count, dtype=wp.vec2, device="cpu")
    wp.launch(points, dim=count, inputs=[wp.uint32(77), out], device="cpu")
    u, v = owen_sobol(np.arange(count), np.full(count, 77))
    np.testing.assert_array_equal(out.numpy(), np.stack([u, v], axis=1).astype(np.float32))
