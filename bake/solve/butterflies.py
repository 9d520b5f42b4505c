"""Pairs of faces across the smooth interior edges of the welded surface, and the gradient jump between them.

A butterfly is an edge (a, b) of length L with the two faces that share it, whose opposite corners are c and d. Unfolded
into one plane, the gradient of a piecewise linear f jumps across the edge by

    jump = (f_c - f_e(y_c)) / h_c + (f_d - f_e(y_d)) / h_d,     f_e(y) = (1 - y/L) f_a + (y/L) f_b,

with h the height of an opposite corner over the edge and y its foot's distance from a. The along-edge part of the
gradient is common to both faces, so the jump is this one number. Constants have no jump, nor has any function that is
affine on the unfolded pair. With the cotangents of the angles at a and b in both faces, y/h = cot a and (L - y)/h =
cot b, it becomes

    L · jump = (cot a_c + cot b_c) f_c + (cot a_d + cot b_d) f_d - (cot b_c + cot b_d) f_a - (cot a_c + cot a_d) f_b.

The operator is this jump times the area of both faces, in metres.

Reference: the edge regulariser of Sloan et al. 2013 ("Ambient Obscurance Baking on the GPU", equation 2) as NVIDIA's
baking sample writes it out. Cotangents are dot over cross product in float64; the sample's difference of squares
cancels for slivers.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from bake.in_parts import in_parts, meanwhile
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array

SLIVER = 1e-6
"""A face whose height over the shared edge is below this share of its longest edge makes no butterfly."""


@dataclass(frozen=True, slots=True)
class Edges:
    """The edges of the welded faces.

    Side s of face f is number 3 f + s and runs from corner s to corner s + 1.

    Attributes:
        ends: Shape (e, 2), int64, unknowns, smaller first.
        of_face: Shape (m, 3), int64: edge of a face's sides; -1 where both ends are one unknown.
        wings: Shape (w, 2), int64: for each butterfly the two sides that meet.
    """

    ends: Int64Array
    of_face: Int64Array
    wings: Int64Array


@dataclass(frozen=True, slots=True)
class Butterflies:
    """The regulariser's operator on each butterfly.

    Attributes:
        stencil: Shape (w, 4), int32: unknowns a, b, c, d.
        operator: Shape (w, 4), float64, metres: (A_c + A_d) times the coefficients of the gradient jump.
        hinge: Shape (w,), int32: the edge (a, b).
        sides: Shape (w, 4), int32: the edges (a, c), (b, c), (a, d), (b, d).
        faces: Shape (w, 2), int32: the face with c and the face with d.
        degenerate: Butterflies left out because a height is below `SLIVER`.
    """

    stencil: Int32Array
    operator: Float64Array
    hinge: Int32Array
    sides: Int32Array
    faces: Int32Array
    degenerate: int


def find_edges(
    corners: Int64Array, normals: Float64Array, crease_angle: float, sampled: BoolArray | None = None
) -> Edges:
    """Edges and smooth interior edges.

    An edge carries a butterfly if exactly two distinct faces meet there and their normals differ by at most the crease
    angle. The order of the corners does not matter: a smooth surface whose winding is inconsistent has opposed normals
    there, and its two sides are different surfaces. Faces on the same three unknowns with the same side count once, and
    those of them that take no samples not at all if others do. Degenerate faces count nowhere: a face without area that
    fills a T-junction does not part the two that meet beside it.

    Args:
        corners: Shape (m, 3), int64, unknowns.
        normals: Shape (m, 3), float64, unit face normals; zero for degenerate faces, which never pair.
        crease_angle: In degrees.
        sampled: Shape (m,), bool: faces that take samples; all if None.
    """
    sampled = np.ones(len(corners), np.bool_) if sampled is None else sampled
    first_ones = meanwhile(partial(_first_of_duplicates, corners, normals, sampled), len(corners))
    tail, head = corners.ravel(), corners[:, [1, 2, 0]].ravel()
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    size = int(corners.max(initial=0)) + 1
    key = np.where(low == high, -1, low * size + high)
    del tail, head, low, high
    order = np.argsort(key, kind="stable")
    key = key[order]
    begins = np.flatnonzero(np.append(True, key[1:] != key[:-1])) if len(key) else np.zeros(0, np.int64)
    runs = np.diff(np.append(begins, len(key)))
    collapsed = len(key) > 0 and key[0] == -1
    number = np.empty(len(key), np.int64)
    number[order] = np.repeat(np.arange(len(begins)) - collapsed, runs)
    if collapsed:
        begins, runs = begins[1:], runs[1:]
    ends = np.column_stack(np.divmod(key[begins], size))

    extra = ~first_ones()
    extra |= ~normals.any(axis=1)
    if extra.any():
        order = order[~np.repeat(extra, 3)[order]]
        runs = np.bincount(number[order][number[order] >= 0], minlength=len(ends))
        begins = np.cumsum(runs) - runs + np.count_nonzero(number[order] < 0)
    first = begins[runs == 2]
    wings = np.column_stack([order[first], order[first + 1]])
    cosine = np.empty(len(wings))

    def part(begin: int, end: int) -> None:
        one, other = (wings[begin:end] // 3).T
        np.einsum("ij,ij->i", normals[one], normals[other], out=cosine[begin:end])

    in_parts(part, len(wings))
    smooth = cosine >= np.cos(np.radians(crease_angle)) - 1e-9
    return Edges(ends, number.reshape(-1, 3), wings[smooth])


def _first_of_duplicates(corners: Int64Array, normals: Float64Array, sampled: BoolArray) -> BoolArray:
    """False for a face that repeats another on the same unknowns: on the same side, or without samples of its own."""
    first = np.ones(len(corners), np.bool_)
    if not len(corners):
        return first
    low, middle, high = np.sort(corners, axis=1).T
    order = np.lexsort((~sampled, high, middle, low))
    low, middle, high = low[order], middle[order], high[order]
    same = np.flatnonzero((low[1:] == low[:-1]) & (middle[1:] == middle[:-1]) & (high[1:] == high[:-1]))
    # runs of faces on one triple: each is held against the first of its run on the same side
    run = np.append(True, (low[1:] != low[:-1]) | (middle[1:] != middle[:-1]) | (high[1:] != high[:-1]))
    head = order[np.maximum.accumulate(np.where(run, np.arange(len(order)), 0))]
    later = order[same + 1]
    facing = np.einsum("ij,ij->i", normals[later], normals[head[same + 1]]) > 0
    first[later[facing]] = False
    for_back = later[~facing]  # the first face on the other side of each run stays, those after it go
    back_head = head[same + 1][~facing]
    _, kept = np.unique(back_head, return_index=True)
    first[np.delete(for_back, kept)] = False
    first[later[~sampled[later] & sampled[head[same + 1]]]] = False
    return first


def unfold(positions: Float64Array, corners: Int64Array, edges: Edges) -> Butterflies:
    """The operators of all butterflies.

    Args:
        positions: Shape (u, 3), float64, metres: one position an unknown.
        corners: Shape (m, 3), int64, unknowns.
        edges: From `find_edges`.
    """
    cotangent, double_area, longest = _triangles(positions, corners)
    cotangent, corner, of_side = cotangent.ravel(), corners.ravel(), edges.of_face.ravel()
    count = len(edges.wings)
    stencil, sides = np.empty((count, 4), np.int32), np.empty((count, 4), np.int32)
    operator = np.empty((count, 4))
    hinge, faces = np.empty(count, np.int32), np.empty((count, 2), np.int32)
    proper = np.empty(count, np.bool_)

    def part(begin: int, end: int) -> None:
        wings = edges.wings[begin:end]
        first, second = wings.T
        a, b = corner[first], corner[_next_side(first)]
        arm = positions[b] - positions[a]
        length = np.sqrt(np.einsum("ij,ij->i", arm, arm))
        fits = length > 0
        at_ends = np.zeros((2, end - begin))
        area = np.zeros(end - begin)
        for wing, tail in enumerate((first, second)):
            face = tail // 3
            head, top = _next_side(tail), _next_side(_next_side(tail))
            forward = corner[tail] == a  # whether the side runs from a to b
            at_a = cotangent[np.where(forward, tail, head)]
            at_b = cotangent[np.where(forward, head, tail)]
            at_ends[0] -= at_b
            at_ends[1] -= at_a
            operator[begin:end, 2 + wing] = at_a + at_b
            stencil[begin:end, 2 + wing] = corner[top]
            sides[begin:end, 2 * wing] = of_side[np.where(forward, top, head)]
            sides[begin:end, 2 * wing + 1] = of_side[np.where(forward, head, top)]
            faces[begin:end, wing] = face
            twice = double_area[face]
            area += twice
            fits &= twice > SLIVER * longest[face] * length
        fits &= stencil[begin:end, 2] != stencil[begin:end, 3]
        stencil[begin:end, 0], stencil[begin:end, 1] = a, b
        operator[begin:end, 0], operator[begin:end, 1] = at_ends
        operator[begin:end] *= (0.5 * area / np.where(length > 0, length, 1.0))[:, None]
        hinge[begin:end] = of_side[first]
        proper[begin:end] = fits

    in_parts(part, count)
    if proper.all():
        return Butterflies(stencil, operator, hinge, sides, faces, degenerate=0)
    keep = np.flatnonzero(proper)
    return Butterflies(
        stencil=stencil[keep],
        operator=operator[keep],
        hinge=hinge[keep],
        sides=sides[keep],
        faces=faces[keep],
        degenerate=count - len(keep),
    )


def _next_side(side: Int64Array) -> Int64Array:
    """The side of the same face that begins where this one ends."""
    return side + np.where(side % 3 == 2, -2, 1)


def without_slivers(
    normals: Float64Array, area: Float64Array, positions: Float64Array, corners: Int64Array
) -> Float64Array:
    """Face normals with those of faces too thin for any butterfly made zero, shape (m, 3); see `SLIVER`."""
    thin = 2.0 * area <= SLIVER * _longest_squared(positions, corners)
    return np.where(thin[:, None], 0.0, normals) if thin.any() else normals


def _longest_squared(positions: Float64Array, corners: Int64Array) -> Float64Array:
    longest = np.empty(len(corners))

    def part(begin: int, end: int) -> None:
        longest[begin:end] = np.einsum("ijk,ijk->ij", *2 * (_arms(positions, corners[begin:end]),)).max(axis=1)

    in_parts(part, len(corners))
    return longest


def _arms(positions: Float64Array, corners: Int64Array) -> Float64Array:
    """From corner s to corner s + 1, shape (m, 3, 3)."""
    corner = positions[corners]
    arm = np.empty(corner.shape)
    for side in range(3):
        np.subtract(corner[:, (side + 1) % 3], corner[:, side], out=arm[:, side])
    return arm


def _triangles(positions: Float64Array, corners: Int64Array) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Cotangents of the angles, shape (m, 3); twice the area and the longest edge, shape (m,)."""
    count = len(corners)
    cotangent, double_area, longest = np.empty((count, 3)), np.empty(count), np.empty(count)

    def part(begin: int, end: int) -> None:
        arm = _arms(positions, corners[begin:end])
        (ax, ay, az), (bx, by, bz) = arm[:, 0].T, arm[:, 1].T
        x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        area = np.sqrt(x * x + y * y + z * z)
        double_area[begin:end] = area
        longest[begin:end] = np.sqrt(np.einsum("ijk,ijk->ij", arm, arm).max(axis=1))
        inverse = np.where(area > 0, area, np.inf)
        for side in range(3):
            dots = np.einsum("ij,ij->i", arm[:, side], arm[:, side - 1])
            np.divide(-dots, inverse, out=cotangent[begin:end, side])

    in_parts(part, count)
    return cotangent, double_area, longest
