"""Stanford PLY: one mesh, one object."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.errors import SceneError
from bake.scene.edges import known_edge_counts
from bake.scene.files import FileLedger
from bake.scene.normals import crease_normals, unit_vectors
from bake.scene.parsed import ParsedFile, Placement
from bake.scene.ply_elements import PlyElement, read_ply_elements
from bake.scene.polygons import triangulate_polygons
from bake.scene.weld import known_places
from bake.types import Finding, Float32Array, Float64Array, Int32Array, Int64Array, Material, Mesh

INDEX_LISTS = ("vertex_indices", "vertex_index")


def parse_ply(ledger: FileLedger, *, crease_angle: float) -> ParsedFile:
    """Reads the PLY file of `ledger` as one object, named like the file.

    Vertices stay as stored where the file has normals, and are split at creases where it has none.

    Raises:
        SceneError: a damaged file, a point cloud, or indices that name no vertex.
    """
    file = str(ledger.scene)
    elements = read_ply_elements(ledger.read(ledger.scene.name, what="the scene file"), file)
    name = ledger.scene.stem
    positions = _columns(elements.get("vertex"), ("x", "y", "z"))
    if positions is None:
        raise SceneError("the PLY has no vertex positions", where=file, remedy="export it again")
    finite = np.isfinite(positions).all(axis=1)
    if not finite.all():
        raise SceneError(
            f"vertex {int(np.argmin(finite))} has the position {positions[np.argmin(finite)].tolist()}",
            where=file,
            remedy="repair the mesh: positions must be finite numbers",
        )
    counts, indices = _polygons(elements.get("face"), len(positions), file)
    if (counts == 3).all():
        faces = indices.reshape(-1, 3).astype(np.int32)
    else:
        triangles, _ = triangulate_polygons(positions[indices], counts, where=file)
        faces = indices[triangles].astype(np.int32)
    findings: list[Finding] = []
    if (counts < 3).any():
        detail = "Faces with fewer than three corners are left out."
        findings.append(Finding(name, "incomplete-triangle", int((counts < 3).sum()), detail, "set-aside"))
    stored = _columns(elements.get("vertex"), ("nx", "ny", "nz"))
    source: Int32Array | None = None
    if stored is None:
        split = crease_normals(positions, faces, crease_angle)
        positions, faces, source = positions[split.source], split.faces, split.source
        known_places.tell(split.place, positions)
        known_edge_counts.tell(split.edges, positions, faces)
        normals: Float32Array = split.normals
        detail = f"It has no normals: made with a crease angle of {crease_angle:g}°."
        findings.append(Finding(name, "normals-made", len(positions), detail, "info"))
    else:
        normals = unit_vectors(stored)
    mesh = Mesh(name, positions, normals, faces, np.zeros(len(faces), np.int32), source_vertex=source)
    placements = [Placement(name, name, 0, np.eye(4))] if len(faces) else []
    return ParsedFile([mesh], [Material("default")], placements, findings)


def _columns(element: PlyElement | None, names: tuple[str, str, str]) -> Float64Array | None:
    if element is None or not set(names) <= element.columns.keys():
        return None
    return np.stack([element.columns[name] for name in names], axis=1)


def _polygons(element: PlyElement | None, vertex_count: int, file: str) -> tuple[Int64Array, Int64Array]:
    """Corner counts and vertex indices of all faces."""
    lists = element.lists if element is not None else dict[str, tuple[Int64Array, NDArray[Any]]]()
    wanted = [lists[name] for name in INDEX_LISTS if name in lists] or list(lists.values())[:1]
    if not wanted or len(wanted[0][0]) == 0:
        raise SceneError("the PLY has no faces", where=file, remedy="point clouds cannot be baked: mesh it first")
    counts, values = wanted[0]
    if len(values) and not (values.min() >= 0 and values.max() < vertex_count):  # nor with NaN
        wrong = values[~((values >= 0) & (values < vertex_count))][0]
        raise SceneError(
            f"a face refers to vertex {wrong:g} of {vertex_count}", where=file, remedy="repair or export it again"
        )
    return counts, values.astype(np.int64, copy=False)
