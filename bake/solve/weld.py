"""Which vertices of the file share one unknown.

A file splits a vertex wherever its normal or its texture coordinate changes. AO is a function on the surface, so the
copies of one point share an unknown where the surface is smooth there, and stay apart where it has a crease.

Two vertices are welded if

- they belong to the same object, or both belong to objects that weld across objects (`BakeSettings.weld_instances`,
  which `ObjectKeys.weld` overrides for one object),
- their positions coincide: up to the rounding of float64 within an object, up to `ACROSS_OBJECTS` between objects,
  whose transforms round differently,
- their normals, each turned to the side its faces show, differ by at most the crease angle.

The relation is made transitive, so that a fan of slightly turned normals welds as a whole.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from bake.equal_rows import number_rows, stable_order
from bake.in_parts import in_parts
from bake.triangles import Triangles, columns, normals_of, touching
from bake.types import BoolArray, Float64Array, Int64Array, World

ACROSS_OBJECTS = 1e-4
"""Greatest distance in metres between vertices of two objects that count as one point."""


def weld_vertices(
    world: World, vertices: BoolArray, *, crease_angle: float, weld_instances: bool, extent: float | None = None
) -> tuple[Int64Array, int]:
    """Numbers the unknowns.

    Args:
        world: The flattened scene.
        vertices: Shape (n,): those that take part: referenced by a face of an object that receives per vertex.
        crease_angle: Greatest angle between normals of one unknown, in degrees.
        weld_instances: Whether objects weld to each other unless their own key says otherwise.
        extent: Largest coordinate of the whole scene, in metres, where `world` is a part of it.

    Returns:
        The unknown of each vertex, shape (n,), int64, -1 where `vertices` is False; and the number of unknowns.
    """
    chosen = np.flatnonzero(vertices)
    if not len(chosen):
        return np.full(world.vertex_count, -1, np.int64), 0
    place = _places(world, chosen, weld_instances, extent)
    group = _split_at_creases(place, lambda several: outward_normals(world, chosen[several]), crease_angle)
    if len(chosen) == world.vertex_count:
        return group, int(group.max()) + 1
    unknown = np.full(world.vertex_count, -1, np.int64)
    unknown[chosen] = group
    return unknown, int(group.max()) + 1


def outward_normals(world: World, vertices: Int64Array) -> Float64Array:
    """Normals of some vertices on the side that the vertex's faces show, shape (n, 3), unit or zero.

    A normal that points against the area-weighted mean of its faces' normals is turned round (as NVIDIA's baking
    sample does per face); a vertex without a normal takes that mean.

    Args:
        world: The flattened scene.
        vertices: Shape (n,), int64.
    """
    wanted = np.zeros(world.vertex_count, np.bool_)
    wanted[vertices] = True
    faces = world.faces[touching(world.faces, wanted)]
    triangles, scaled = Triangles(world.positions, faces), np.empty((3, len(faces), 3))

    def part(begin: int, end: int) -> None:
        scaled[:, begin:end] = np.stack(normals_of(triangles.sides(begin, end)))[:, :, None]

    in_parts(part, len(faces))
    mean, corners = np.empty((len(vertices), 3)), faces.ravel().astype(np.int64)
    for axis in range(3):
        mean[:, axis] = np.bincount(corners, scaled[axis].ravel(), minlength=world.vertex_count)[vertices]
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    normals = world.normals[vertices].astype(np.float64)
    against = np.einsum("ij,ij->i", normals, mean) < 0
    normals[against] *= -1
    missing = np.einsum("ij,ij->i", normals, normals) < 0.25
    normals[missing] = mean[missing]
    return normals


def weld_quantum(extent: float) -> float:
    """How near positions count as one point, in metres, in a scene whose largest coordinate is `extent`.

    A power of two, so that the round coordinates of level editors lie in the middle of a rounding cell.
    """
    return 2.0 ** math.ceil(math.log2(max(extent, 1e-30) * 1e-10))


def _places(world: World, chosen: Int64Array, weld_instances: bool, extent: float | None) -> Int64Array:
    """Equal numbers for coincident vertices that may be welded, shape (len(chosen),)."""
    whole = len(chosen) == world.vertex_count
    joins = np.array([weld_instances if keys.weld is None else keys.weld for keys in world.object_keys], dtype=np.bool_)
    owners = np.repeat(np.arange(world.object_count), np.diff(world.first_vertex))
    owner = owners if whole else owners[chosen]
    across = joins[owner]
    positions = world.positions if whole else world.positions[chosen]
    quantum = weld_quantum(max(abs(float(positions.max())), abs(float(positions.min()))) if extent is None else extent)
    cells = np.empty((4, len(chosen)))

    def part(begin: int, end: int) -> None:
        here = slice(begin, end)
        cells[0, here] = np.where(across[here], -1, owner[here])
        for axis in range(3):
            np.round(positions[here, axis] / quantum, out=cells[1 + axis, here])

    in_parts(part, len(chosen))
    place, _ = number_rows([*cells])
    if across.any():
        members = np.flatnonzero(across)
        _, first = np.unique(place[members], return_index=True)
        representatives = members[first]
        tree = cKDTree(positions[representatives])
        pairs = tree.query_pairs(ACROSS_OBJECTS, output_type="ndarray")
        ends = place[representatives]
        place = _merge(place, ends[pairs[:, 0]], ends[pairs[:, 1]])
    return place


def _split_at_creases(
    place: Int64Array, normals: Callable[[Int64Array], Float64Array], crease_angle: float
) -> Int64Array:
    """Parts each place into groups whose normals are linked by steps within the crease angle, shape (n,)."""
    shared = np.bincount(place)[place] > 1
    alone, several = np.flatnonzero(~shared), np.flatnonzero(shared)
    group = np.empty(len(place), np.int64)
    group[alone] = np.arange(len(alone))
    if len(several):
        group[several] = len(alone) + _parted(place[several], normals(several), crease_angle)
    return group


def _parted(place: Int64Array, normals: Float64Array, crease_angle: float) -> Int64Array:
    """The groups of vertices that share their places with others, shape (n,)."""
    # one vertex for each distinct normal at a place
    group, first = number_rows([place.astype(np.float64), *columns(np.round(normals * 2048.0))])
    order = first[stable_order(place[first].astype(np.uint64), int(place.max()))]
    here = place[order]
    cosine = np.cos(np.radians(crease_angle)) - 1e-9
    left: list[Int64Array] = []
    right: list[Int64Array] = []
    step = 1
    near = np.arange(len(order))
    while True:
        near = near[near + step < len(order)]
        near = near[here[near] == here[near + step]]
        if not len(near):
            break
        smooth = np.einsum("ij,ij->i", normals[order[near]], normals[order[near + step]]) >= cosine
        left.append(group[order[near[smooth]]])
        right.append(group[order[near[smooth] + step]])
        step += 1
    if not left:
        return group
    return _merge(group, np.concatenate(left), np.concatenate(right))


def _merge(labels: Int64Array, left: Int64Array, right: Int64Array) -> Int64Array:
    """Labels after uniting the pairs (left, right)."""
    count = int(labels.max()) + 1
    graph = coo_array((np.ones(len(left), np.int8), (left, right)), shape=(count, count))
    _, united = connected_components(graph, directed=False)
    return united.astype(np.int64)[labels]
