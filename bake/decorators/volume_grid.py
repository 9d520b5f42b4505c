"""Where the tree volume has voxels: a sparse grid of two levels over the boxes of all trees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.arrays import BoolArray, Float64Array, Int32Array, Int64Array

BRICK = 8
"""Cells along the edge of a brick."""

MOST_VOXELS = 1 << 20
"""Beyond this the grid is coarsened: a thousand million rays at 1024 directions a voxel."""

MOST_BRICKS = 1 << 24
"""Most entries of the top level, used or not: 64 MB."""

_COARSER = 2.0 ** (1.0 / 3.0)  # halves the number of voxels
_SHIFT = 3
_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.int64)


@dataclass(frozen=True, slots=True)
class VoxelGrid:
    """Cells that boxes touch, in bricks, and the voxels at their corners.

    Attributes:
        origin: Shape (3,), float64: position of the grid corner (0, 0, 0), a multiple of `spacing` in world space.
        spacing: Edge of a cell, in metres.
        top, brick_voxels, voxel: As in `TreeVolume`.
        first: Shape (3,), int64: the grid corner (0, 0, 0), counted in world space; it keeps seeds where they are
            when the scene's centre moves.
    """

    origin: Float64Array
    spacing: float
    top: Int32Array
    brick_voxels: Int32Array
    voxel: Int32Array
    first: Int64Array

    @property
    def positions(self) -> Float64Array:
        """Shape (v, 3), metres relative to `World.origin`."""
        return self.origin + self.voxel * self.spacing


def build_grid(minimum: Float64Array, maximum: Float64Array, spacing: float, world_origin: Float64Array) -> VoxelGrid:
    """The voxels that make trilinear interpolation possible at every point of every box.

    A point's cell is found by the same arithmetic as a box's first and last cell, and rounding keeps order, so no point
    of a closed box can fall outside. Where the grid would exceed `MOST_VOXELS` or `MOST_BRICKS`, its spacing grows by
    ∛2 until it does not; the caller sees it in `spacing`.

    Args:
        minimum, maximum: Shape (b, 3), metres relative to `world_origin`, b ≥ 1.
        spacing: Wanted edge of a cell.
        world_origin: Shape (3,): where the world's zero lies.
    """
    grid = None
    while grid is None:
        grid = _grid(minimum, maximum, spacing, world_origin)
        spacing *= _COARSER
    return grid


def _grid(minimum: Float64Array, maximum: Float64Array, spacing: float, world_origin: Float64Array) -> VoxelGrid | None:
    first = np.floor((minimum.min(axis=0) + world_origin) / spacing).astype(np.int64)
    # Rounding may put the snapped corner a hair above the lowest box.
    first -= first * spacing - world_origin > minimum.min(axis=0)
    origin: Float64Array = first * spacing - world_origin
    low, high = cell_of(minimum, origin, spacing), cell_of(maximum, origin, spacing)
    extent = high.max(axis=0) + 1
    bricks = (extent + BRICK - 1) // BRICK
    cell_count = (high - low + 1).astype(np.float64).prod(axis=1).sum()
    if bricks.astype(np.float64).prod() > MOST_BRICKS or cell_count > 16 * MOST_VOXELS:
        return None
    cells = _cells(low, high, extent)
    voxel = _unique(np.concatenate([cells + corner for corner in _CORNERS]), extent + 1)
    if len(voxel) > MOST_VOXELS:
        return None
    top, brick_voxels = _bricks(cells, voxel, bricks, extent + 1)
    return VoxelGrid(origin, spacing, top, brick_voxels, voxel.astype(np.int32), first)


def cell_of(points: Float64Array, origin: Float64Array, spacing: float) -> Int64Array:
    """The cell of each point, shape (n, 3)."""
    return np.floor((points - origin) / spacing).astype(np.int64)


def corners_of(cells: Int64Array, top: Int32Array, brick_voxels: Int32Array) -> tuple[Int64Array, BoolArray]:
    """The eight voxels around each cell.

    Args:
        cells: Shape (n, 3).
        top, brick_voxels: As in `TreeVolume`.

    Returns:
        Voxels, shape (n, 8), z running fastest, and which cells have all of them, shape (n,).
    """
    bricks = cells >> _SHIFT
    inside = ((cells >= 0) & (bricks < np.array(top.shape))).all(axis=1)
    brick = np.full(len(cells), -1, np.int64)
    brick[inside] = top[tuple(bricks[inside].T)]
    local = (cells & (BRICK - 1))[:, None, :] + _CORNERS
    voxels = np.full((len(cells), 8), -1, np.int64)
    there = brick >= 0
    voxels[there] = brick_voxels[brick[there, None], local[there, :, 0], local[there, :, 1], local[there, :, 2]]
    complete: BoolArray = np.all(voxels >= 0, axis=1)
    return voxels, complete


def find(wanted: Int64Array, voxel: Int64Array | Int32Array) -> Int64Array:
    """Numbers of grid points among `voxel` (any order), shape (n,); -1 where there is none."""
    if len(voxel) == 0:
        return np.full(len(wanted), -1, np.int64)
    extent = voxel.max(axis=0).astype(np.int64) + 1
    keys = _key(voxel.astype(np.int64), extent)
    order = np.argsort(keys, kind="stable")
    within = ((wanted >= 0) & (wanted < extent)).all(axis=1)
    key = np.where(within, _key(wanted, extent), -1)
    place = np.minimum(np.searchsorted(keys, key, sorter=order), len(keys) - 1)
    number = order[place]
    return np.where(within & (keys[number] == key), number, -1)


def _cells(low: Int64Array, high: Int64Array, extent: Int64Array) -> Int64Array:
    """Every cell of every box once, shape (c, 3)."""
    size = high - low + 1
    counts = size.prod(axis=1)
    box = np.repeat(np.arange(len(low)), counts)
    number: Int64Array = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
    column: Int64Array = number // size[box, 2]
    local = np.stack([column // size[box, 1], column % size[box, 1], number % size[box, 2]], axis=1)
    return _unique(low[box] + local, extent)


def _unique(points: Int64Array, extent: Int64Array) -> Int64Array:
    """Distinct grid points, brick after brick, so that neighbours are traced and stored together."""
    bricks = (extent + BRICK) // BRICK
    local = points & (BRICK - 1)
    key = np.unique(_key(points >> _SHIFT, bricks) * BRICK**3 + _key(local, np.full(3, BRICK)))
    brick, inner = key // BRICK**3, key % BRICK**3
    return _unkey(brick, bricks) * BRICK + _unkey(inner, np.full(3, BRICK))


def _bricks(
    cells: Int64Array, voxel: Int64Array, bricks: Int64Array, extent: Int64Array
) -> tuple[Int32Array, Int32Array]:
    used = np.unique(_key(cells >> _SHIFT, bricks))
    top = np.full(tuple(bricks), -1, np.int32)
    top.reshape(-1)[used] = np.arange(len(used), dtype=np.int32)
    edge = np.arange(BRICK + 1)
    local = np.stack(np.meshgrid(edge, edge, edge, indexing="ij"), axis=-1).reshape(1, -1, 3)
    corners = (_unkey(used, bricks)[:, None, :] * BRICK + local).reshape(-1, 3)
    found = find(corners, voxel)
    return top, found.reshape(len(used), BRICK + 1, BRICK + 1, BRICK + 1).astype(np.int32)


def _key(points: Int64Array, extent: Int64Array) -> Int64Array:
    return (points[:, 0] * extent[1] + points[:, 1]) * extent[2] + points[:, 2]


def _unkey(key: Int64Array, extent: Int64Array) -> Int64Array:
    rest = key // extent[2]
    return np.stack([rest // extent[1], rest % extent[1], key % extent[2]], axis=1)
