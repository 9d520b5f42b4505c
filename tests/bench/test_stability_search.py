"""A search for what breaks the bake: random soups, moved, scaled, doubled, turned over and starved, at any setting."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bake.bench.shapes import Solid
from bake.bench.stability import Matrix, measure_stability
from bake.bench.stability_cases import Case
from bake.bench.stability_level import Level, part
from bake.scene_types import Role

pytest.importorskip("embreex", reason="Embree is not installed")

QUICK = {"rays": 8, "samples-per-face": "1:2", "region-directions": 16, "volume-directions": 16, "skip": ()}
SLOWLY = settings(max_examples=20, deadline=None, suppress_health_check=list(HealthCheck))

numbers = st.floats(-4.0, 4.0, allow_nan=False, width=32)
on_grid = st.integers(-3, 3).map(float)
"""Coordinates on a coarse grid: faces share planes, edges and vertices, and many have no area."""


@st.composite
def soups(draw: st.DrawFn, coordinates: st.SearchStrategy[float] = numbers) -> Solid:
    """Up to sixteen vertices, and triangles between any of them, not always different."""
    count = draw(st.integers(3, 16))
    points = draw(st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=count, max_size=count))
    corner = st.integers(0, count - 1)
    faces = draw(st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=24))
    return Solid(np.array(points, np.float64), np.array(faces, np.int32))


def level_of(solid: Solid, role: Role = Role.STATIC) -> Level:
    """A soup over a floor, so that there is always something to bake."""
    floor = Solid(
        np.array([[-5.0, -4.5, -5.0], [-5.0, -4.5, 5.0], [5.0, -4.5, 5.0], [5.0, -4.5, -5.0]]),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
    )
    return Level((part("floor", floor), part("soup", solid, role)))


def measured(level: Level, unit: float = 1.0, **options: Any) -> Matrix:
    """All figures of a level."""
    return measure_stability(QUICK, [Case("searched", lambda: level, unit, options)])


def broken(matrix: Matrix, *known: str) -> list[str]:
    """Gates that did not hold, in words."""
    return [
        f"{item.stage}: {item.what} {item.value:g} > {item.gate:g} {item.detail}"
        for item in matrix.figures["searched"]
        if not item.passed and item.what not in ("samples unlike brute force", *known)
    ]


@SLOWLY
@given(soups(), st.floats(0.0, 7.0), st.floats(-3.0, 4.0))
def test_places_and_sizes(solid: Solid, distance: float, size: float) -> None:
    """Wherever a soup stands and however large it is, all stages stay finite, in bounds and converge."""
    unit = 10.0**size
    shift = 10.0**distance * np.array([1.0, -0.7, 0.3])
    assert broken(measured(level_of(solid).scaled(unit).moved(shift), unit)) == []


@SLOWLY
@given(soups(on_grid), st.booleans(), st.booleans())
def test_coincidences(solid: Solid, doubled: bool, opposed: bool) -> None:
    """Faces in shared planes, doubled and turned over, with rays in their planes."""
    more = [solid.faces] * doubled + [solid.faces[:, ::-1]] * opposed
    assert broken(measured(level_of(replace(solid, faces=np.concatenate([solid.faces, *more]))))) == []


@SLOWLY
@given(
    soups(on_grid | numbers),
    st.floats(-6.0, 6.0).map(lambda power: 10.0**power) | st.just(0.0),
    st.lists(st.floats(-3.0, 6.0).map(lambda power: 10.0**power), min_size=1, max_size=4),
    st.sampled_from([0.0, 0.25, 1.0]),
    st.booleans(),
)
def test_settings(solid: Solid, alpha: float, distances: list[float], threshold: float, weld: bool) -> None:
    """Any smoothing, any distances, any threshold."""
    options = {
        "alpha": alpha, "distances": tuple(distances), "back_face_threshold": threshold, "weld_instances": weld,
    }  # fmt: skip
    assert broken(measured(level_of(solid), **options)) == []


@SLOWLY
@given(soups(on_grid | numbers), st.sampled_from([Role.TREE, Role.SHRUB, Role.SMALL, Role.BLOCKER, Role.RECEIVER]))
def test_roles(solid: Solid, role: Role) -> None:
    """A soup as a tree, a shrub, a pebble, or something that only casts or only receives."""
    assert broken(measured(level_of(solid, role))) == []
