"""Suspicious vertices gathered into spots: connected along edges, or close to each other."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bake.types import BoolArray, Float64Array, Int64Array

BLOCK = 4
"""A spot spans at most about so many times the distance within which vertices join; larger ones are divided."""


def cluster(
    chosen: BoolArray, corners: Int64Array, positions: Float64Array, owner: Int64Array, reach: float
) -> Int64Array:
    """Numbers the clusters of the chosen vertices.

    Two vertices of one object join if a face joins them or if they lie in one cell of a grid of edge `reach`. What
    grows over a whole wall is cut along a coarser grid, so that a spot remains a place to go to.

    Args:
        chosen: Shape (n,).
        corners: Shape (m, 3), vertices of faces.
        positions: Shape (n, 3), metres.
        owner: Shape (n,): object of each vertex.
        reach: In metres.

    Returns:
        Shape (n,), int64: a number from 0 on, without gaps; -1 where not chosen.
    """
    members = np.flatnonzero(chosen)
    found = np.full(len(chosen), -1, np.int64)
    if not len(members):
        return found
    row = np.full(len(chosen), -1, np.int64)
    row[members] = np.arange(len(members))
    ends = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    ends = row[ends[chosen[ends].all(axis=1)]]
    index = np.floor(positions[members] / reach).astype(np.int64)
    cell = _numbered(np.column_stack([index, owner[members]]))
    order = np.argsort(cell, kind="stable")
    same = np.flatnonzero(cell[order[1:]] == cell[order[:-1]])
    left = np.concatenate([ends[:, 0], order[same]])
    right = np.concatenate([ends[:, 1], order[same + 1]])
    graph = coo_array((np.ones(len(left), np.int8), (left, right)), shape=(len(members), len(members)))
    label = connected_components(graph, directed=False)[1].astype(np.int64)
    label = _divided(label, positions[members], BLOCK * reach)
    found[members] = label
    return found


def _divided(label: Int64Array, positions: Float64Array, block: float) -> Int64Array:
    """Clusters wider than two blocks are cut along a grid of blocks."""
    count = int(label.max()) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, label, positions)
    np.maximum.at(high, label, positions)
    wide = (np.max(high - low, axis=1) > 2.0 * block)[label]
    blocks = np.where(wide[:, None], np.floor(positions / block).astype(np.int64), 0)
    return _numbered(np.column_stack([label, blocks]))


def _numbered(rows: Int64Array) -> Int64Array:
    """A number for each row, equal for equal rows, shape (n,)."""
    order = np.lexsort(rows.T)
    new = np.zeros(len(rows), np.bool_)
    new[1:] = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    number = np.empty(len(rows), np.int64)
    number[order] = np.cumsum(new)
    return number
