"""Regions made from the geometry alone: floors are found, rooms covered, doorways kept apart and linked."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from block_levels import TWO_ROOMS, WALLED_OFF, Block, block_scene, regions_of
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bake.errors import SceneError
from bake.region_types import GRID
from bake.regions.automatic import LONGEST
from bake.regions.columns import make_plan, make_solids
from bake.regions.upright import Upright, find_up
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.types import Material

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "assets/sample_level/level.glb"
SCENES = (ROOT / "../shared/scenes").resolve()
GROUND: Block = ((-15.0, -0.5, -15.0), (15.0, 0.0, 15.0))


def test_two_rooms_become_two_regions() -> None:
    """Two rooms with a doorway give one region each, linked in the doorway; all of the floor is covered."""
    space, world = regions_of(block_scene(TWO_ROOMS), regions="auto")
    low, high = space.graph.minimum + world.origin, space.graph.maximum + world.origin
    assert len(space.graph) == 2
    np.testing.assert_allclose(np.sort(np.abs(0.5 * (low + high))[:, 0]), 2.5, atol=0.4)
    np.testing.assert_allclose(low[:, 1], 0.0, atol=0.05)
    np.testing.assert_allclose(high[:, 1], 2.5, atol=0.05)
    assert space.graph.link.tolist() == [[0, 1]]
    centre = space.graph.link_centre[0] + world.origin
    assert abs(centre[0]) < 0.6
    assert abs(centre[2]) < 0.8
    assert space.coverage > 0.99
    assert space.graph.origin == "automatic"


def test_rooms_without_a_door_are_not_linked() -> None:
    """The same rooms without the doorway stay apart."""
    space, _ = regions_of(block_scene(WALLED_OFF), regions="auto")
    assert len(space.graph) == 2
    assert len(space.graph.link) == 0
    assert space.coverage > 0.99


def test_a_table_does_not_cut_a_room() -> None:
    """A table, over which the air goes on, leaves the room one region; a pillar does too."""
    table: Block = ((-3.5, 0.7, -0.8), (-1.5, 0.8, 0.8))
    pillar: Block = ((2.5, 0.0, -0.2), (2.9, 3.0, 0.2))
    space, _ = regions_of(block_scene((*TWO_ROOMS, table, pillar)), regions="auto")
    assert len(space.graph) == 2
    assert space.coverage > 0.99


def test_open_ground_is_tiled() -> None:
    """Wide ground is cut into regions no longer than the limit; neighbours are linked."""
    space, _ = regions_of(block_scene((GROUND,)), regions="auto")
    size = space.graph.maximum - space.graph.minimum
    assert (size[:, [0, 2]] < 1.3 * LONGEST).all()
    assert 6 <= len(space.graph) <= 16
    assert space.coverage > 0.99
    assert _parts(len(space.graph), space.graph.link) == 1


def test_a_box_on_the_ground_is_no_place_to_walk() -> None:
    """The top of a high block falls off on all sides: no region is made for it, nor for its inside."""
    block: Block = ((-3.0, 0.0, -3.0), (3.0, 4.0, 3.0))
    space, world = regions_of(block_scene((GROUND, block)), regions="auto")
    assert (space.graph.maximum[:, 1] + world.origin[1] < 3.0).all()
    assert space.coverage > 0.99


def test_stairs_lead_up() -> None:
    """A flight of steps of 0.4 m joins two levels: the upper one is walkable though nothing else leads there."""
    stairs = tuple(((i * 0.8 - 4.0, 0.0, -2.0), (5.0, 0.4 * (i + 1), 2.0)) for i in range(8))
    space, world = regions_of(block_scene((GROUND, *stairs)), regions="auto")
    assert (space.graph.maximum[:, 1] + world.origin[1] > 3.2 + 2.0).any()
    assert space.coverage > 0.99
    assert _parts(len(space.graph), space.graph.link) == 1


def test_seeds_are_free() -> None:
    """Each region's seed lies in its box, and its valid points are many."""
    space, _ = regions_of(block_scene(TWO_ROOMS), regions="auto")
    graph = space.graph
    assert ((graph.minimum < graph.seed) & (graph.seed < graph.maximum)).all()
    assert (space.valid.reshape(-1, GRID**3).mean(axis=1) > 0.7).all()


def test_no_floor_is_refused() -> None:
    """A wall alone gives no region, which is said in one line."""
    with pytest.raises(SceneError, match="no floor was found") as refused:
        regions_of(block_scene((((0.0, 0.0, 0.0), (0.1, 8.0, 0.1)),)), regions="auto")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("up", range(3))
def test_any_axis_may_point_up(up: int) -> None:
    """A level turned on its side gives the same regions, turned."""
    turned = tuple((tuple(np.roll(low, up - 1)), tuple(np.roll(high, up - 1))) for low, high in TWO_ROOMS)
    plain, here = regions_of(block_scene(TWO_ROOMS), regions="auto")
    space, world = regions_of(block_scene(turned, up_axis=up), regions="auto")
    expected = np.sort(np.roll(plain.graph.maximum + here.origin, up - 1, axis=1), axis=0)
    np.testing.assert_allclose(np.sort(space.graph.maximum + world.origin, axis=0), expected, atol=1e-6)


