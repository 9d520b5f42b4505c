"""Scenes whose AO is known in closed form, on every tracer."""

from __future__ import annotations

import numpy as np
import pytest

from bake.settings import BakeSettings, Kernel
from tests.trace.conftest import trace_all
from tests.worlds import box, disc, icosphere, make_world, quad

OCCLUSION = BakeSettings(kernel=Kernel.OCCLUSION, max_distance=1e4, rays=256, samples_per_face=(4, 4))
OBSCURANCE = BakeSettings(rays=256, samples_per_face=(4, 4))


def test_closed_box_is_black_inside(body: str) -> None:
    """Inside a closed box every ray hits, and none strikes a back face."""
    _, tally = trace_all(body, make_world(box(inward=True)), OCCLUSION)
    assert tally.ao.max() == 0.0
    assert tally.back_faces.sum() == 0
    assert (tally.hits == 256).all()


@pytest.mark.parametrize("smooth", [False, True], ids=["face normals", "smooth normals"])
def test_convex_body_is_white_outside(body: str, smooth: bool) -> None:
    """Outside a convex body nothing is hit, even where smooth normals tilt the hemisphere below the face."""
    positions, faces = icosphere(1, 5.0)
    world = make_world((positions, faces), normals=positions / 5.0 if smooth else None)
    _, tally = trace_all(body, world, OBSCURANCE)
    assert tally.ao.min() == 1.0
    assert tally.hits.sum() == 0


def test_infinite_wall_leaves_half(body: str) -> None:
    """At the foot of a long, high wall half the cosine-weighted hemisphere is open."""
    floor, faces = quad(0.02)
    wall = np.array([[0.02, -1.0, -1e4], [0.02, -1.0, 1e4], [0.02, 1e4, 1e4], [0.02, 1e4, -1e4]])
    world = make_world(
        (floor, faces), (wall, np.array([[0, 1, 2], [0, 2, 3]])), samples=np.array([True, True, False, False])
    )
    _, tally = trace_all(body, world, OCCLUSION.replaced(rays=1024))
    assert tally.ao.mean() == pytest.approx(0.5, abs=0.002)


@pytest.mark.parametrize(("height", "radius"), [(1.0, 1.0), (0.5, 2.0), (3.0, 1.0)])
def test_disc_overhead(body: str, height: float, radius: float) -> None:
    """A disc of radius R at height h takes away R²/(R² + h²)."""
    world = make_world(
        quad(1e-3), disc(radius, height), samples=np.concatenate([np.ones(2, bool), np.zeros(256, bool)])
    )
    _, tally = trace_all(body, world, OCCLUSION.replaced(rays=1024))
    assert tally.ao.mean() == pytest.approx(height**2 / (radius**2 + height**2), abs=0.003)


@pytest.mark.parametrize("radius", [0.5, 2.0, 50.0])
def test_sphere_centre_is_the_falloff(body: str, radius: float) -> None:
    """At the centre of a sphere of radius r every ray ends at r, so AO is ρ(r) for each distance."""
    sphere = icosphere(3 if body == "brute" else 4, radius, inward=True)
    count = len(sphere[1])
    world = make_world(quad(radius * 1e-4), sphere, samples=np.concatenate([np.ones(2, bool), np.zeros(count, bool)]))
    _, tally = trace_all(body, world, OBSCURANCE)
    expected = [1.0 - 2.0 ** (-radius / 2.0), 1.0 - 2.0 ** (-radius / 300.0)]
    np.testing.assert_allclose(tally.ao.mean(0), expected, atol=0.004, rtol=0.004)


def test_rays_end_at_the_maximum_distance(body: str) -> None:
    """A blocker beyond the maximum distance is not there."""
    ceiling = quad(1000.0, 3.0, up=False)
    world = make_world(quad(0.1), ceiling, samples=np.array([True, True, False, False]))
    _, near = trace_all(body, world, OCCLUSION.replaced(max_distance=2.9))
    _, far = trace_all(body, world, OCCLUSION.replaced(max_distance=1e4))
    assert near.ao.min() == 1.0
    assert far.ao.max() < 0.01


def test_tail_changes_no_value_by_more_than_its_bound(fast_body: str) -> None:
    """Cutting the kernel's tail is a bounded error: the long kernel is the judge."""
    ceiling = quad(4000.0, 17.0, up=False)
    world = make_world(quad(0.1), ceiling, samples=np.array([True, True, False, False]))
    cut = BakeSettings(distances=(2.0,), rays=64, tail=1 / 256)
    whole = BakeSettings(distances=(2.0,), rays=64, tail=1e-9)
    assert cut.trace_distance < 17.0 < whole.trace_distance
    difference = trace_all(fast_body, world, cut)[1].ao - trace_all(fast_body, world, whole)[1].ao
    assert 0.0 < difference.max() <= 1 / 256


@pytest.mark.parametrize("openness", [0.25, 0.5, 0.9])
@pytest.mark.parametrize("layers", [1, 3])
def test_partly_open_layers_multiply(body: str, openness: float, layers: int) -> None:
    """Behind n leaf cards that each let a share τ through, τⁿ of the light is left."""
    cards = [quad(400.0, 1.0 + i, up=False) for i in range(layers)]
    share = np.concatenate([np.zeros(2), np.full(2 * layers, openness)])
    samples = np.concatenate([np.ones(2, bool), np.zeros(2 * layers, bool)])
    world = make_world(quad(0.01), *cards, openness=share, samples=samples, two_sided=True)
    _, tally = trace_all(body, world, OCCLUSION)
    assert tally.ao.mean() == pytest.approx(openness**layers, abs=0.01)


def test_object_offset_lifts_the_origin(fast_body: str) -> None:
    """An object's own offset starts its rays above what lies closer."""
    from bake.types import ObjectKeys

    lid = quad(10.0, 0.01, up=False)
    samples = np.array([True, True, False, False])
    plain = make_world(quad(1.0), lid, samples=samples)
    lifted = make_world(quad(1.0), lid, samples=samples, keys=(ObjectKeys(offset=0.05), ObjectKeys()))
    assert trace_all(fast_body, plain, OCCLUSION)[1].ao.max() < 0.01
    assert trace_all(fast_body, lifted, OCCLUSION)[1].ao.min() == 1.0
