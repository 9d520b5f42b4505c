"""Voxels inside of things take over what the valid voxels around them saw."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from bake.arrays import BoolArray, Float32Array, Float64Array, Int32Array
from bake.decorators.harmonics import constant
from bake.decorators.volume_grid import find

_NEIGHBOURS = np.array(
    [[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)], np.int64
)


def fill_invalid(voxel: Int32Array, sh: Float32Array, valid: BoolArray) -> tuple[Float32Array, int]:
    """Replaces the harmonics of invalid voxels by those of their valid neighbours.

    Ring by ring: a voxel with neighbours that have a value takes their mean, weighted by the inverse distance; what it
    traced itself is never used. A piece of the volume without any valid voxel (a tree buried whole) has nothing to take
    over and counts as open.

    Args:
        voxel: Shape (v, 3), grid coordinates.
        sh: Shape (v, 9, k), as traced.
        valid: Shape (v,).

    Returns:
        Harmonics, shape (v, 9, k), and the number of voxels that had to count as open.
    """
    if valid.all():
        return sh, 0
    filled = np.where(valid[:, None, None], sh, np.float32(0.0))
    known = valid.copy()
    rows, columns, weights = _edges(voxel, ~valid)
    values: Float64Array = filled.reshape(len(sh), -1).astype(np.float64)
    # Among the invalid voxels only; each edge is used once, when its far end has just become known.
    while True:
        useful = known[columns] & ~known[rows]
        if not useful.any():
            break
        shape = (len(sh), len(sh))
        ring = csr_array((weights[useful], (rows[useful], columns[useful])), shape=shape)
        total = np.asarray(ring.sum(axis=1)).ravel()
        reached = total > 0.0
        values[reached] = np.asarray(ring @ values)[reached] / total[reached, None]
        known |= reached
        left = ~known[rows]
        rows, columns, weights = rows[left], columns[left], weights[left]
    filled = values.reshape(sh.shape).astype(np.float32)
    filled[valid] = sh[valid]
    lost = ~known
    filled[lost] = constant(1.0, int(lost.sum()), sh.shape[2])
    return filled, int(lost.sum())


def _edges(voxel: Int32Array, wanting: BoolArray) -> tuple[np.ndarray, np.ndarray, Float64Array]:
    """From each wanting voxel to those of its 26 neighbours that exist, with the inverse distance in cells."""
    own = np.flatnonzero(wanting)
    around = (voxel[own, None, :].astype(np.int64) + _NEIGHBOURS).reshape(-1, 3)
    other = find(around, voxel)
    weight = np.tile(1.0 / np.linalg.norm(_NEIGHBOURS, axis=1), len(own))
    there = other >= 0
    return np.repeat(own, len(_NEIGHBOURS))[there], other[there], weight[there]