def test_up_is_guessed_and_can_be_said() -> None:
    """Where the file does not say, the axis that most level area faces is up; the ground setting overrules it."""
    flat = block_scene((GROUND,), up_axis=-1)
    on_z = block_scene((((-15.0, -15.0, -0.5), (15.0, 15.0, 0.0)),), up_axis=-1)
    assert find_up(flat, flatten(flat, BakeSettings()), BakeSettings()) == Upright(1, 1.0)
    assert find_up(on_z, flatten(on_z, BakeSettings()), BakeSettings()) == Upright(2, 1.0)
    said = BakeSettings.from_options({"ground": "-y"})
    assert find_up(flat, flatten(flat, BakeSettings()), said) == Upright(1, -1.0)


@given(seed=st.integers(0, 2**32 - 1))
def test_turning_is_undone(seed: int) -> None:
    """World coordinates turned upright and back are the same."""
    random = np.random.default_rng(seed)
    up = Upright(int(random.integers(3)), float(random.choice([-1.0, 1.0])))
    points = random.normal(size=(5, 3))
    np.testing.assert_array_equal(up.world(up.turned(points)), points)
    assert up.turned(up.down) @ [0.0, 0.0, 1.0] == -1.0


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), scale=st.sampled_from([0.1, 1.0, 6.0]), upright=st.booleans())
def test_solids_hold_every_point_of_every_face(seed: int, scale: float, upright: bool) -> None:
    """Whatever point of a face is taken, its column is solid at its height: nothing can leak through."""
    random = np.random.default_rng(seed)
    corners = random.uniform(-5, 5, (6, 1, 3)) + scale * random.normal(size=(6, 3, 3))
    if upright:
        corners[:, 2, :2] = corners[:, 1, :2]  # vertical faces, such as walls
    flat = corners.reshape(-1, 3)
    plan = make_plan(flat.min(axis=0), flat.max(axis=0), 0.25)
    solids = make_solids(corners, np.zeros(6, bool), plan, climb=0.5)
    weights = random.dirichlet([0.5, 0.5, 0.5], (6, 50))
    points = np.einsum("fpc,fcd->fpd", weights, corners).reshape(-1, 3)
    place = np.floor((points[:, :2] - plan.low) / plan.cell).astype(int)
    column = place[:, 0] * plan.shape[1] + place[:, 1]
    height = (points[:, 2] - plan.bottom) / plan.step
    for c, h in zip(column, height, strict=True):
        own = solids.column == c
        assert ((solids.low[own] <= h + 1e-6) & (h - 1e-6 <= solids.high[own])).any()
    assert (solids.low <= solids.high).all()
    key = solids.column * (1 << 20) + solids.low
    assert (np.diff(key) > 0).all()
    same = solids.column[1:] == solids.column[:-1]
    assert (solids.low[1:][same] > solids.high[:-1][same]).all()


def test_leaves_are_no_walls() -> None:
    """Cut-outs do not divide free space, glass does."""
    scene = block_scene(WALLED_OFF)
    holes = np.full((4, 4), 0.8, np.float32)
    for openness_map, regions in ((holes, 1), (None, 2)):
        filled = np.zeros(len(scene.meshes[0].faces), np.int32)
        filled[-12:] = 1  # the block in the doorway
        mesh = dataclasses.replace(scene.meshes[0], face_material=filled)
        materials = (Material("stone"), Material("leaves", openness=0.8, openness_map=openness_map))
        changed = dataclasses.replace(scene, meshes=(mesh,), materials=materials)
        space, _ = regions_of(changed, regions="auto")
        assert _parts(len(space.graph), space.graph.link) == regions


def test_the_sample_level() -> None:
    """Nearly all walkable floor of the sample level is covered and reached; rooms are linked with the outside."""
    scene = load_scene(SAMPLE)
    space, world = regions_of(scene, regions="auto")
    graph = space.graph
    assert space.coverage > 0.99
    assert 80 <= len(graph) <= 250
    # From the house one gets everywhere: all but a few regions hang together.
    assert np.bincount(_labels(len(graph), graph.link)).max() > 0.95 * len(graph)
    low, high = graph.minimum + world.origin, graph.maximum + world.origin
    for box in scene.regions[:6]:  # the rooms, the corridor and the tower: each has a region of its own
        inside = ((low > np.array(box.minimum) - 0.8) & (high < np.array(box.maximum) + 0.8)).all(axis=1)
        assert inside.any(), box.name
    assert [item.what for item in space.findings] == ["regions-leave-outskirts"]


@pytest.mark.shared
@pytest.mark.slow
@pytest.mark.skipif(not SCENES.exists(), reason="the real scenes are not here")
@pytest.mark.parametrize(
    ("name", "least", "fewest", "most"),
    [
        ("stk_candela_city/stk_candela_city.glb", 0.95, 500, 2000),
        ("stk_black_forest/stk_black_forest.glb", 0.98, 2, 2000),
        ("stk_mines/stk_mines.glb", 0.98, 500, 1500),
        ("cube2_pandora/pandora.obj", 0.96, 2, 2000),
        ("dream_apartment/dream_apartment.glb", 0.97, 1, 20),  # a single room
        ("godot_living_room/living_room.glb", 0.95, 1, 20),
    ],
)
def test_real_levels(name: str, least: float, fewest: int, most: int) -> None:
    """Automatic regions cover the walkable floor of real levels, with a bounded number of boxes."""
    space, _ = regions_of(load_scene(SCENES / name), regions="auto")
    assert space.coverage > least
    assert fewest <= len(space.graph) <= most


def _labels(count: int, links: np.ndarray) -> np.ndarray:
    graph = coo_array((np.ones(len(links), np.int8), (links[:, 0], links[:, 1])), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def _parts(count: int, links: np.ndarray) -> int:
    return int(_labels(count, links).max()) + 1
