"""What works on large arrays part by part, by sorted keys, or from memory."""

from __future__ import annotations

import gc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from bake.equal_rows import number_rows
from bake.in_parts import in_parts
from bake.scene.remembered import remembered
from bake.triangles import Triangles, normals_of


@pytest.mark.parametrize("rows", [0, 1, 5, 6, 17])
def test_parts_cover_every_row_once(rows: int) -> None:
    """Whatever their number is."""
    seen = np.zeros(rows, np.int64)

    def part(begin: int, end: int) -> None:
        seen[begin:end] += 1

    in_parts(part, rows, at_once=3)
    assert (seen == 1).all()


def test_what_a_part_raises_is_raised() -> None:
    """And the caller's way with floating-point errors holds in every part."""
    with np.errstate(divide="raise"), pytest.raises(FloatingPointError):
        in_parts(lambda begin, end: np.ones(end - begin) / np.zeros(end - begin), 10, at_once=3)
    with np.errstate(divide="ignore"):
        in_parts(lambda begin, end: np.ones(end - begin) / np.zeros(end - begin), 10, at_once=3)


@given(hnp.arrays(np.float64, st.tuples(st.integers(0, 30), st.just(3)), elements=st.sampled_from([-1.0, -0.0, 0.0])))
def test_rows_are_numbered_as_comparing_all_pairs_does(rows: np.ndarray) -> None:
    """Equal numbers for equal rows, all numbers in use, and the first row of each."""
    number, first = number_rows(list(rows.T))
    same = (rows[:, None] == rows[None]).all(axis=2)
    np.testing.assert_array_equal(number[:, None] == number[None], same)
    assert set(number.tolist()) == set(range(len(first)))
    assert [int(np.flatnonzero(number == n)[0]) for n in range(len(first))] == first.tolist()


def test_results_are_remembered_as_long_as_their_arrays_live() -> None:
    """And not for arrays that are merely equal."""
    calls: list[int] = []

    @remembered
    def total(values: np.ndarray) -> float:
        calls.append(1)
        return float(values.sum())

    values = np.arange(4.0)
    assert total(values) == total(values) == 6.0
    assert len(calls) == 1
    assert total(values.copy()) == 6.0
    assert len(calls) == 2
    del values
    gc.collect()
    for _ in range(8):
        total(np.arange(4.0))  # may well lie where one lay before
    assert len(calls) == 10


@given(hnp.arrays(np.float64, (7, 3), elements=st.floats(-2.0, 2.0)), st.integers(0, 2**32 - 1))
def test_normals_by_columns_are_cross_products(positions: np.ndarray, seed: int) -> None:
    """Of the first two sides, part by part."""
    faces = np.random.default_rng(seed).integers(0, 7, (9, 3)).astype(np.int32)
    a, b, c = np.moveaxis(positions[faces], 1, 0)
    triangles = Triangles(positions, faces)
    found = np.concatenate([np.stack(normals_of(triangles.sides(i, i + 3)), axis=1) for i in (0, 3, 6)])
    np.testing.assert_allclose(found, np.cross(b - a, c - a), atol=1e-12)


def test_parts_may_have_parts() -> None:
    """Nobody waits for helpers that wait themselves; and what a part of a part raises is raised."""
    seen = np.zeros((20, 30), np.int64)

    def row(begin: int, end: int) -> None:
        for number in range(begin, end):

            def part(first: int, last: int, number: int = number) -> None:
                seen[number, first:last] += 1

            in_parts(part, 30, at_once=2)

    in_parts(row, 20, at_once=1)
    assert (seen == 1).all()

    def fail(begin: int, end: int) -> None:
        if begin == 7:
            raise ValueError("seven")

    with pytest.raises(ValueError, match="seven"):
        in_parts(lambda begin, end: in_parts(fail, 20, at_once=1), 5, at_once=1)
