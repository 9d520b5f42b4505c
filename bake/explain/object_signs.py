"""What the bake's findings and meshes say of whole objects: winding against normals, closed shells around a point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.scene.weld import edge_keys, weld_positions
from bake.types import BakeResult, Float64Array, World


@dataclass(frozen=True, slots=True)
class Shell:
    """How an object surrounds a point.

    Attributes:
        winding: Winding number of the object's faces about the point: -1 inside a closed surface that shows inwards,
            1 inside one that shows outwards, 0 outside.
        closed: Share of its edges, by length, that two faces share.
        inward: Share of its area that shows to the middle of its box.
        crossed: Other casting objects that go through its box.
    """

    winding: float
    closed: float
    inward: float
    crossed: int


def turned_share(result: BakeResult, number: int) -> float:
    """Share of an object's vertices whose file normals oppose all their faces, in [0, 1].

    The loader reports them once for a mesh, at its first object; others with the very same faces count as its like.
    """
    world = result.world
    begin, end = int(world.first_vertex[number]), int(world.first_vertex[number + 1])
    counts = {f.object: f.count for f in result.findings if f.what == "opposing-normals"}
    paths = [world.object_paths[number]] if world.object_paths[number] in counts else []
    if not paths and counts:
        index = {path: i for i, path in enumerate(world.object_paths)}
        paths = [path for path in counts if path in index and _same_faces(world, index[path], number)][:1]
    if not paths or world.object_keys[number].winding in ("normals", "flipped"):
        return 0.0
    return min(counts[paths[0]] / max(end - begin, 1), 1.0)


def _same_faces(world: World, one: int, other: int) -> bool:
    first = world.faces[world.first_face[one] : world.first_face[one + 1]] - world.first_vertex[one]
    second = world.faces[world.first_face[other] : world.first_face[other + 1]] - world.first_vertex[other]
    return first.shape == second.shape and (
        np.array_equal(first, second) or np.array_equal(first, second[:, ::-1])  # mirrored instances are turned
    )


def wound_against_neighbours(world: World, number: int, face: int) -> bool:
    """Whether a face runs along more of its edges in the direction in which its neighbours run than against it."""
    first, last = int(world.first_vertex[number]), int(world.first_vertex[number + 1])
    begin, end = int(world.first_face[number]), int(world.first_face[number + 1])
    positions = world.positions[first:last]
    # the object's vertices at the places of the face's corners, numbered by corner
    corner = np.full(last - first, -1, np.int64)
    for place in range(3):
        corner[np.all(positions == world.positions[world.faces[face, place]], axis=1)] = place
    faces = corner[world.faces[begin:end] - first]
    near = faces[(faces >= 0).sum(axis=1) == 2]
    start, stop = near.ravel(), near[:, [1, 2, 0]].ravel()
    whole = (start >= 0) & (stop >= 0) & (start != stop)
    alike = (stop[whole] - start[whole]) % 3 == 1  # as the face itself runs
    return int(alike.sum()) > int((~alike).sum())


def shell_around(world: World, number: int, point: Float64Array) -> Shell:
    """How an object surrounds a point.

    Args:
        world: The flattened scene.
        number: The object.
        point: Shape (3,), relative to `World.origin`.
    """
    faces = world.faces[world.first_face[number] : world.first_face[number + 1]]
    corners = world.positions[faces]
    used = world.positions[np.unique(faces)]
    low, high = used.min(axis=0), used.max(axis=0)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    to_middle = 0.5 * (low + high) - corners.mean(axis=1)
    inward = np.einsum("ij,ij->i", normal, to_middle) > 0.0
    place = weld_positions(world.positions[world.first_vertex[number] : world.first_vertex[number + 1]])[
        faces - world.first_vertex[number]
    ]
    start, stop = place.ravel(), place[:, [1, 2, 0]].ravel()
    length = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).ravel()
    _, edge, count = np.unique(edge_keys(start, stop), return_inverse=True, return_counts=True)
    shared = count[edge.reshape(-1)] == 2
    return Shell(
        winding=winding_number(corners - point),
        closed=float(length[shared].sum() / max(length.sum(), 1e-300)),
        inward=float(area[inward].sum() / max(area.sum(), 1e-300)),
        crossed=_crossing(world, number, low, high),
    )


def winding_number(corners: Float64Array) -> float:
    """Winding number of triangles, shape (m, 3, 3), about the origin: solid angles over 4π, positive from behind.

    References:
        Van Oosterom and Strackee 1983, "The Solid Angle of a Plane Triangle"; Jacobson et al. 2013.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    x, y, z = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = (
        x * y * z + np.einsum("ij,ij->i", a, b) * z + np.einsum("ij,ij->i", b, c) * x + np.einsum("ij,ij->i", c, a) * y
    )
    return float(2.0 * np.arctan2(volume, dots).sum() / (4.0 * np.pi))


def _crossing(world: World, number: int, low: Float64Array, high: Float64Array) -> int:
    """Casting objects that have faces inside a box and vertices outside of it."""
    inner = 0.02 * (high - low)
    owner = np.repeat(np.arange(world.object_count), np.diff(world.first_vertex))
    outside = np.any((world.positions < low - inner) | (world.positions > high + inner), axis=1)
    has_outside = np.bincount(owner, outside, world.object_count) > 0
    faces = np.flatnonzero(has_outside[world.face_object] & (world.face_object != number) & world.face_casts)
    reaches = np.ones(len(faces), np.bool_)
    for axis in range(3):
        corner = world.positions[:, axis][world.faces[faces]]
        reaches &= (corner.max(axis=1) > low[axis] + inner[axis]) & (corner.min(axis=1) < high[axis] - inner[axis])
    return len(np.unique(world.face_object[faces[reaches]]))
