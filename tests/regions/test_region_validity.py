"""Valid points: what a region's seed reaches, behind no wall and inside none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from block_levels import TWO_ROOMS, WALLED_OFF, Block, free_space, lent, regions_of

from bake.region_types import GRID
from bake.regions.free_space import FreeSpace
from bake.regions.grid import box_points, grid_positions
from bake.regions.validity import Reach, reachable
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.types import World
from tests.worlds import make_world

SAMPLE = Path(__file__).resolve().parents[2] / "assets/sample_level/level.glb"
BOTH: Block = ((-5.1, 0.0, -2.0), (5.1, 3.0, 2.0))
DOWN = np.array([0.0, -1.0, 0.0])


def reach(blocks: tuple[Block, ...], region: Block, seed: tuple[float, float, float] | None = None) -> Reach:
    """What one region of a level reaches."""
    low, high = np.array([region[0]]), np.array([region[1]])
    start = np.array([seed or (np.nan,) * 3])
    with free_space(blocks) as free:
        return reachable(low, high, start, free, down=DOWN)


def points(region: Block) -> np.ndarray:
    """A region's grid points, shape (GRID³, 3)."""
    return box_points(np.array([region[0]]), np.array([region[1]]))[0]


def test_the_diagonal_wall_of_the_sample_level() -> None:
    """In RoomC exactly the points on the room's side of the diagonal wall are valid, but for those inside furniture."""
    scene = load_scene(SAMPLE)
    space, world = regions_of(scene)
    room = space.graph.names.index("RoomC")
    valid = space.valid.reshape(-1, GRID**3)[room]
    at = (grid_positions(space.graph) + world.origin).reshape(-1, GRID**3, 3)[room]
    # The wall's middle plane goes from (4.4, -5.85) to (8.85, -2.2) in x and z, and is 0.2 m thick.
    along = np.array([8.85 - 4.4, -2.2 + 5.85])
    across = np.array([along[1], -along[0]]) / np.linalg.norm(along)
    beyond = (at[:, [0, 2]] - [4.4, -5.85]) @ across
    assert (beyond > 0.1).sum() >= 40
    assert not valid[beyond > -0.1].any()
    out = at[(beyond < -0.1) & ~valid]
    assert len(out) < 0.05 * (beyond < -0.1).sum()
    for point in out:
        assert any(_holds(world, number, point) for number in range(world.object_count))


def _holds(world: World, number: int, point: np.ndarray) -> bool:
    """Whether a point lies in the box of one piece of furniture."""
    room, _, name = world.object_paths[number].rpartition("/")
    if room != "Level/House/RoomC" or name in ("Walls", "Floor", "Ceiling", "DiagonalWall"):
        return False
    own = world.positions[world.first_vertex[number] : world.first_vertex[number + 1]] + world.origin
    return len(own) > 0 and bool((own.min(axis=0) <= point).all() and (point <= own.max(axis=0)).all())


def test_a_seed_behind_the_wall_turns_it_round() -> None:
    """With its seed in the void behind the diagonal wall, only points in there are valid."""
    scene = load_scene(SAMPLE)
    world = flatten(scene, BakeSettings())
    box = next(region for region in scene.regions if region.name == "RoomC")
    low, high = np.array([box.minimum]) - world.origin, np.array([box.maximum]) - world.origin
    with lent(world) as nearest:
        seed = np.array([[8.0, 1.5, -5.0]]) - world.origin
        found = reachable(low, high, seed, FreeSpace(world, nearest), down=DOWN)
    at = box_points(low, high)[0] + world.origin
    beyond = (at[:, [0, 2]] - [4.4, -5.85]) @ (np.array([3.65, -4.45]) / np.hypot(3.65, 4.45))
    assert found.valid[0][beyond > 0.15].all()
    assert not found.valid[0][beyond < -0.1].any()


def test_an_empty_room_is_all_valid() -> None:
    """In one room alone every point is valid, and a seed is found in it."""
    found = reach(TWO_ROOMS, ((-5.1, 0.0, -2.0), (-0.1, 3.0, 2.0)))
    assert found.valid.all()
    assert (np.array([-5.1, 0, -2]) < found.seed[0]).all()
    assert (found.seed[0] < np.array([-0.1, 3, 2])).all()


def test_a_doorway_is_found() -> None:
    """Over two rooms both are valid where a doorway joins them, whichever room the seed is in."""
    for x in (-3.0, 3.0):
        assert reach(TWO_ROOMS, BOTH, (x, 1.0, 0.0)).valid.mean() == 1.0


def test_a_doorway_between_grid_points_is_found() -> None:
    """A doorway of 0.4 m between lines of the grid, which are 0.5 m apart, is found all the same."""
    walls = [block for block in TWO_ROOMS if block[0][0] != -0.1]
    walls += [
        ((-0.1, 0.0, -2.0), (0.1, 3.0, -0.2)),
        ((-0.1, 0.0, 0.2), (0.1, 3.0, 2.0)),
        ((-0.1, 2.0, -0.2), (0.1, 3.0, 0.2)),
    ]
    assert reach(tuple(walls), BOTH, (-3.0, 1.0, 1.0)).valid.all()


