"""Which vertices share an unknown."""

from __future__ import annotations

import numpy as np
import pytest

from bake.solve.weld import weld_vertices
from bake.types import ObjectKeys, World
from tests.solve.solve_cases import grid, moved, soup
from tests.worlds import box, make_world


def unknowns(world: World, *, crease_angle: float = 40.0, weld_instances: bool = False) -> np.ndarray:
    """The unknown of every vertex, all taking part."""
    everything = np.ones(world.vertex_count, bool)
    return weld_vertices(world, everything, crease_angle=crease_angle, weld_instances=weld_instances)[0]


def test_split_vertices_of_a_smooth_surface_are_one_unknown() -> None:
    """A flat grid stored as loose triangles has as many unknowns as grid points."""
    world = make_world(soup(*grid(5, 3)))
    welded = unknowns(world)
    assert welded.max() + 1 == 6 * 4
    for place in np.unique(welded):
        assert np.ptp(world.positions[welded == place], axis=0).max() == 0


def test_creases_stay_split() -> None:
    """A box of loose triangles keeps three unknowns at each corner, one if every angle may weld."""
    world = make_world(soup(*box()))
    assert unknowns(world).max() + 1 == 24
    assert unknowns(world, crease_angle=120.0).max() + 1 == 8


def test_a_fan_of_slightly_turned_normals_welds_as_a_whole() -> None:
    """Welding is transitive: 30° steps over a right angle make one unknown."""
    angles = np.radians([0, 30, 60, 90])
    normals = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    triangles = [np.array([[0, 0, 0], np.cross(n, [0, 0, 1.0]) * -1, [0, 0, 1.0]]) for n in normals]
    positions, faces = np.concatenate(triangles), np.arange(12).reshape(4, 3)
    world = make_world((positions, faces), normals=np.repeat(normals, 3, axis=0))
    at_origin = unknowns(world)[[0, 3, 6, 9]]
    assert len(np.unique(at_origin)) == 1
    assert len(np.unique(unknowns(world, crease_angle=20.0)[[0, 3, 6, 9]])) == 4


def test_the_two_sides_of_a_doubled_card_stay_apart() -> None:
    """Coincident faces that look opposite ways are different surfaces, even where the file gives both one normal."""
    positions, faces = soup(*grid(1, 1))
    both = (np.concatenate([positions, positions]), np.concatenate([faces, faces[:, ::-1] + len(positions)]))
    world = make_world(both, normals=np.tile([0.0, 0.0, 1.0], (12, 1)))
    welded = unknowns(world)
    assert not set(welded[:6]) & set(welded[6:])
    assert welded.max() + 1 == 8


@pytest.mark.parametrize(
    ("settings", "keys", "together"),
    [
        (False, (None, None), False),
        (True, (None, None), True),
        (True, (None, False), False),
        (False, (True, True), True),
        (False, (True, None), False),
    ],
)
def test_objects_weld_when_both_want_to(settings: bool, keys: tuple[bool | None, ...], together: bool) -> None:
    """An object's key wins over the setting; coincidence allows for the rounding of transforms."""
    positions, faces = grid(2, 2)
    world = make_world(
        (positions, faces), (moved(positions, 1.0 + 3e-6), faces), keys=tuple(ObjectKeys(weld=key) for key in keys)
    )
    assert unknowns(world, weld_instances=settings).max() + 1 == (15 if together else 18)


def test_vertices_that_take_no_part_have_no_unknown() -> None:
    """Unknowns are numbered without gaps over the chosen vertices."""
    world = make_world(grid(2, 2))
    chosen = np.arange(9) % 2 == 0
    welded, count = weld_vertices(world, chosen, crease_angle=40.0, weld_instances=False)
    assert count == 5
    assert sorted(welded[chosen]) == list(range(5))
    assert (welded[~chosen] == -1).all()
