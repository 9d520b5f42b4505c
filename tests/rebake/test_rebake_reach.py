"""The bound on what an edit can do."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.rebake.casters import Casters, Parts, cover
from bake.rebake.reach import Places, reach
from bake.settings import BakeSettings
from tests.worlds import box, icosphere


def parts_of(centre: np.ndarray, radius: float) -> Parts:
    """One sphere."""
    return Parts(
        centre=centre[None].astype(np.float64),
        radius=np.array([radius]),
        low=(centre - radius)[None].astype(np.float32),
        high=(centre + radius)[None].astype(np.float32),
        opaque=np.ones(1, np.bool_),
    )


NONE = Parts(np.zeros((0, 3)), np.zeros(0), *(np.zeros((0, 3), np.float32),) * 2, np.zeros(0, np.bool_))


@given(
    place=st.tuples(*[st.floats(-30, 30)] * 3),
    radius=st.floats(0.1, 4.0),
    distance=st.sampled_from([1.0, 10.0, 300.0]),
    seed=st.integers(0, 100),
)
@settings(max_examples=40, deadline=None)
def test_no_sphere_does_more_than_the_bound(
    place: tuple[float, float, float], radius: float, distance: float, seed: int
) -> None:
    """The change of AO when a black sphere appears before an empty sky, over many directions, is below the bound."""
    bake = BakeSettings(distances=(distance,))
    centre = np.array(place)
    places = Places.of(np.zeros((1, 3), np.float32), np.array([[0.0, 1.0, 0.0]], np.float32))
    found = reach(places, Casters(NONE, parts_of(centre, radius)), bake, near=0.0)
    random = np.random.default_rng(seed)
    u, v = random.random((2, 20000))
    direction = np.column_stack(
        [np.sqrt(u) * np.cos(2 * np.pi * v), np.sqrt(1 - u), np.sqrt(u) * np.sin(2 * np.pi * v)]
    )
    along = direction @ centre
    gap = along**2 - (centre @ centre - radius**2)
    t = along - np.sqrt(np.maximum(gap, 0.0))
    inside = centre @ centre < radius**2
    hit = (gap > 0) & ((t > 0) | inside) & (along > 0 if not inside else True)
    hit &= t <= bake.trace_distance  # where rays end
    change = np.where(hit, np.exp2(-np.maximum(t, 0.0) / distance), 0.0)
    noise = 4.0 * change.std() / np.sqrt(len(change))
    assert change.mean() <= found.bound[0] + noise + 1e-6
    if (change > 1.01 * bake.tail).any():  # rays end where they could change no more than the tail's bound
        assert found.touched[0]


def test_blocks_give_no_less_than_points() -> None:
    """Points that are only looked at in blocks get at least their own bound."""
    bake = BakeSettings()
    random = np.random.default_rng(3)
    points = random.uniform(-40.0, 40.0, (3000, 3)).astype(np.float32)
    casters = Casters(NONE, parts_of(np.array([1.0, 2.0, 3.0]), 0.7))
    places = Places.of(points)
    exact = reach(places, casters, bake, near=0.0)
    coarse = reach(places, casters, bake, near=0.01)
    assert (coarse.bound >= exact.bound - 1e-7).all()
    assert np.allclose(coarse.bound[exact.bound > 0.02], exact.bound[exact.bound > 0.02])


def test_spheres_cover_all_corners_and_long_things_need_several() -> None:
    """Every corner lies in a sphere; a rod is covered by several, a ball by one."""
    for positions, faces in (box((20.0, 0.2, 0.2)), icosphere(2, 1.5), box((4.0, 4.0, 0.1))):
        corners = positions[faces]
        centre, radius = cover(corners)
        distance = np.linalg.norm(corners[:, :, None] - centre, axis=3) - radius
        assert (distance.max(axis=1).min(axis=1) <= 1e-9).all()
    assert len(cover(icosphere(2, 1.5)[0][icosphere(2, 1.5)[1]])[0]) == 1
    assert len(cover(rod())[0]) > 4


def rod() -> np.ndarray:
    """Triangles along a line of 40 m."""
    positions, faces = box((1.0, 0.2, 0.2))
    return np.concatenate([(positions + np.array([x, 0.0, 0.0]))[faces] for x in range(40)])
