"""A part of the welded surface as a surface of its own: what a local solve assembles instead of the whole scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.solve.butterflies import Butterflies
from bake.solve.surface import Surface, matrix_pattern
from bake.types import Int64Array


@dataclass(frozen=True, slots=True)
class SurfacePart:
    """Some faces of a surface.

    Attributes:
        surface: The part, its unknowns numbered anew and taken for one component; it knows no vertices of the world.
        rows: Shape (m,), int64, sorted: its faces, as rows of the whole.
        unknowns: Shape (u,), int64, sorted: its unknowns, as those of the whole.
        edges: Shape (e,), int64, sorted: its edges, as rows of the whole's.
        wings: Shape (w,), int64, sorted: its butterflies, as rows of the whole's.
    """

    surface: Surface
    rows: Int64Array
    unknowns: Int64Array
    edges: Int64Array
    wings: Int64Array

    def local(self, unknowns: Int64Array) -> Int64Array:
        """Numbers in the part of unknowns of the whole, all of which belong to it."""
        return np.searchsorted(self.unknowns, unknowns)


def part_of(whole: Surface, rows: Int64Array) -> SurfacePart:
    """The part made of some faces, with the butterflies between them.

    What is assembled from it for an unknown is what the whole would give if all faces are there within three rings.

    Args:
        whole: A surface.
        rows: Shape (m,), int64, sorted: rows of `Surface.corners`.
    """
    unknowns, own = _numbered(whole.corners[rows], whole.unknown_count)
    corners = own[whole.corners[rows]]
    sides = whole.face_edge[rows]
    used, own_edge = _numbered(sides[sides >= 0], len(whole.edges))
    face_edge = np.where(sides >= 0, own_edge[sides], -1) if len(used) else sides
    edges = own[whole.edges[used]]

    own_row = np.full(len(whole.corners), -1, np.int64)
    own_row[rows] = np.arange(len(rows))
    inside = own_row >= 0
    wings = whole.butterflies
    kept = np.flatnonzero(inside[wings.faces[:, 0]] & inside[wings.faces[:, 1]])
    butterflies = Butterflies(
        stencil=own[wings.stencil[kept]].astype(np.int32),
        operator=wings.operator[kept],
        hinge=own_edge[wings.hinge[kept]].astype(np.int32),
        sides=own_edge[wings.sides[kept]].astype(np.int32),
        faces=own_row[wings.faces[kept]].astype(np.int32),
        degenerate=0,
    )
    row = np.full(len(whole.row), -1, np.int64)
    row[np.flatnonzero(whole.row >= 0)[rows]] = np.arange(len(rows))
    indptr, indices, order = matrix_pattern(edges, butterflies.stencil[:, 2:], len(unknowns))
    surface = Surface(
        unknown=np.zeros(0, np.int64),
        referenced=np.zeros(0, np.bool_),
        row=row,
        corners=corners,
        area=whole.area[rows],
        owner=whole.owner[rows],
        typical=whole.typical[rows],
        position=whole.position[unknowns],
        first=np.array([0, len(unknowns)]),
        face_edge=face_edge,
        edges=edges,
        butterflies=butterflies,
        indptr=indptr,
        indices=indices,
        order=order,
    )
    return SurfacePart(surface, rows, unknowns, used, kept)


def _numbered(members: Int64Array, size: int) -> tuple[Int64Array, Int64Array]:
    """Distinct numbers below `size`, sorted, and the place of each of them, shape (size,), -1 for the others."""
    seen = np.zeros(size, np.bool_)
    seen[members] = True
    distinct = np.flatnonzero(seen)
    place = np.full(size, -1, np.int64)
    place[distinct] = np.arange(len(distinct))
    return distinct, place
