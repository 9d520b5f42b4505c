"""Which grid points of a region count: those that its seed can reach through free space (Sloan et al. 2013, 2.3).

The paper's visibility system answers this; here rays do. Neighbouring points of the grid are joined where the segment
between them is clear. What the seed's part of the grid does not hold is then tried from there by clear lines of sight,
first from grid points alone, then over helpers strewn in between, so that a doorway which no grid line passes is
found. Every way stays inside the region's box. A passage that none of some thousand lines meets is missed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bake.region_types import GRID
from bake.regions.free_space import FreeSpace
from bake.regions.grid import box_points
from bake.regions.sight import spread
from bake.types import BoolArray, Float64Array, Int64Array

CRACK = 0.05
"""Metres: an opening narrower than this lets nothing pass (less in boxes that are small themselves)."""

_REGIONS_AT_ONCE = 512  # bounds the memory: about 100 MB


@dataclass(frozen=True, slots=True)
class Reach:
    """What seeds reach.

    Attributes:
        valid: Shape (r, GRID³), bool, in the order of `RegionPoints`.
        seed: Shape (r, 3), float64: as given, or found.
    """

    valid: BoolArray
    seed: Float64Array


def reachable(
    minimum: Float64Array,
    maximum: Float64Array,
    seed: Float64Array,
    free: FreeSpace,
    *,
    down: Float64Array | None = None,
) -> Reach:
    """Grid points that are reachable in free space from their region's seed, and not inside geometry.

    A missing seed is found: of the parts into which geometry divides the grid, the one with most points above a floor,
    and in it the point with most room around.

    Args:
        minimum, maximum: Shape (r, 3), boxes relative to `World.origin`.
        seed: Shape (r, 3); NaN where it is to be found.
        free: What blocks.
        down: Unit vector, shape (3,), where floors are looked for; None if nobody knows.
    """
    parts = [
        _reach(minimum[part], maximum[part], seed[part], free, down)
        for part in (slice(b, b + _REGIONS_AT_ONCE) for b in range(0, len(minimum), _REGIONS_AT_ONCE))
    ]
    if not parts:
        return Reach(np.zeros((0, GRID**3), np.bool_), np.zeros((0, 3)))
    return Reach(np.concatenate([part.valid for part in parts]), np.concatenate([part.seed for part in parts]))


def opening_width(minimum: Float64Array, maximum: Float64Array) -> Float64Array:
    """How wide an opening must be to let pass, metres, boxes of shape (r, 3) → (r,)."""
    return np.minimum(CRACK, (maximum - minimum).min(axis=1) / (20.0 * GRID))


def _reach(
    minimum: Float64Array, maximum: Float64Array, seed: Float64Array, free: FreeSpace, down: Float64Array | None
) -> Reach:
    points = box_points(minimum, maximum)
    count, grid = points.shape[:2]
    width = opening_width(minimum, maximum)
    label = _grid_parts(points, free, width)
    reach = np.repeat(np.linalg.norm(maximum - minimum, axis=1), grid)
    flat = points.reshape(-1, 3)
    inside, room = free.look(flat, reach)
    inside, room = inside.reshape(count, grid), room.reshape(count, grid)
    given = np.isfinite(seed).all(axis=1)
    seed = seed.copy()
    reached = np.zeros((count, grid), np.bool_)
    if given.any():
        reached[given] = _seen_from(seed[given], points[given], label[given], free)
    if not given.all():
        floor = ~inside
        if down is not None:
            floor &= free.below(flat, down, reach).reshape(count, grid)
        own = _best_part(label, floor, inside)
        reached[~given] = (label == own[:, None])[~given]
        open_room = np.where((label == own[:, None]) & ~inside, room, -1.0)
        found = points[np.arange(count), open_room.argmax(axis=1)]
        seed[~given] = found[~given]
    reached = spread(points, label, reached, ~inside, minimum, maximum, free, width=width)
    return Reach(reached & ~inside, seed)


def _grid_parts(points: Float64Array, free: FreeSpace, width: Float64Array) -> Int64Array:
    """Numbers of the parts into which blocked segments divide each grid, shape (r, g), from 0 in every region."""
    count, grid = points.shape[:2]
    number = np.arange(grid, dtype=np.int64).reshape(GRID, GRID, GRID)
    a = np.concatenate([part.ravel() for part in (number[:-1], number[:, :-1], number[:, :, :-1])])
    b = np.concatenate([part.ravel() for part in (number[1:], number[:, 1:], number[:, :, 1:])])
    clear = free.clear(
        points[:, a].reshape(-1, 3), points[:, b].reshape(-1, 3), width=np.repeat(width, len(a))
    ).reshape(count, len(a))
    region, segment = np.nonzero(clear)
    joined = coo_array(
        (np.ones(len(region), np.int8), (region * grid + a[segment], region * grid + b[segment])),
        shape=(count * grid, count * grid),
    )
    label = connected_components(joined, directed=False)[1].reshape(count, grid).astype(np.int64)
    return label - label.min(axis=1, keepdims=True)


def _seen_from(seed: Float64Array, points: Float64Array, label: Int64Array, free: FreeSpace) -> BoolArray:
    """Points of the parts that a seed sees something of, shape (r, g)."""
    count, grid = label.shape
    seen = free.clear(np.repeat(seed, grid, axis=0), points.reshape(-1, 3)).reshape(count, grid)
    region, point = np.nonzero(seen)
    parts = np.zeros((count, int(label.max(initial=0)) + 1), np.bool_)
    parts[region, label[region, point]] = True
    return np.take_along_axis(parts, label, axis=1)


def _best_part(label: Int64Array, floor: BoolArray, inside: BoolArray) -> Int64Array:
    """The part of each grid where objects are likely to move, shape (r,)."""
    count = len(label)
    most = int(label.max(initial=0)) + 1
    place = (np.arange(count)[:, None] * most + label).ravel()
    # A part without any floor counts only where no part has one; one inside geometry only where all are.
    weight = floor * 1e6 + ~inside * 1.0 + 1e-6
    score = np.bincount(place, weights=weight.ravel(), minlength=count * most).reshape(count, most)
    return score.argmax(axis=1)
