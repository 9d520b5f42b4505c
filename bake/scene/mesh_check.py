"""What is odd about one mesh, counted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.in_parts import meanwhile
from bake.scene.coincident import find_coincident
from bake.scene.edges import count_edges, known_edge_counts
from bake.scene.extent import box_of
from bake.scene.normals import known_opposing_normals
from bake.scene.surface import lacking_surface, referenced_vertices
from bake.scene.weld import known_places
from bake.types import Mesh


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
    coincident = find_coincident(mesh.positions, mesh.faces)
    left_out = coincident.repeated | points
    if left_out.any():
        edges = count_edges(known_places(mesh.positions)[mesh.faces[~left_out]])
    else:
        edges = known_edge_counts(mesh.positions, mesh.faces)
    return MeshCheck(
        zero_area_faces=int(points.sum()),
        sliver_faces=int(slivers.sum()),
        duplicate_faces=int(coincident.duplicate.sum()),
        opposed_faces=int(coincident.opposed.sum()),
        unreferenced_vertices=int(len(used) - used.sum()),
        inconsistent_edges=edges.inconsistent,
        non_manifold_edges=edges.non_manifold,
        opposing_normals=int(opposing().sum()),
    )