def test_a_wall_divides() -> None:
    """Without the doorway only the seed's room is valid."""
    for x in (-3.0, 3.0):
        valid = reach(WALLED_OFF, BOTH, (x, 1.0, 0.0)).valid[0]
        np.testing.assert_array_equal(valid, np.sign(points(BOTH)[:, 0]) == np.sign(x))


def test_a_crack_is_no_doorway() -> None:
    """Two halves of a wall that miss each other by a millimetre keep the rooms apart."""
    walls = [block for block in TWO_ROOMS if block[0][0] != -0.1]
    # The crack lies exactly on a line of the grid.
    walls += [((-0.1, 0.0, -2.0), (0.1, 3.0, 0.2495)), ((-0.1, 0.0, 0.2505), (0.1, 3.0, 2.0))]
    valid = reach(tuple(walls), BOTH, (-3.0, 1.0, 0.0)).valid[0]
    np.testing.assert_array_equal(valid, points(BOTH)[:, 0] < 0)


def test_points_inside_a_solid_are_not_valid() -> None:
    """A block in the middle of a room takes exactly the points inside it."""
    block: Block = ((-3.5, 0.0, -1.0), (-1.5, 2.0, 1.0))
    region: Block = ((-5.1, 0.0, -2.0), (-0.1, 3.0, 2.0))
    valid = reach((*TWO_ROOMS, block), region).valid[0]
    at = points(region)
    inside = ((at > block[0]) & (at < block[1])).all(axis=1)
    assert inside.any()
    np.testing.assert_array_equal(valid, ~inside)


def test_a_region_in_a_wall_has_no_points() -> None:
    """A region that lies in solid rock has none, which a finding tells; it still has a seed."""
    rock: Block = ((-10.0, -10.0, -10.0), (10.0, -1.0, 10.0))
    found = reach((rock,), ((-2.0, -6.0, -2.0), (2.0, -4.0, 2.0)))
    assert not found.valid.any()
    assert np.isfinite(found.seed).all()


def test_the_ground_is_not_free() -> None:
    """In a region that is half below the ground the points above it are valid."""
    ground: Block = ((-50.0, -20.0, -50.0), (50.0, 0.0, 50.0))
    region: Block = ((-4.0, -4.0, -4.0), (4.0, 4.0, 4.0))
    np.testing.assert_array_equal(reach((ground,), region).valid[0], points(region)[:, 1] > 0)


def test_a_plane_has_air_above_it() -> None:
    """Over a single plane that has no inside, the side from which one sees a floor is taken."""
    positions = np.array([[-50.0, 0.5, -50.0], [50.0, 0.5, -50.0], [50.0, 0.5, 50.0], [-50.0, 0.5, 50.0]])
    world = make_world((positions, np.array([[0, 2, 1], [0, 3, 2]])), two_sided=True)
    region: Block = ((-4.0, -4.0, -4.0), (4.0, 2.0, 4.0))  # most of it below
    with lent(world) as nearest:
        found = reachable(
            *(np.array([c]) for c in region), np.full((1, 3), np.nan), FreeSpace(world, nearest), down=DOWN
        )
    np.testing.assert_array_equal(found.valid[0], points(region)[:, 1] > 0.5)


def test_leaves_do_not_block() -> None:
    """What does not stop movement is passed, however many layers there are of it."""
    positions = np.array([[0.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 4.0, 4.0], [0.0, 0.0, 4.0]])
    leaf = np.array([[0, 1, 2], [0, 2, 3]])
    world = make_world(*((positions + np.array([0.1 * i, 0, 0]), leaf) for i in range(5)))
    start, end = np.array([[-1.0, 2.1, 1.7]]), np.array([[2.0, 1.9, 1.8]])
    with lent(world) as nearest:
        assert not FreeSpace(world, nearest).clear(start, end)[0]
        assert FreeSpace(world, nearest, np.zeros(world.face_count, bool)).clear(start, end)[0]
        stops = np.arange(world.face_count) >= 8  # the last of the five
        assert not FreeSpace(world, nearest, stops).clear(start, end)[0]


@pytest.mark.parametrize("count", [0, 1, 3])
def test_any_number_of_regions(count: int) -> None:
    """No region, one, and several give as many rows."""
    low = np.array([[-5.1, 0.0, -2.0]] * count).reshape(-1, 3)
    with free_space(TWO_ROOMS) as free:
        found = reachable(low, low + np.array([5.0, 3.0, 4.0]), np.full_like(low, np.nan), free, down=DOWN)
    assert found.valid.shape == (count, GRID**3)
    assert found.seed.shape == (count, 3)
