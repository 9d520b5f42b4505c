"""Pairs of faces across the smooth interior edges of the welded surface, and the gradient jump between them.

A butterfly is an edge (a, b) with the two faces that share it, whose opposite corners are c and d. Unfolded into one
plane, the gradient of a piecewise linear f jumps across the edge by

    jump = (f_c - f_e(y_c)) / h_c + (f_d - f_e(y_d)) / h_d,     f_e(y) = (1 - y/L) f_a + (y/L) f_b,

with L the edge's length, h the height of an opposite corner over the edge and y its foot's distance from a. The
along-edge part of the gradient is common to both faces, so the jump is this one number. Constants have no jump, nor has
any function that is affine on the unfolded pair.

Reference: the edge regulariser of Sloan et al. 2013 ("Ambient Obscurance Baking on the GPU", equation 2) as NVIDIA's
baking sample writes it out, on the unfolded pair of faces. Heights come from float64 cross products, because the
sample's difference of squares cancels for slivers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.types import BoolArray, Float64Array, Int64Array

SLIVER = 1e-6
"""A face whose height over the shared edge is below this share of its longest edge makes no butterfly."""


@dataclass(frozen=True, slots=True)
class Edges:
    """The edges of the welded faces.

    Attributes:
        ends: Shape (e, 2), int64, unknowns, smaller first.
        of_face: Shape (m, 3), int64: edge of a face's corners (0, 1), (1, 2), (2, 0); -1 where the two coincide.
        wings: Shape (w, 2), int64: for each butterfly its two faces.
        hinge: Shape (w,), int64: for each butterfly its edge.
    """

    ends: Int64Array
    of_face: Int64Array
    wings: Int64Array
    hinge: Int64Array


@dataclass(frozen=True, slots=True)
class Butterflies:
    """The jump operator of each butterfly.

    Attributes:
        stencil: Shape (w, 4), int64: unknowns a, b, c, d.
        jump: Shape (w, 4), float64, 1/m: coefficients of the gradient jump.
        area: Shape (w, 2), float64, m²: areas of the two faces.
        heights: Shape (w, 2), float64, m.
        length: Shape (w,), float64, m.
        hinge: Shape (w,), int64: the edge (a, b).
        sides: Shape (w, 4), int64: the edges (a, c), (b, c), (a, d), (b, d).
        faces: Shape (w, 2), int64: the face with c and the face with d.
        degenerate: Butterflies left out because a height is below `SLIVER`.
    """

    stencil: Int64Array
    jump: Float64Array
    area: Float64Array
    heights: Float64Array
    length: Float64Array
    hinge: Int64Array
    sides: Int64Array
    faces: Int64Array
    degenerate: int


def find_edges(corners: Int64Array, normals: Float64Array, crease_angle: float) -> Edges:
    """Edges and smooth interior edges.

    An edge carries a butterfly if exactly two distinct faces meet there and their normals differ by at most the crease
    angle; the order of the corners does not matter, so inconsistent winding of a flat surface loses it, as its two
    sides are different surfaces. Faces on the same three unknowns with the same side count once.

    Args:
        corners: Shape (m, 3), int64, unknowns.
        normals: Shape (m, 3), float64, unit face normals; zero for degenerate faces, which never pair.
        crease_angle: In degrees.
    """
    face_count = len(corners)
    tail, head = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    size = int(corners.max()) + 1 if face_count else 0
    key = low * size + high
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    new = np.ones(len(key), np.bool_)
    new[1:] = ordered[1:] != ordered[:-1]
    number = np.empty(len(key), np.int64)
    number[order] = np.cumsum(new) - 1
    firsts = order[new]
    ends = np.column_stack([low[firsts], high[firsts]])
    proper = ends[:, 0] != ends[:, 1]
    renumbered = np.where(proper, np.cumsum(proper) - 1, -1)
    number = renumbered[number]
    ends = ends[proper]

    counts = (number >= 0) & np.repeat(_first_of_duplicates(corners, normals), 3)
    half = np.flatnonzero(counts)
    half = half[np.argsort(number[half], kind="stable")]
    at = number[half]
    uses = np.bincount(at, minlength=len(ends))
    begin = np.searchsorted(at, np.arange(len(ends)))
    hinge = np.flatnonzero(uses == 2)
    wings = np.column_stack([half[begin[hinge]] // 3, half[begin[hinge] + 1] // 3])
    cosine = np.einsum("ij,ij->i", normals[wings[:, 0]], normals[wings[:, 1]])
    smooth = cosine >= np.cos(np.radians(crease_angle)) - 1e-9
    return Edges(ends, number.reshape(face_count, 3), wings[smooth], hinge[smooth])


def _first_of_duplicates(corners: Int64Array, normals: Float64Array) -> BoolArray:
    """False for a face that repeats an earlier one: the same unknowns and the same side."""
    ordered = np.sort(corners, axis=1)
    axis = np.abs(normals).argmax(axis=1)
    side = normals[np.arange(len(normals)), axis] > 0
    rows = np.column_stack([ordered, side])
    order = np.lexsort(rows.T)
    first = np.ones(len(rows), np.bool_)
    first[order[1:]] = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    return first


def unfold(positions: Float64Array, corners: Int64Array, edges: Edges) -> Butterflies:
    """The jump operators of all butterflies.

    Args:
        positions: Shape (u, 3), float64, metres: one position an unknown.
        corners: Shape (m, 3), int64, unknowns.
        edges: From `find_edges`.
    """
    a, b = edges.ends[edges.hinge].T
    along = positions[b] - positions[a]
    length = np.linalg.norm(along, axis=1)
    opposite = np.empty((len(a), 2), np.int64)
    heights = np.empty((len(a), 2))
    foot = np.empty((len(a), 2))
    reach = np.empty((len(a), 2))
    safe = np.maximum(length, 1e-300)
    for side in range(2):
        face = corners[edges.wings[:, side]]
        opposite[:, side] = face.sum(axis=1) - a - b
        arm = positions[opposite[:, side]] - positions[a]
        heights[:, side] = np.linalg.norm(np.cross(along, arm), axis=1) / safe
        foot[:, side] = np.einsum("ij,ij->i", along, arm) / safe**2  # as a share of the edge
        reach[:, side] = np.maximum(length, np.linalg.norm(arm, axis=1))
    proper = ((heights > SLIVER * reach) & (length > 0)[:, None]).all(axis=1)
    proper &= opposite[:, 0] != opposite[:, 1]
    inverse = 1.0 / np.where(proper[:, None], heights, 1.0)
    jump = np.column_stack(
        [
            -((1 - foot) * inverse).sum(axis=1),
            -(foot * inverse).sum(axis=1),
            inverse,
        ]
    )
    keep = np.flatnonzero(proper)
    return Butterflies(
        stencil=np.column_stack([a, b, opposite])[keep],
        jump=jump[keep],
        area=0.5 * length[keep, None] * heights[keep],
        heights=heights[keep],
        length=length[keep],
        hinge=edges.hinge[keep],
        sides=_sides(edges, corners, a, opposite)[keep],
        faces=edges.wings[keep],
        degenerate=int(len(proper) - len(keep)),
    )


def _sides(edges: Edges, corners: Int64Array, a: Int64Array, opposite: Int64Array) -> Int64Array:
    """Edges (a, c), (b, c), (a, d), (b, d) of all butterflies, shape (w, 4)."""
    sides = np.empty((len(a), 4), np.int64)
    rows = np.arange(len(a))
    for side in range(2):
        faces = edges.wings[:, side]
        face = corners[faces]
        at_opposite = (face == opposite[:, side, None]).argmax(axis=1)
        leaves = edges.of_face[faces, at_opposite]  # from the opposite corner to the next one
        enters = edges.of_face[faces, (at_opposite + 2) % 3]
        next_is_a = face[rows, (at_opposite + 1) % 3] == a
        sides[:, 2 * side] = np.where(next_is_a, leaves, enters)
        sides[:, 2 * side + 1] = np.where(next_is_a, enters, leaves)
    return sides
