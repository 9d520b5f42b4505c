"""Spots looked at by a few rays each: which of them anybody can see, and whether the mapping is to blame.

`find_spots` traces nothing. With some thousand rays for all spots together, those that lie inside or under something
sink to the end of the list, and the guesses know whether a value agrees with what can be seen from its vertex.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from bake.explain.cause_names import CauseKind
from bake.explain.looks import look
from bake.explain.retrace import tracer_like
from bake.explain.spots import Spots
from bake.geometry import face_normals
from bake.trace import Tracer
from bake.types import BakeResult, Float64Array, Int64Array, World

RAYS = 48  # from each spot
INWARD, MOST_INWARD = 0.1, 5e-3  # from the vertex into its largest face: a share of the way, metres at most
OUT_OF_SIGHT = 0.25
"""What the severity of a spot is worth that nobody can see."""

MAPPING = (CauseKind.STARVED, CauseKind.OVERSHOOT, CauseKind.BURIED)

LOOKING = (CauseKind.CREVICE, CauseKind.AGAINST_FACE, CauseKind.SHELL)
"""Causes under which a value is what rays from the spot see."""


def refine_spots(spots: Spots, tracer: Tracer) -> Spots:
    """The same spots, ranked and guessed anew by what their vertices see.

    Args:
        spots: From `find_spots`.
        tracer: Of that bake; see `look_at_spots`.
    """
    if not len(spots):
        return spots
    world = tracer.world
    face = _largest_face(world, spots.vertex)
    corners = world.positions[world.faces[face]]
    position = world.positions[spots.vertex]
    inward = corners.mean(axis=1) - position
    length = np.maximum(np.linalg.norm(inward, axis=1, keepdims=True), 1e-12)
    points = position + inward * np.minimum(INWARD, MOST_INWARD / length)
    normals = face_normals(world.positions, world.faces[face])[0]
    extent = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    front = look(tracer, points, normals, spots.object.astype(np.int64), extent, RAYS)
    seen = front.ao[:, tracer.settings.column_distances.index(spots.distance)]
    unseen = (front.proof > 0.5) & (front.stopped > 0.02)
    severity = np.where(unseen, OUT_OF_SIGHT, 1.0) * spots.severity
    order = np.argsort(-severity, kind="stable")
    rows: list[int] = order.tolist()
    return dataclasses.replace(
        spots,
        vertex=spots.vertex[order],
        object=spots.object[order],
        centre=spots.centre[order],
        radius=spots.radius[order],
        vertices=spots.vertices[order],
        area=spots.area[order],
        severity=severity[order].astype(np.float32),
        value=spots.value[order],
        usual=spots.usual[order],
        signs=spots.signs[order],
        guess=tuple(_guess(spots.guess[row], bool(unseen[row]), float(seen[row] - spots.value[row])) for row in rows),
        first=np.concatenate(([0], np.cumsum(np.diff(spots.first)[order]))).astype(np.int64),
        members=np.concatenate([spots.members_of(row) for row in rows]),
        seen=seen[order].astype(np.float32),
        unseen=unseen[order],
    )


def look_at_spots(result: BakeResult, spots: Spots) -> Spots:
    """`refine_spots` with a tracer of its own.

    Raises:
        DeviceError: nothing here can trace.
    """
    if not len(spots):
        return spots
    with tracer_like(result) as tracer:
        return refine_spots(spots, tracer)


def _guess(before: CauseKind, unseen: bool, gap: float) -> CauseKind:
    """The first guess, held against what can be seen."""
    if unseen:
        return CauseKind.BURIED
    if before in MAPPING and gap < 0.05:
        return CauseKind.CREVICE  # the value is right, so the mapping is not to blame
    if before in LOOKING and gap > 0.15:
        return CauseKind.STARVED  # rays from here see more than the value says, so it is not what they meet
    return before


def _largest_face(world: World, vertices: Int64Array) -> Int64Array:
    """The largest face around each vertex, shape (s,); every vertex has one."""
    wanted = np.zeros(world.vertex_count, np.bool_)
    wanted[vertices] = True
    face, corner = np.nonzero(wanted[world.faces])
    area: Float64Array = face_normals(world.positions, world.faces[face])[1]
    vertex = world.faces[face, corner]
    order = np.lexsort((face, -area, vertex))
    first = np.flatnonzero(np.diff(vertex[order], prepend=-1))
    found = np.zeros(world.vertex_count, np.int64)
    found[vertex[order[first]]] = face[order[first]]
    return found[vertices]
