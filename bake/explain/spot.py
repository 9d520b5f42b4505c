"""Names a point of the surface: by vertex, by face and weights, or by the nearest place that has a value."""

from __future__ import annotations

import numpy as np

from bake.errors import InputError
from bake.explain.types import Spot
from bake.geometry import face_normals
from bake.types import BakeResult, BoolArray, Float64Array, Int64Array, Role, VertexState, World


def vertex_spot(result: BakeResult, vertex: int) -> Spot:
    """One vertex.

    Args:
        result: A bake.
        vertex: Index into `World.positions`.

    Raises:
        InputError: no such vertex, or it has no value of its own.
    """
    world = result.world
    if not 0 <= vertex < world.vertex_count:
        raise InputError(f"no vertex {vertex}", where="explain", remedy=f"there are {world.vertex_count:,}")
    number = int(np.searchsorted(world.first_vertex, vertex, side="right")) - 1
    own = world.faces[world.first_face[number] : world.first_face[number + 1]]
    _check_receives(world, number)
    around = np.flatnonzero((own == vertex).any(axis=1)) + world.first_face[number]
    if result.field.state[vertex] == VertexState.UNREFERENCED or not len(around):
        raise InputError(
            "no triangle uses this vertex, so it has no value",
            where=f"{world.object_paths[number]}:{vertex - world.first_vertex[number]}",
            remedy="choose another vertex",
        )
    normals, areas = face_normals(world.positions, world.faces[around])
    normal = (normals * areas[:, None]).sum(axis=0)
    length = float(np.linalg.norm(normal))
    return Spot(
        position=world.positions[vertex].astype(np.float64),
        normal=normal / length if length > 0.0 else normals[0],
        object=number,
        face=int(around[np.argmax(areas)]),
        vertices=np.array([vertex], np.int64),
        weights=np.ones(1),
    )


def face_spot(world: World, face: int, weights: Float64Array) -> Spot:
    """A point of a face.

    Args:
        world: The scene.
        face: Index into `World.faces`.
        weights: Shape (3,), float64: barycentric, adding up to 1.

    Raises:
        InputError: no such face, or its object has no values per vertex.
    """
    if not 0 <= face < world.face_count:
        raise InputError(f"no face {face}", where="explain", remedy=f"there are {world.face_count:,}")
    number = int(world.face_object[face])
    _check_receives(world, number)
    corners = world.faces[face]
    return Spot(
        position=weights @ world.positions[corners],
        normal=face_normals(world.positions, world.faces[face : face + 1])[0][0],
        object=number,
        face=face,
        vertices=corners.astype(np.int64),
        weights=np.asarray(weights, np.float64),
    )


def nearest_spot(world: World, point: Float64Array) -> Spot:
    """The point nearest to `point` on a surface that has values per vertex.

    Args:
        world: The scene.
        point: Shape (3,), float64, metres relative to `World.origin`.

    Raises:
        InputError: the point is not finite, or nothing in the scene has values.
    """
    if point.shape != (3,) or not np.isfinite(point).all():
        raise InputError("the point is no three finite numbers", where="--point", remedy="write X,Y,Z in metres")
    faces = np.flatnonzero(receiving_faces(world))
    if not len(faces):
        raise InputError("no object has values per vertex", where="explain", remedy="check the objects' roles")
    face, weights = _nearest_on_faces(world, faces, point)
    return face_spot(world, face, weights)


def receiving_faces(world: World) -> BoolArray:
    """Faces whose vertices are fitted to samples, shape (m,)."""
    receives = np.array([role.receives_per_vertex for role in world.object_roles], np.bool_)
    return receives[world.face_object]


