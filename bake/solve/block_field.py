"""From the values of blocks to those of the world's vertices, and back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bake.solve.block import Block, ranges
from bake.types import Float32Array, Float64Array, Int64Array, SolveReport, UInt8Array, VertexState, World


def write_values(world: World, block: Block, ao: Float32Array, state: UInt8Array) -> None:
    """Writes a block's part of a field in place."""
    vertices = ranges(world.first_vertex, block.objects)
    unknown = block.surface.unknown
    has = unknown >= 0
    baked, own = vertices[has], unknown[has]
    ao[vertices] = np.nan
    ao[baked] = block.values[own]
    state[vertices] = VertexState.UNREFERENCED
    state[baked] = np.where(block.equations.starved[own], VertexState.FILLED, VertexState.BAKED)


def write_unbaked(world: World, objects: Int64Array, ao: Float32Array, state: UInt8Array) -> None:
    """Writes the part of objects that receive nothing in place."""
    vertices = ranges(world.first_vertex, objects)
    ao[vertices] = np.nan
    state[vertices] = VertexState.UNREFERENCED
    state[world.faces[ranges(world.first_face, objects)].ravel()] = VertexState.NOT_BAKED


def read_values(world: World, block: Block, ao: Float32Array) -> Float64Array:
    """Values of vertices as those of a block's unknowns, its own where they are not known, shape (u, k)."""
    unknown = block.surface.unknown
    told = ao[ranges(world.first_vertex, block.objects)]
    use = np.flatnonzero((unknown >= 0) & np.isfinite(told).all(axis=1))
    values = block.values.copy()
    values[unknown[use]] = told[use]
    return values


def report_of(blocks: Sequence[Block], columns: int, alpha: float, iterations: int, residual: float) -> SolveReport:
    """How it went, over all blocks."""
    mass = sum(block.mass for block in blocks)
    error, held = np.zeros(columns), np.zeros(columns, np.int64)
    for block in blocks:
        error += block.square_error
        held += block.held_vertices
    rmse = np.sqrt(np.maximum(error, 0.0) / mass) if mass > 0.0 else np.zeros(columns)
    return SolveReport(
        unknowns=sum(block.surface.unknown_count for block in blocks),
        components=sum(len(block.failed) for block in blocks),
        iterations=iterations,
        residual=residual,
        limited_edges=sum(block.equations.limited for block in blocks) if alpha > 0.0 else 0,
        bounded=tuple(int(n) for n in held),
        rmse=tuple(float(value) for value in rmse),
        averaged=sum(int(np.diff(block.surface.first)[block.failed].sum()) for block in blocks),
    )
