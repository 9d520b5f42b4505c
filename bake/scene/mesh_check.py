"""What is odd about one mesh, counted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.in_parts import meanwhile
from bake.scene.coincident import find_coincident
from bake.scene.extent import box_of
from bake.scene.normals import known_opposing_normals
from bake.scene.surface import lacking_surface, referenced_vertices
from bake.scene.weld import known_places
from bake.types import BoolArray, Int64Array, Mesh


@dataclass(frozen=True, slots=True)
class MeshCheck:
    """Counts; vertices at the same place count as one where edges and coincident faces are concerned.

    Attributes:
        zero_area_faces: Faces without area, which take no samples.
        sliver_faces: Faces too thin to have a reliable normal, which take no samples.
        duplicate_faces: Faces that an earlier one with the same corners and winding makes redundant.
        opposed_faces: Faces with a twin of the same corners and opposite winding.
        unreferenced_vertices: Vertices that no face uses.
        inconsistent_edges: Edges between two faces that disagree about which side is outside.
        non_manifold_edges: Edges of more than two faces.
        opposing_normals: Vertex normals that point away from every face around them.
    """

    zero_area_faces: int
    sliver_faces: int
    duplicate_faces: int
    opposed_faces: int
    unreferenced_vertices: int
    inconsistent_edges: int
    non_manifold_edges: int
    opposing_normals: int


def check_mesh(mesh: Mesh) -> MeshCheck:
    """Looks a mesh over, in object space."""
    opposing = meanwhile(lambda: known_opposing_normals(mesh.positions, mesh.normals, mesh.faces), len(mesh.faces))
    used = referenced_vertices(mesh.faces, len(mesh.positions))
    low, high = box_of(mesh.positions if used.all() else mesh.positions[used]) if used.any() else (np.zeros(3),) * 2
    points, slivers = lacking_surface(mesh.positions, mesh.faces, np.array([np.linalg.norm(high - low)], np.float64))
    welded = known_places(mesh.positions)[mesh.faces]
    coincident = find_coincident(mesh.positions, mesh.faces)
    inconsistent, non_manifold = _count_edges(welded, coincident.repeated | points)
    return MeshCheck(
        zero_area_faces=int(points.sum()),
        sliver_faces=int(slivers.sum()),
        duplicate_faces=int(coincident.duplicate.sum()),
        opposed_faces=int(coincident.opposed.sum()),
        unreferenced_vertices=int(len(used) - used.sum()),
        inconsistent_edges=inconsistent,
        non_manifold_edges=non_manifold,
        opposing_normals=int(opposing().sum()),
    )


def _count_edges(welded: Int64Array, left_out: BoolArray) -> tuple[int, int]:
    """Edges that two faces run along in the same direction, and edges of more than two faces."""
    kept = welded[~left_out] if left_out.any() else welded
    start, end = kept.reshape(-1), kept[:, [1, 2, 0]].reshape(-1)
    number = int(kept.max(initial=-1)) + 1
    # Below 2⁶³, as there are fewer than 2³¹ places: the edge, and in its last bit which way the face runs along it.
    keys = ((np.minimum(start, end) * number + np.maximum(start, end)) << 1) | (start < end)
    proper = start != end
    keys = np.sort(keys if proper.all() else keys[proper])
    edges = keys >> 1
    begins = np.flatnonzero(np.append(True, edges[1:] != edges[:-1])) if len(edges) else np.zeros(0, np.int64)
    counts = np.diff(np.append(begins, len(edges)))
    pairs = begins[counts == 2]
    inconsistent = ((keys[pairs] ^ keys[pairs + 1]) & 1) == 0
    return int(inconsistent.sum()), int((counts > 2).sum())
