"""The weighted average of a whole scene without the surface that smoothing and solving need.

The values are those that `VertexMapper` gives for the average, but nothing is built for them beyond the welded
vertices: no edges but those around vertices without samples, no components but where one has no sample at all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.errors import SolveError
from bake.settings import BakeSettings
from bake.solve.average import OPEN, fill_by_rings, nearest_among
from bake.solve.mass import FaceMoments, square_error, sum_moments
from bake.solve.scatter import scatter_add
from bake.solve.surface import by_component
from bake.solve.weld import weld_vertices
from bake.types import (
    BoolArray,
    Float32Array,
    Float64Array,
    Int64Array,
    SampleSet,
    SolveReport,
    VertexField,
    VertexState,
    World,
)


@dataclass(frozen=True, slots=True)
class _Welded:
    """Unknowns of the receiving objects.

    Attributes:
        unknown: Shape (n,), int64: the unknown of each vertex, -1 where it has none.
        corners: Shape (m, 3), int64: unknowns of each receiving face.
        count: How many there are.
    """

    unknown: Int64Array
    corners: Int64Array
    count: int


def average_to_vertices(
    world: World, samples: SampleSet, ao: Float32Array, valid: BoolArray, settings: BakeSettings
) -> VertexField:
    """The weighted average at every vertex.

    Args:
        world: The flattened scene.
        samples: Where AO was estimated.
        ao: Shape (n, k), float32, in [0, 1].
        valid: Shape (n,), bool: samples to use.
        settings: `weld_instances` and `crease_angle` decide which vertices are one.

    Raises:
        SolveError: a value that should be used is not finite.
    """
    refuse_unfinished(ao, valid)
    receives = np.array([role.receives_per_vertex for role in world.object_roles], np.bool_)
    faces = np.flatnonzero(receives[world.face_object])
    row = np.full(world.face_count, -1, np.int64)
    row[faces] = np.arange(len(faces))
    receiving = world.faces[faces]
    baked, referenced = np.zeros(world.vertex_count, np.bool_), np.zeros(world.vertex_count, np.bool_)
    baked[receiving.reshape(-1)] = True
    referenced[world.faces.reshape(-1)] = True
    unknown, count = weld_vertices(
        world, baked, crease_angle=settings.crease_angle, weld_instances=settings.weld_instances
    )
    welded = _Welded(unknown, unknown[receiving], count)
    moments = sum_moments(row[samples.face], len(faces), samples, ao, valid)
    values, starved = _average(world, welded, moments)

    field = np.full((world.vertex_count, ao.shape[1]), np.nan, np.float32)
    field[baked] = values[unknown[baked]]
    state = np.full(world.vertex_count, VertexState.NOT_BAKED, np.uint8)
    state[~referenced] = VertexState.UNREFERENCED
    state[baked] = np.where(starved[unknown[baked]], VertexState.FILLED, VertexState.BAKED)
    report = SolveReport(
        unknowns=count,
        components=0,
        iterations=0,
        residual=0.0,
        limited_edges=0,
        bounded=(0,) * ao.shape[1],
        rmse=sample_rmse(welded.corners, values, moments),
    )
    return VertexField(field, state, report)


def _average(world: World, welded: _Welded, moments: FaceMoments) -> tuple[Float64Array, BoolArray]:
    """Values, shape (u, k), and which unknowns have no sample of their own, shape (u,)."""
    corners, columns = welded.corners, moments.value.shape[2]
    mass = scatter_add(corners, moments.mass, welded.count)
    starved = mass <= 0.0
    divisor = np.where(starved, 1.0, mass)
    values = np.stack(
        [scatter_add(corners, moments.value[:, :, k], welded.count) / divisor for k in range(columns)], axis=1
    )
    if starved.all():
        return np.full_like(values, OPEN), starved
    if starved.any():
        lost = starved & ~fill_by_rings(_edges_at(corners, starved), values, starved)
        if lost.any():
            values[lost] = _from_afar(world, welded, values, starved, lost)
    return np.clip(values, 0.0, 1.0), starved


def _edges_at(corners: Int64Array, starved: BoolArray) -> Int64Array:
    """The edges of faces that touch a starved unknown, shape (e, 2), each once."""
    near = corners[starved[corners].any(axis=1)]
    tail, head = near.reshape(-1), near[:, [1, 2, 0]].reshape(-1)
    size = len(starved)
    keys = np.sort(np.minimum(tail, head) * size + np.maximum(tail, head))
    edges = np.column_stack(np.divmod(keys[np.append(True, keys[1:] != keys[:-1])], size))
    return edges[edges[:, 0] != edges[:, 1]]


def _from_afar(
    world: World, welded: _Welded, values: Float64Array, starved: BoolArray, lost: BoolArray
) -> Float64Array:
    """The values of the nearest unknowns that have samples, of equally near ones the first in the solver's order."""
    renumbered, _, _ = by_component(welded.unknown, welded.corners, welded.count)
    taken = welded.unknown >= 0
    position, rank = np.empty((welded.count, 3)), np.empty(welded.count, np.int64)
    position[welded.unknown[taken]] = world.positions[taken]
    rank[welded.unknown[taken]] = renumbered[taken]
    known = np.flatnonzero(~starved)
    known = known[np.argsort(rank[known])]
    return values[nearest_among(position, known, np.flatnonzero(lost))]


def refuse_unfinished(ao: Float32Array, valid: BoolArray) -> None:
    """Tells that a valid sample has no value.

    Raises:
        SolveError: it has none.
    """
    if not np.isfinite(ao[valid]).all():
        raise SolveError("a valid sample has no finite AO", where="samples", remedy="trace the scene again")


def sample_rmse(corners: Int64Array, values: Float64Array, moments: FaceMoments) -> tuple[float, ...]:
    """Root of the area-weighted mean square of (interpolated value - sample), from the faces' sums.

    Args:
        corners: Shape (m, 3): unknowns of each face.
        values: Shape (u, k).
        moments: Of the m faces.
    """
    total = float(moments.mass.sum())
    if total <= 0.0:
        return (0.0,) * values.shape[1]
    return tuple(np.sqrt(np.maximum(square_error(corners, values, moments), 0.0) / total).tolist())
