"""Which corners around a place belong together: faces that meet at edges flatter than the crease angle.

Almost every place of a mesh has one fan of faces, each joined to the next, round to the first. Those are found by
walking round them all at once. Only what is left (borders, creases, edges of many faces, and fans that merely touch) is
worth the search for connected components.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix  # pyright: ignore[reportMissingTypeStubs]
from scipy.sparse.csgraph import (  # pyright: ignore[reportMissingTypeStubs]
    connected_components,  # pyright: ignore[reportUnknownVariableType]
)

from bake.in_parts import in_parts
from bake.scene.edges import MeshEdges, following, preceding
from bake.triangles import Vectors
from bake.types import BoolArray, Int64Array

LARGEST_FAN = 12
"""Faces of the largest fan that is walked round."""


@dataclass(frozen=True, slots=True)
class Fans:
    """Groups of corners; corner c of face f is number 3 f + c.

    Attributes:
        whole: Shape (places,): whether all corners at a place are one group.
        others: Shape (k,), int64, ascending: the corners at other places.
        group: Shape (k,), int64: the group of each, numbered by their first corners.
    """

    whole: BoolArray
    others: Int64Array
    group: Int64Array


def find_fans(edges: MeshEdges, places: int, directions: Vectors, least_cosine: float) -> Fans:
    """Joins corners across flat edges.

    Args:
        edges: Of the mesh.
        places: Number of places.
        directions: Unit normals of the faces; zero for faces without area.
        least_cosine: Of the angle between the normals of faces that are joined.
    """
    start, side = edges.start, edges.side
    same, alone = edges.neighbours()
    flat, beyond = np.empty(len(same), np.bool_), np.full(len(start) + 1, -1, side.dtype)

    def part(begin: int, end: int) -> None:
        one, other = side.take(same[begin:end]), side.take(same[begin:end] + 1)
        flat[begin:end] = level = _cosine(directions, one // 3, other // 3) >= least_cosine
        level = level & alone[begin:end]
        level &= start.take(one) != start.take(other)  # else the faces disagree about which side is outside
        one, other = one[level], other[level]
        beyond[one], beyond[other] = following(other), following(one)  # each side is in one such pair

    in_parts(part, len(same))
    whole = _walked_round(start, beyond, places)
    others = np.flatnonzero(~whole.take(start))
    if not len(others):
        return Fans(whole, others, others)
    level = same[flat]
    pairs = [(side[level], side[level + 1])]
    for one, other in edges.farther():
        flat = _cosine(directions, one // 3, other // 3) >= least_cosine
        pairs.append((one[flat], other[flat]))
    return Fans(whole, others, _components(start, whole, others, pairs))


def _cosine(directions: Vectors, one: NDArray[Any], other: NDArray[Any]) -> NDArray[np.float64]:
    cosine = np.zeros(len(one))
    for axis in directions:
        cosine += axis.take(one) * axis.take(other)
    return cosine


def _walked_round(start: Int64Array, beyond: NDArray[Any], places: int) -> BoolArray:
    """Places around which the way from corner to corner comes back after all of them, shape (places,).

    Args:
        start: Shape (3 m,): place of each corner.
        beyond: Shape (3 m + 1,): the corner across the edge that begins at each corner, -1 at creases and borders.
        places: How many there are.
    """
    corners = np.bincount(start, minlength=places)
    begin = np.full(places, -1, beyond.dtype)
    begin[start] = np.arange(len(start), dtype=beyond.dtype)  # any of them
    begin = np.sort(begin[begin >= 0])
    whole = np.zeros(places, np.bool_)

    def part(first: int, end: int) -> None:
        home = begin[first:end]
        place, at = start.take(home), home
        count = corners.take(place)
        for step in range(1, LARGEST_FAN + 1):
            at = beyond.take(at)
            is_home = at == home
            whole[place[is_home & (count == step)]] = True
            goes_on = np.flatnonzero(~is_home & (at >= 0) & (count > step))
            if not len(goes_on):
                return
            home, place, at, count = (values.take(goes_on) for values in (home, place, at, count))

    in_parts(part, len(begin))
    return whole


def _components(
    start: Int64Array, whole: BoolArray, others: Int64Array, pairs: list[tuple[NDArray[Any], NDArray[Any]]]
) -> Int64Array:
    """Groups of the corners at places that are not whole, shape (k,), from pairs of sides of flat edges."""
    number = np.zeros(len(start), np.int32 if len(start) < 2**31 else np.int64)
    number[others] = np.arange(len(others), dtype=number.dtype)
    rows: list[NDArray[Any]] = []
    columns: list[NDArray[Any]] = []
    meets = np.zeros(len(start), np.bool_)  # sides that begin or end at such a place
    meets[others] = meets[preceding(others)] = True
    for one, other in pairs:
        concerned = np.flatnonzero(meets.take(one))
        for row, column in _joined(start, one.take(concerned), other.take(concerned)):
            kept = np.flatnonzero(~whole.take(start.take(row)))
            rows.append(number.take(row.take(kept)))
            columns.append(number.take(column.take(kept)))
    row, column = np.concatenate(rows), np.concatenate(columns)
    graph = coo_matrix((np.ones(len(row), np.int32), (row, column)), shape=(len(others), len(others)))
    return np.asarray(connected_components(graph.tocsr(), directed=False)[1], np.int64)


def _joined(
    start: Int64Array, one: NDArray[Any], other: NDArray[Any]
) -> tuple[tuple[NDArray[Any], NDArray[Any]], tuple[NDArray[Any], NDArray[Any]]]:
    """Of pairs of sides on one edge, the corners that meet where the first begins, and where it ends."""
    forward = start.take(one) == start.take(other)  # both faces run along the edge in the same direction
    next_other = following(other)
    return (one, np.where(forward, other, next_other)), (following(one), np.where(forward, next_other, other))