def named_vertex(world: World, text: str) -> int:
    """The vertex that `OBJECT:I` names: the object's path and the vertex's number in it.

    Raises:
        InputError: it is written otherwise, or there is no such object or vertex.
    """
    path, colon, digits = text.rpartition(":")
    if not colon or not digits.isdigit():
        raise InputError(
            f"{text!r} names no vertex", where="--vertex", remedy="write OBJECT:NUMBER, as in Hall/wall:12"
        )
    number = object_number(world, path, "--vertex")
    count = int(world.first_vertex[number + 1] - world.first_vertex[number])
    if int(digits) >= count:
        raise InputError(f"no vertex {digits}", where=path, remedy=f"it has 0 to {count - 1}")
    return int(world.first_vertex[number]) + int(digits)


def object_number(world: World, path: str, where: str) -> int:
    """The object of that path.

    Raises:
        InputError: there is none; the nearest path is named.
    """
    import difflib

    if path in world.object_paths:
        return world.object_paths.index(path)
    near = difflib.get_close_matches(path, world.object_paths[:20_000], 1, 0.4)
    remedy = f"did you mean {near[0]!r}?" if near else "see the outliner, or `report`"
    raise InputError(f"no object {path!r}", where=where, remedy=remedy)


def _check_receives(world: World, number: int) -> None:
    role = world.object_roles[number]
    if role.receives_per_vertex:
        return
    why = {
        Role.LOD: "its values are read off its finest level",
        Role.TREE: "its values are its model's, fitted to the volume around it",
        Role.SHRUB: "it has one value for all of it",
        Role.SMALL: "it has one value for all of it",
        Role.BLOCKER: "it casts and has no values",
        Role.IGNORE: "it takes no part in the bake",
    }[role]
    remedy = "explain a spot of that level" if role is Role.LOD else "choose an object that receives per vertex"
    raise InputError(f"its role is {role}: {why}", where=world.object_paths[number], remedy=remedy)


def _nearest_on_faces(world: World, faces: Int64Array, point: Float64Array) -> tuple[int, Float64Array]:
    """The nearest face and the barycentric weights of its nearest point."""
    corner = world.positions[world.faces[faces]] - point
    centre = corner.mean(axis=1)
    to_centre = np.linalg.norm(centre, axis=1)
    reach = np.sqrt(((corner - centre[:, None]) ** 2).sum(axis=2).max(axis=1))
    near = np.flatnonzero(to_centre - reach <= to_centre.min())
    weights = nearest_weights(corner[near])
    apart = np.linalg.norm(np.einsum("ij,ijk->ik", weights, corner[near]), axis=1)
    best = int(np.argmin(apart))
    return int(faces[near[best]]), weights[best]


def nearest_weights(corner: Float64Array) -> Float64Array:
    """Barycentric weights, shape (n, 3), of the points of triangles, shape (n, 3, 3), that are nearest to the origin.

    Inside, the foot of the perpendicular; else the nearest point of the nearest edge.
    """
    a, b, c = corner[:, 0], corner[:, 1], corner[:, 2]
    ab, ac = b - a, c - a
    d00, d01, d11 = (np.einsum("ij,ij->i", x, y) for x, y in ((ab, ab), (ab, ac), (ac, ac)))
    d20, d21 = -np.einsum("ij,ij->i", a, ab), -np.einsum("ij,ij->i", a, ac)
    determinant = d00 * d11 - d01 * d01
    safe = np.where(determinant > 0.0, determinant, 1.0)
    v, w = (d11 * d20 - d01 * d21) / safe, (d00 * d21 - d01 * d20) / safe
    inside = (determinant > 0.0) & (v >= 0.0) & (w >= 0.0) & (v + w <= 1.0)
    weights = np.stack([1.0 - v - w, v, w], axis=1)
    best = np.where(inside, 0.0, np.inf)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        start, arm = corner[:, i], corner[:, j] - corner[:, i]
        length = np.einsum("ij,ij->i", arm, arm)
        t = np.clip(-np.einsum("ij,ij->i", start, arm) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
        apart = ((start + t[:, None] * arm) ** 2).sum(axis=1)
        closer = apart < best
        edge = np.zeros_like(weights)
        edge[:, i], edge[:, j] = 1.0 - t, t
        weights[closer], best[closer] = edge[closer], apart[closer]
    return weights
