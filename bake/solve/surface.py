"""The welded surface that values are solved on: unknowns, faces, edges, components and the matrix pattern.

None of it depends on the samples' values, on their validity or on alpha, so one `Surface` serves every solve of a
scene. Unknowns are numbered component by component.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from bake.equal_rows import UInt64Array, stable_order
from bake.geometry import face_normals
from bake.solve.butterflies import Butterflies, find_edges, unfold, without_slivers
from bake.solve.weld import weld_vertices
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array, World


@dataclass(frozen=True, slots=True)
class Surface:
    """What all solves of a scene share.

    Attributes:
        unknown: Shape (n,), int64: the unknown of each vertex, -1 where it has none.
        referenced: Shape (n,), bool: a face uses the vertex.
        row: Shape (world faces,), int64: row of a face in `corners`, -1 if its object receives nothing.
        corners: Shape (m, 3), int64: unknowns of each receiving face.
        area: Shape (m,), float64, m².
        owner: Shape (m,), int32: object of each receiving face.
        typical: Shape (m,), float64, m²: mean area of its object's faces.
        position: Shape (u, 3), float64, metres.
        first: Shape (c + 1,), int64: component i owns unknowns `first[i]:first[i + 1]`.
        face_edge: Shape (m, 3), int64: edge of corners (0, 1), (1, 2), (2, 0); -1 where the two are one unknown.
        edges: Shape (e, 2), int64: unknowns of each edge, both ends in one component.
        butterflies: Pairs of faces across smooth interior edges.
        indptr, indices: Shape (u + 1,), (z,), int32: the matrix pattern, rows and columns.
        order: Shape (z,), int32: place of each entry among edges, wings, both once more, and the diagonal.
    """

    unknown: Int64Array
    referenced: BoolArray
    row: Int64Array
    corners: Int64Array
    area: Float64Array
    owner: Int64Array
    typical: Float64Array
    position: Float64Array
    first: Int64Array
    face_edge: Int64Array
    edges: Int64Array
    butterflies: Butterflies
    indptr: Int32Array
    indices: Int32Array
    order: Int32Array

    @property
    def unknown_count(self) -> int:
        """Number of unknowns."""
        return len(self.position)

    @property
    def component(self) -> Int64Array:
        """Component of each unknown, shape (u,)."""
        return np.repeat(np.arange(len(self.first) - 1), np.diff(self.first))

    def matrix(self, diagonal: Float64Array, edges: Float64Array, wings: Float64Array) -> csr_array:
        """A symmetric matrix over the unknowns.

        Args:
            diagonal: Shape (u,).
            edges: Shape (e,): entries between the two ends of each edge.
            wings: Shape (w,): entries between the two opposite corners of each butterfly.
        """
        upper = np.concatenate([edges, wings])
        data = np.concatenate([upper, upper, diagonal])[self.order]
        size = self.unknown_count
        return csr_array((data, self.indices, self.indptr), shape=(size, size), copy=False)


def build_surface(world: World, *, crease_angle: float, weld_instances: bool, extent: float | None = None) -> Surface:
    """Welds the receiving objects' vertices and finds the edges between their faces.

    Args:
        world: The flattened scene.
        crease_angle: In degrees: vertices whose normals differ by more stay apart, and edges whose faces differ by
            more carry no regulariser.
        weld_instances: Whether coincident vertices of different objects are one unknown.
        extent: Largest coordinate of the whole scene, in metres, where `world` is a part of it.
    """
    receives = np.array([role.receives_per_vertex for role in world.object_roles], np.bool_)
    faces = np.flatnonzero(receives[world.face_object])
    row = np.full(world.face_count, -1, np.int64)
    row[faces] = np.arange(len(faces))
    referenced = np.zeros(world.vertex_count, np.bool_)
    referenced[world.faces.ravel()] = True
    baked = np.zeros(world.vertex_count, np.bool_)
    baked[world.faces[faces].ravel()] = True

    unknown, count = weld_vertices(
        world, baked, crease_angle=crease_angle, weld_instances=weld_instances, extent=extent
    )
    corners = unknown[world.faces[faces]]
    unknown, corners, first = by_component(unknown, corners, count)
    position = np.zeros((count, 3))
    position[unknown[baked]] = world.positions[baked]

    owner = world.face_object[faces].astype(np.int64)
    normals, area = face_normals(position, corners)
    normals = without_slivers(normals, area, position, corners)
    edges = find_edges(corners, normals, crease_angle, world.face_samples[faces])
    butterflies = unfold(position, corners, edges)
    indptr, indices, order = matrix_pattern(edges.ends, butterflies.stencil[:, 2:], count)
    return Surface(
        unknown=unknown,
        referenced=referenced,
        row=row,
        corners=corners,
        area=area,
        owner=owner,
        typical=_typical(owner, area),
        position=position,
        first=first,
        face_edge=edges.of_face,
        edges=edges.ends,
        butterflies=butterflies,
        indptr=indptr,
        indices=indices,
        order=order,
    )


def _typical(owner: Int64Array, area: Float64Array) -> Float64Array:
    """The mean area of each face's object, shape (m,)."""
    if not len(owner):
        return area
    count = np.bincount(owner)
    return (np.bincount(owner, area) / np.maximum(count, 1))[owner]


