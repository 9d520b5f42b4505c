from __future__ import annotations

import numpy as np
import pytest

from bake.explain.object_signs import shell_around, winding_number, wound_against_neighbours
from tests.worlds import box, icosphere, make_world, quad


@pytest.mark.parametrize("inward", [False, True])
def test_winding_number(inward: bool) -> None:
    """1 inside a closed surface that shows outwards, -1 inside one that shows inwards, 0 outside."""
    positions, faces = icosphere(2, inward=inward)
    sign = -1.0 if inward else 1.0
    assert winding_number(positions[faces]) == pytest.approx(sign, abs=1e-6)
    assert winding_number(positions[faces] + [3.0, 0, 0]) == pytest.approx(0.0, abs=1e-6)


def test_a_shell_is_recognised() -> None:
    """Closed, inwards, and crossed by what goes through it."""
    world = make_world(icosphere(2, 2.0, inward=True), quad(10.0), box((0.2, 0.2, 0.2)))
    shell = shell_around(world, 0, np.zeros(3))
    assert shell.winding == pytest.approx(-1.0, abs=1e-6)
    assert shell.closed == pytest.approx(1.0)
    assert shell.inward > 0.99
    assert shell.crossed == 1


def test_an_open_or_outward_surface_is_no_shell() -> None:
    """A ground has open edges, a solid shows outwards."""
    world = make_world(quad(4.0), icosphere(2))
    assert shell_around(world, 0, np.array([0.0, 0.1, 0.0])).closed < 0.5
    assert shell_around(world, 1, np.zeros(3)).inward < 0.01


def test_faces_wound_against_their_neighbours() -> None:
    """One turned triangle of a ball is, its neighbours by and large are not; vertices may be split."""
    positions, faces = icosphere(2)
    faces = faces.copy()
    faces[7] = faces[7][::-1]
    world = make_world((positions, faces))
    assert wound_against_neighbours(world, 0, 7)
    assert not wound_against_neighbours(world, 0, 100)
    split = make_world((positions[faces.ravel()], np.arange(faces.size).reshape(-1, 3)))
    assert wound_against_neighbours(split, 0, 7)
    assert not wound_against_neighbours(split, 0, 100)
