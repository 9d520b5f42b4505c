"""Boxes around points and objects, and what of them is kept when objects move."""

from __future__ import annotations

import dataclasses

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bake.types import World
from tests.worlds import box, make_world
from viewer.boxes import box_around, moved_boxes, object_boxes


@given(count=st.integers(1, 300), seed=st.integers(0, 1000), turned=st.booleans())
def test_the_box_holds_all_points_and_touches_them(count: int, seed: int, turned: bool) -> None:
    """Whatever the number of points, and however they lie in memory."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    points = np.asfortranarray(points) if turned else points
    np.testing.assert_array_equal(box_around(points), [points.min(axis=0), points.max(axis=0)])


def test_only_boxes_of_what_moved_are_made_anew() -> None:
    """They are those of the world as it is, and those of others stay as they were told."""
    before = two_boxes(0.0)
    now = two_boxes(2.5)
    told = object_boxes(before)
    told[0] += 100.0  # nobody looks at what has not moved
    found = moved_boxes(told, before, now)
    np.testing.assert_array_equal(found[1], object_boxes(now)[1])
    np.testing.assert_array_equal(found[0], told[0])


def two_boxes(shift: float) -> World:
    """Two boxes, the second of them shifted."""
    world = make_world(box(), box(centre=(shift, 0.0, 0.0)))
    return dataclasses.replace(world, object_hash=("first", f"second at {shift}"))