def matrix_pattern(edges: Int64Array, wings: Int32Array, count: int) -> tuple[Int32Array, Int32Array, Int32Array]:
    """Row pointers, columns and, for each entry, its place among edges, wings, both once more, and the diagonal.

    A wing may join unknowns that an edge joins already; the matrix then has the entry twice, which adds up.
    """
    low = np.concatenate([edges[:, 0], wings[:, 0]]).astype(np.int32)
    high = np.concatenate([edges[:, 1], wings[:, 1]]).astype(np.int32)
    every = np.arange(count, dtype=np.int32)
    rows, columns = np.concatenate([low, high, every]), np.concatenate([high, low, every])
    order = np.argsort(rows, kind="stable").astype(np.int32)
    indptr = np.zeros(count + 1, np.int32)
    indptr[1:] = np.cumsum(np.bincount(rows, minlength=count))
    return indptr, columns[order], order


def by_component(unknown: Int64Array, corners: Int64Array, count: int) -> tuple[Int64Array, Int64Array, Int64Array]:
    """Renumbers unknowns so that each connected component is contiguous, in the order of its first vertex."""
    components, label, begins, keys = _component_keys(unknown, corners, count)
    place = np.empty(count, np.int64)
    place[stable_order(keys, int(keys.max(initial=0)))] = np.arange(count)
    taken = np.flatnonzero(unknown >= 0)
    renumbered = np.full(len(unknown), -1, np.int64)
    renumbered[taken] = place[unknown[taken]]
    first = np.zeros(components + 1, np.int64)
    first[1:] = np.cumsum(np.bincount(label, minlength=components)[np.argsort(begins, kind="stable")])
    return renumbered, place[corners], first


def component_order(unknown: Int64Array, corners: Int64Array, count: int) -> Int64Array:
    """Numbers that stand in the order into which `by_component` brings the unknowns, shape (count,), int64."""
    return _component_keys(unknown, corners, count)[3].astype(np.int64)


def _component_keys(
    unknown: Int64Array, corners: Int64Array, count: int
) -> tuple[int, Int32Array, Int64Array, UInt64Array]:
    """How many components there are, each unknown's, the first vertex of each, and keys that bring unknowns in order.

    Keys grow by the first vertex of the component, then by the unknown's own first.
    """
    # A graph of unknowns and faces, each face tied to its corners: its rows are the faces as they stand.
    faces = len(corners)
    begin = np.zeros(count + faces + 1, np.int32)
    begin[count:] = np.arange(0, 3 * faces + 1, 3)
    links = (np.ones(3 * faces), corners.reshape(-1).astype(np.int32), begin)
    graph = csr_array(links, shape=(count + faces, count + faces))
    components, label = connected_components(graph, directed=True, connection="weak")
    label = label[:count]  # numbered as they come, unknowns first
    vertices = len(unknown)
    taken = np.flatnonzero(unknown >= 0)
    appearance = np.full(count, vertices, np.int64)
    appearance[unknown[taken[::-1]]] = taken[::-1]  # the first comes last and stays
    begins = np.full(components, vertices, np.int64)
    np.minimum.at(begins, label, appearance)
    return components, label, begins, (begins[label] * (vertices + 1) + appearance).astype(np.uint64)
