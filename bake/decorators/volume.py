"""The tree volume: spherical obscurance traced at voxels, repaired, and interpolated to any point and normal."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bake.arrays import BoolArray, Float32Array, Float64Array, Int64Array, UInt32Array
from bake.decorator_types import TreeVolume
from bake.decorators.harmonics import ambient_obscurance
from bake.decorators.volume_fill import fill_invalid
from bake.decorators.volume_grid import VoxelGrid, cell_of, corners_of
from bake.low_discrepancy import hash_u32
from bake.sphere_rays import SphereTracer

_RAYS_A_BATCH = 1 << 21
_POINTS_A_PART = 1 << 16


def tree_boxes(
    positions: Float64Array, faces: NDArray[np.integer], first_face: Int64Array, objects: NDArray[np.integer]
) -> tuple[Float64Array, Float64Array]:
    """World boxes of objects, each over the vertices that its faces use, shape (t, 3) twice; none of them empty.

    A box holds the positions as they are and as rounded to float32, which is what tracers and samples see.
    """
    low, high = np.empty((len(objects), 3)), np.empty((len(objects), 3))
    for row, number in enumerate(objects):
        used = positions[faces[first_face[number] : first_face[number + 1]].ravel()]
        low[row], high[row] = used.min(axis=0), used.max(axis=0)
    return np.minimum(low, low.astype(np.float32)), np.maximum(high, high.astype(np.float32))


@dataclass(frozen=True, slots=True)
class KnownVoxels:
    """Voxels of a grid that need not be traced.

    Attributes:
        sh: Shape (v, 9, k), float32: as traced, where it is known and valid.
        valid: Shape (v,), bool: where it is known.
        wanted: Shape (v,), bool: those to be traced.
    """

    sh: Float32Array
    valid: BoolArray
    wanted: BoolArray


def trace_volume(
    grid: VoxelGrid,
    tracer: SphereTracer,
    *,
    directions: int,
    back_face_threshold: float,
    seed: int,
    known: KnownVoxels | None = None,
) -> Generator[int, None, tuple[TreeVolume, int]]:
    """Traces every voxel and fills the invalid ones (Sloan et al. 2013, section 2.2).

    A voxel is invalid by the rule for surface samples: too many of its hits are back faces, so that it lies inside
    something or under the ground.

    Args:
        grid: Where the voxels are.
        tracer: Of the whole scene.
        directions: Rays a voxel, over the sphere.
        back_face_threshold: Largest share of back faces among the hits of a valid voxel.
        seed: The bake's.
        known: What need not be traced.

    Yields:
        How many voxels are done.

    Returns:
        The volume, and how many voxels had no valid one to be filled from and count as open.
    """
    points, seeds = grid.positions.astype(np.float32), voxel_seeds(grid, seed)
    rows = np.arange(len(points)) if known is None else np.flatnonzero(known.wanted)
    size = max(1, _RAYS_A_BATCH // directions)
    sh: list[Float32Array] = []
    judged: list[BoolArray] = []
    for begin in range(0, len(rows), size):
        part = rows[begin : begin + size]
        counts = tracer.gather_sphere(points[part], seeds[part], directions)
        sh.append(counts.sh)
        judged.append(counts.back_faces <= back_face_threshold * counts.hits)
        yield min(begin + size, len(rows))
    if known is None:
        harmonics, valid = np.concatenate(sh), np.concatenate(judged)
    else:
        harmonics, valid = known.sh.copy(), known.valid.copy()
        if len(rows):
            harmonics[rows], valid[rows] = np.concatenate(sh), np.concatenate(judged)
    filled, lost = fill_invalid(grid.voxel, harmonics, valid)
    volume = TreeVolume(
        origin=grid.origin,
        spacing=grid.spacing,
        top=grid.top,
        brick_voxels=grid.brick_voxels,
        voxel=grid.voxel,
        sh=filled,
        valid=valid.astype(np.uint8),
    )
    return volume, lost


def voxel_seeds(grid: VoxelGrid, seed: int) -> UInt32Array:
    """A scramble for each voxel, shape (v,), from the seed and its place in the world."""
    x, y, z = (grid.voxel + grid.first).astype(np.uint32).T  # wraps round for negative coordinates
    with np.errstate(over="ignore"):
        mixed = hash_u32(x ^ hash_u32(np.full(1, seed, np.uint32)))
        return hash_u32(hash_u32(mixed + y) + z)


def evaluate(volume: TreeVolume, points: NDArray[np.floating], normals: NDArray[np.floating]) -> Float32Array:
    """AO at points about normals: trilinear between the eight voxels around, convolved with the clamped cosine.

    Args:
        volume: As baked.
        points: Shape (n, 3), metres relative to `World.origin`.
        normals: Shape (n, 3), unit.

    Returns:
        Shape (n, k), float32, in [0, 1]; NaN for points outside the cells that trees touch.
    """
    ao = np.empty((len(points), volume.sh.shape[2]), np.float32)
    for begin in range(0, len(points), _POINTS_A_PART):
        part = slice(begin, begin + _POINTS_A_PART)
        ao[part] = ambient_obscurance(interpolate(volume, points[part]), normals[part])
    return ao


def interpolate(volume: TreeVolume, points: NDArray[np.floating]) -> Float32Array:
    """Harmonics at points, shape (n, 9, k), float32; NaN outside."""
    finite: BoolArray = np.all(np.isfinite(points), axis=1)
    places: Float64Array = np.where(finite[:, None], points.astype(np.float64), volume.origin)
    cells = cell_of(places, volume.origin, volume.spacing)
    voxels, there = corners_of(cells, volume.top, volume.brick_voxels)
    there = there & finite
    share = np.clip((places - volume.origin) / volume.spacing - cells, 0.0, 1.0)
    sides = np.stack([1.0 - share, share], axis=2)
    weights = np.einsum("ni,nj,nk->nijk", sides[:, 0], sides[:, 1], sides[:, 2]).reshape(-1, 8)
    sh = np.full((len(points), *volume.sh.shape[1:]), np.nan, np.float32)
    sh[there] = np.einsum("nc,ncjk->njk", weights[there].astype(np.float32), volume.sh[voxels[there]])
    return sh
