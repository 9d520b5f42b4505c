"""The shapes that the sample level is made of are closed, face outwards and repeat exactly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from assets.sample_level.cells import SOLID, Block, surfaces
from assets.sample_level.digits import digit
from assets.sample_level.mesh import Solid, joined, shaded
from assets.sample_level.randomness import Random
from assets.sample_level.shapes import boulder, box, graded, icosphere, revolved, tube

LENGTHS = st.floats(0.1, 5.0)


def _volume(solid: Solid) -> float:
    """Enclosed volume by the divergence theorem; negative if the faces look inwards."""
    a, b, c = (solid.positions[solid.faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def _is_closed(solid: Solid) -> bool:
    """Every directed edge has its opposite."""
    edges = solid.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    forward, backward = np.sort(edges @ [1 << 32, 1]), np.sort(edges[:, ::-1] @ [1 << 32, 1])
    return bool(np.array_equal(forward, backward))


@settings(max_examples=30, deadline=None)
@given(LENGTHS, LENGTHS, LENGTHS, st.floats(0.2, 1.0))
def test_box(x: float, y: float, z: float, step: float) -> None:
    """A box holds its volume, whatever its tessellation."""
    solid = box((0.0, 0.0, 0.0), (x, y, z), step, step / 2)
    assert _is_closed(solid)
    assert _volume(solid) == pytest.approx(x * y * z, rel=0.02)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(*[st.integers(0, 4)] * 3), min_size=1, max_size=4))
def test_cells(corners: list[tuple[int, int, int]]) -> None:
    """Blocks cut from a block leave a surface around exactly the rest."""
    solid_block = Block(SOLID, (0.0, 0.0, 0.0), (5.0, 5.0, 5.0))
    holes = [Block(f"Hole{i}", c, (c[0] + 1.0, c[1] + 1.0, c[2] + 1.0)) for i, c in enumerate(corners)]
    found = surfaces([solid_block, *holes], "Outside", 1.0, 1.0)
    assert _volume(joined(*found.values())) == pytest.approx(125.0 - len(set(corners)))


def test_round_shapes_face_outwards() -> None:
    """Sphere, boulder, cylinder and tube hold the volume they should."""
    assert _volume(icosphere(3)) == pytest.approx(4 / 3 * np.pi, rel=0.02)
    assert _is_closed(icosphere(2))
    assert _volume(boulder(3, (1.0, 1.0, 1.0), 0.2, 5)) > 2.0
    cylinder = revolved([(0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (0.0, 2.0)], 64)
    assert _is_closed(cylinder)
    assert _volume(cylinder) == pytest.approx(2 * np.pi, rel=0.01)
    pipe = tube(np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 2.0, 0.1]]), np.full(3, 0.5), 12)
    a, b, c = (pipe.positions[pipe.faces[:, i]] for i in range(3))
    outwards = (a + b + c) / 3 * (1.0, 0.0, 1.0)
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), outwards) > 0).all()


def test_creases_split_and_smooth_surfaces_do_not() -> None:
    """A box gets three vertices a corner, a sphere one a position; every normal agrees with its faces."""
    cube = shaded(box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 1.0), "x")
    assert len(cube.positions) == 24
    sphere = shaded(icosphere(2), "x", crease=60.0)
    assert len(sphere.positions) == len(icosphere(2).positions)
    assert np.einsum("ij,ij->i", sphere.positions, sphere.normals).min() > 0.99


def test_graded_lines_are_fine_at_the_ends() -> None:
    """Lines run from end to end, ascending, closer at the ends than in the middle."""
    lines = graded(1.0, 9.0, 1.0, 0.2)
    steps = np.diff(lines)
    assert (lines[0], lines[-1]) == (1.0, 9.0)
    assert (steps > 0).all()
    assert steps[0] < 0.4 < 0.8 < steps.max() < 1.2


def test_digits_differ() -> None:
    """Nine different digits, each standing on the ground."""
    shapes = {digit(number).positions.tobytes() for number in range(1, 10)}
    assert len(shapes) == 9


def test_random_numbers_are_fixed() -> None:
    """The stream is what it was when the level was first built, and depends on its seed."""
    first = Random(1).uniform(0.0, 1.0, 1000)
    assert np.array_equal(first, Random(1).uniform(0.0, 1.0, 1000))
    assert not np.array_equal(first, Random(2).uniform(0.0, 1.0, 1000))
    assert abs(first.mean() - 0.5) < 0.03
    assert first.min() >= 0.0
    assert first.max() < 1.0
