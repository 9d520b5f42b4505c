"""The weighted average of a whole scene without the surface that smoothing and solving need.

The values are those that `VertexMapper` gives for the average, but nothing is built for them beyond the welded
vertices: no edges but those around vertices without samples, no components but where one has no sample at all.
"""

from __future__ import annotations

import numpy as np

from bake.errors import SolveError
from bake.in_parts import meanwhile
from bake.settings import BakeSettings
from bake.solve.average import OPEN, fill_by_rings, nearest_among
from bake.solve.mass import FaceMoments, square_error, sum_moments
from bake.solve.receivers import Receivers, find_receivers
from bake.solve.scatter import scatter_add
from bake.solve.surface import component_order
from bake.triangles import touching
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


def average_to_vertices(
    world: World,
    samples: SampleSet,
    ao: Float32Array,
    valid: BoolArray,
    settings: BakeSettings,
    receivers: Receivers | None = None,
) -> VertexField:
    """The weighted average at every vertex.

    Args:
        world: The flattened scene.
        samples: Where AO was estimated.
        ao: Shape (n, k), float32, in [0, 1].
        valid: Shape (n,), bool: samples to use.
        settings: `weld_instances` and `crease_angle` decide which vertices are one.
        receivers: Of the world with these settings, if they are there already.

    Raises:
        SolveError: a value that should be used is not finite.
    """
    refuse_unfinished(ao, valid)
    welded = receivers or find_receivers(world, settings)
    moments = sum_moments(welded.rows(samples.face), len(welded.corners), samples, ao, valid)
    mass = moments.mass
    values, starved = _average(world, welded, moments, mass)

    unknown, baked = welded.unknown, welded.baked
    field = np.full((world.vertex_count, ao.shape[1]), np.nan, np.float32)
    field[baked] = values[unknown[baked]]
    state = np.full(world.vertex_count, VertexState.NOT_BAKED, np.uint8)
    state[~welded.referenced] = VertexState.UNREFERENCED
    state[baked] = np.where(starved[unknown[baked]], VertexState.FILLED, VertexState.BAKED)
    report = SolveReport(
        unknowns=welded.count,
        components=0,
        iterations=0,
        residual=0.0,
        limited_edges=0,
        bounded=(0,) * ao.shape[1],
        rmse=sample_rmse(welded.corners, values, moments, mass),
    )
    return VertexField(field, state, report)


def _average(
    world: World, welded: Receivers, moments: FaceMoments, mass_at_corners: Float64Array
) -> tuple[Float64Array, BoolArray]:
    """Values, shape (u, k), and which unknowns have no sample of their own, shape (u,)."""
    corners, columns = welded.corners, moments.value.shape[2]
    weighing = meanwhile(lambda: scatter_add(corners, mass_at_corners, welded.count), len(corners))
    sums = [scatter_add(corners, moments.value[:, :, k], welded.count) for k in range(columns)]
    mass = weighing()
    starved = mass <= 0.0
    divisor = np.where(starved, 1.0, mass)
    values = np.stack([total / divisor for total in sums], axis=1)
    if starved.all():
        return np.full_like(values, OPEN), starved
    if starved.any():
        lost = starved & ~fill_by_rings(_edges_at(corners, starved), values, starved)
        if lost.any():
            values[lost] = _from_afar(world, welded, values, starved, lost)
    return np.clip(values, 0.0, 1.0), starved


def _edges_at(corners: Int64Array, starved: BoolArray) -> Int64Array:
    """The edges of faces that touch a starved unknown, shape (e, 2), each once."""
    near = corners[touching(corners, starved)]
    tail, head = near.reshape(-1), near[:, [1, 2, 0]].reshape(-1)
    keys = np.sort((np.minimum(tail, head) << 32) | np.maximum(tail, head))
    keys = keys[np.append(True, keys[1:] != keys[:-1])]
    edges = np.column_stack((keys >> 32, keys & (2**32 - 1)))
    return edges[edges[:, 0] != edges[:, 1]]


def _from_afar(
    world: World, welded: Receivers, values: Float64Array, starved: BoolArray, lost: BoolArray
) -> Float64Array:
    """The values of the nearest unknowns that have samples, of equally near ones the first in the solver's order."""
    taken = slice(None) if welded.baked.all() else welded.baked
    position = np.empty((welded.count, 3))
    position[welded.unknown[taken]] = world.positions[taken]
    known = np.flatnonzero(~starved)
    # Most likely some are equally near, as where a crease parts vertices.
    order = meanwhile(lambda: component_order(welded.unknown, welded.corners, welded.count), len(welded.corners))
    return values[nearest_among(position, known, np.flatnonzero(lost), order)]


def refuse_unfinished(ao: Float32Array, valid: BoolArray) -> None:
    """Tells that a valid sample has no value.

    Raises:
        SolveError: it has none.
    """
    if not (np.isfinite(ao) | ~valid[:, None]).all():
        raise SolveError("a valid sample has no finite AO", where="samples", remedy="trace the scene again")


def sample_rmse(
    corners: Int64Array, values: Float64Array, moments: FaceMoments, mass: Float64Array | None = None
) -> tuple[float, ...]:
    """Root of the area-weighted mean square of (interpolated value - sample), from the faces' sums.

    Args:
        corners: Shape (m, 3): unknowns of each face.
        values: Shape (u, k).
        moments: Of the m faces.
        mass: `moments.mass`, if it is there already.
    """
    total = float((moments.mass if mass is None else mass).sum())
    if total <= 0.0:
        return (0.0,) * values.shape[1]
    return tuple(np.sqrt(np.maximum(square_error(corners, values, moments), 0.0) / total).tolist())
