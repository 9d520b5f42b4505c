"""Which triangles of the surface are seen inside an outline of the picture."""

from __future__ import annotations

import numpy as np

from bake.types import BoolArray, Float64Array, Int32Array, Int64Array

_CELLS = 320
"""Cells of the depth map along the longer side of the outline's box."""
_FINEST = 2.0 / 1000.0
"""Least edge of a cell, in units of half a picture: about a pixel."""
_SMALL = 16.0
"""Cells that a triangle may cover whose points are spread over it; a larger one has a point in every cell."""
_SLACK = 0.01
"""How much deeper than the nearest point of its cell a seen point may lie, as a share of the depth."""
_PLASTIC = np.array((0.7548776662466927, 0.5698402909980532))  # steps of the R2 sequence (Roberts 2018)


class FacesInPicture:
    """The triangles of a picture, made once for all outlines that are drawn in it.

    Every triangle is stood for by points, more where it is larger in the picture, and a coarse depth map is made of
    them. So a triangle that is hidden but for a few pixels may be missed.

    Args:
        positions: Shape (n, 3), metres from the world's origin.
        faces: Shape (m, 3).
        drawn: Shape (m,), bool: the triangles in the picture; all of them if None.
        matrix: Shape (4, 4); see `picture_matrix`.
        front_only: Triangles seen from behind are neither drawn nor found.
    """

    def __init__(
        self,
        positions: Float64Array,
        faces: Int32Array,
        drawn: BoolArray | None,
        matrix: Float64Array,
        *,
        front_only: bool,
    ) -> None:
        numbers = np.arange(len(faces)) if drawn is None else np.flatnonzero(drawn)
        self._clip = clip = positions @ matrix[[0, 1, 3], :3].T + matrix[[0, 1, 3], 3]
        before = clip[:, 2] > 1e-9
        place = clip[:, :2] / np.where(before, clip[:, 2], 1.0)[:, None]
        corners = faces[numbers]
        near = before[corners].all(axis=1)
        numbers, corners = numbers[near], corners[near]
        spots = place[corners]
        a, b, c = spots[:, 0], spots[:, 1], spots[:, 2]
        doubled = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        if front_only:
            front = doubled > 0.0  # counter-clockwise in the picture
            numbers, corners, spots, doubled = numbers[front], corners[front], spots[front], doubled[front]
        self._numbers, self._corners, self._spots, self._doubled = numbers, corners, spots, doubled
        self._low, self._high = spots.min(axis=1), spots.max(axis=1)

    def inside(self, outline: Float64Array, *, hidden: bool = False) -> Int64Array:
        """Triangles of which some point lies inside an outline.

        Args:
            outline: Shape (k, 2): corners of a polygon in the picture, in [-1, 1], right and up.
            hidden: Those count as well that have others before them.

        Returns:
            Indices of triangles, ascending.
        """
        low, high = outline.min(axis=0), outline.max(axis=0)
        near = np.flatnonzero((self._high >= low).all(axis=1) & (self._low <= high).all(axis=1))
        numbers, corners = self._numbers[near], self._corners[near]
        spots, doubled = self._spots[near], self._doubled[near]
        if not len(numbers):
            return np.zeros(0, np.int64)
        clip = self._clip
        cell = max(float((high - low).max()) / _CELLS, _FINEST)
        covered = np.abs(doubled) / cell**2
        counts = np.where(covered > _SMALL, 0, np.ceil(6.0 * covered)).astype(np.int64)
        counts = np.where(covered > _SMALL, 0, np.maximum(counts, 1))
        owner = np.repeat(np.arange(len(numbers)), counts)
        weights = _weights(np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts))
        points = np.einsum("ij,ijk->ik", weights, clip[corners[owner]])
        where, deep = points[:, :2] / points[:, 2:], points[:, 2]
        pieces = [(owner, where, deep)]
        for number in np.flatnonzero(covered > _SMALL).tolist():
            own, own_deep = _cells_of(spots[number], clip[corners[number], 2], low, high, cell)
            pieces.append((np.full(len(own), number), own, own_deep))
        owner, where, deep = (np.concatenate(column) for column in zip(*pieces, strict=True))
        inside = ((where >= low) & (where <= high)).all(axis=1)
        owner, where, deep = owner[inside], where[inside], deep[inside]
        if not len(owner):
            return np.zeros(0, np.int64)
        seen = inside_polygon(where, outline)
        if not hidden:
            grid = ((where - low) / cell).astype(np.int64)
            index = grid[:, 0] * (_CELLS + 2) + grid[:, 1]
            order = np.argsort(index, kind="stable")
            begins = np.flatnonzero(np.diff(index[order], prepend=-1))
            nearest = np.empty((_CELLS + 2) ** 2)
            nearest[index[order][begins]] = np.minimum.reduceat(deep[order], begins)
            seen &= deep <= nearest[index] * (1.0 + _SLACK)
        return numbers[np.unique(owner[seen])]


def _cells_of(
    spots: Float64Array, depths: Float64Array, low: Float64Array, high: Float64Array, cell: float
) -> tuple[Float64Array, Float64Array]:
    """Middles of the cells that a triangle covers, shape (n, 2), and its depth there, shape (n,)."""
    begin = np.floor((np.maximum(spots.min(axis=0), low) - low) / cell)
    end = np.ceil((np.minimum(spots.max(axis=0), high) - low) / cell)
    x, y = (low[axis] + (np.arange(begin[axis], end[axis]) + 0.5) * cell for axis in (0, 1))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    a, b, c = spots
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    offset = points - a
    second = (offset[:, 0] * (c[1] - a[1]) - offset[:, 1] * (c[0] - a[0])) / area
    third = ((b[0] - a[0]) * offset[:, 1] - (b[1] - a[1]) * offset[:, 0]) / area
    inside = (second >= 0.0) & (third >= 0.0) & (second + third <= 1.0)
    first, second, third = 1.0 - second[inside] - third[inside], second[inside], third[inside]
    # The reciprocal of the depth is what is linear in the picture.
    return points[inside], 1.0 / (first / depths[0] + second / depths[1] + third / depths[2])


def inside_polygon(points: Float64Array, outline: Float64Array) -> BoolArray:
    """Which points, shape (n, 2), lie inside a polygon, shape (k, 2): crossed an odd number of times by a line."""
    inside = np.zeros(len(points), np.bool_)
    x, y = points[:, 0], points[:, 1]
    for (x0, y0), (x1, y1) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        if y0 != y1:
            crossed = (y0 > y) != (y1 > y)
            inside ^= crossed & (x < x0 + (y - y0) / (y1 - y0) * (x1 - x0))
    return inside


def _weights(number: Int64Array) -> Float64Array:
    """Weights of the three corners for the points of a triangle by their number: its middle first, then evenly."""
    spread = (1.0 / 3.0 + number[:, None] * _PLASTIC) % 1.0
    over = spread.sum(axis=1) > 1.0
    spread[over] = 1.0 - spread[over]
    spread[number == 0] = 1.0 / 3.0
    return np.column_stack((1.0 - spread.sum(axis=1), spread)).astype(np.float64)
