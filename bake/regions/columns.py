"""The solid parts of a world as stacks of intervals over a plan of square cells: a sparse voxelisation.

After the height field of Recast (Mononen 2009): every face is spread over the columns that it overlaps, and in each it
takes the heights that its plane has there, cut to its own. Both are conservative: a face may take a little more than
its own, never less, so that nothing leaks; what lies closer to a face than a cell can count as solid.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.devices import initialised_warp
from bake.types import BoolArray, Float64Array, Int64Array

FLOOR = 1  # a face on which one stands: facing up, no steeper than STEEPEST
HOLLOW = 2  # a one-sided face that faces up: who sees it from below is inside something

STEEPEST = 50.0
"""Degrees: slopes steeper than this are no floor."""

_HEIGHT_BITS = 18
_FLAG_BITS = 2


@dataclass(frozen=True, slots=True)
class Plan:
    """A grid of square columns.

    Attributes:
        low: Corner (u, v) of the first column, metres.
        cell: Edge of a column, metres.
        shape: Number of columns along u and v; column i·shape[1] + j lies at (i, j).
        bottom: Lowest height, metres.
        step: Metres in one unit of height.
    """

    low: Float64Array
    cell: float
    shape: tuple[int, int]
    bottom: float
    step: float

    @property
    def count(self) -> int:
        """Number of columns."""
        return self.shape[0] * self.shape[1]

    def centre(self, column: NDArray[np.integer]) -> Float64Array:
        """Middles (u, v) of columns, shape (n, 2), metres."""
        place = np.stack([column // self.shape[1], column % self.shape[1]], axis=1)
        return self.low + (place + 0.5) * self.cell


@dataclass(frozen=True, slots=True)
class Solids:
    """What is solid in each column, sorted by column and height; the intervals of a column do not touch.

    Attributes:
        column: Shape (n,), int64.
        low, high: Shape (n,), int64, units of height above the plan's bottom.
        floor: Shape (n,), bool: its top can be stood on.
        hollow: Shape (n,), bool: its underside is the back of a one-sided face.
    """

    column: Int64Array
    low: Int64Array
    high: Int64Array
    floor: BoolArray
    hollow: BoolArray


def make_plan(low: Float64Array, high: Float64Array, cell: float) -> Plan:
    """Columns over the box from `low` to `high`, shape (3,) as (u, v, height).

    The grid is shifted against the coordinates' origin: walls at round numbers would lie between two columns, and fill
    both.
    """
    first = (np.floor(low[:2] / cell) - 0.317) * cell
    shape = np.maximum(np.ceil((high[:2] - first) / cell), 1).astype(int)
    step = max(0.01, float(high[2] - low[2]) / (2**_HEIGHT_BITS - 2))
    return Plan(first, cell, (int(shape[0]), int(shape[1])), float(low[2]), step)


def make_solids(corners: Float64Array, two_sided: BoolArray, plan: Plan, *, climb: float) -> Solids:
    """Spreads faces over columns, and joins what overlaps.

    Args:
        corners: Shape (m, 3, 3), faces in (u, v, height).
        two_sided: Shape (m,).
        plan: Faces beside it are left out.
        climb: Metres: the top of something is a floor too if there is floor no deeper than this below it; so grass,
            kerbs and thresholds do not interrupt a floor.
    """
    packed = np.sort(_spread(corners, _flags(corners, two_sided), plan)) if len(corners) else np.zeros(0, np.uint64)
    mask = (1 << _HEIGHT_BITS) - 1
    flags = (packed & np.uint64(3)).astype(np.uint8)
    thick = (packed >> np.uint64(_FLAG_BITS)).astype(np.int64) & mask
    low = (packed >> np.uint64(_FLAG_BITS + _HEIGHT_BITS)).astype(np.int64) & mask
    column = (packed >> np.uint64(_FLAG_BITS + 2 * _HEIGHT_BITS)).astype(np.int64)
    if len(packed) == 0:
        empty = np.zeros(0, np.int64)
        return Solids(empty, empty, empty, empty.astype(np.bool_), empty.astype(np.bool_))
    high = low + thick
    # Columns are sorted, so one running maximum over (column, height) serves them all.
    topmost = np.maximum.accumulate((column << (_HEIGHT_BITS + 1)) + high)
    begins = np.append(True, ((column[1:] << (_HEIGHT_BITS + 1)) + low[1:]) > topmost[:-1])
    first = np.flatnonzero(begins)
    top = topmost[np.append(first[1:], len(packed)) - 1] & ((1 << (_HEIGHT_BITS + 1)) - 1)
    group = np.cumsum(begins) - 1
    stands = ((flags & FLOOR) > 0) & (high >= top[group] - int(climb / plan.step))
    return Solids(column[first], low[first], top, np.logical_or.reduceat(stands, first), (flags[first] & HOLLOW) > 0)


def _flags(corners: Float64Array, two_sided: BoolArray) -> NDArray[np.uint64]:
    """What each face is to who stands on it or below it, shape (m,)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    slope = normal[:, 2] / np.where(length > 0.0, length, 1.0)
    rising = np.where(two_sided, np.abs(slope), slope)
    flags = np.where(rising >= np.cos(np.radians(STEEPEST)), FLOOR, 0) | np.where(~two_sided & (slope > 0.0), HOLLOW, 0)
    return flags.astype(np.uint64)


def _spread(corners: Float64Array, flags: NDArray[np.uint64], plan: Plan) -> NDArray[np.uint64]:
    """Column, lower end, thickness and flags of every face in every column that it overlaps, in one number each."""
    warp = initialised_warp()
    from bake.kernels import columns

    grid: Any = columns.Grid()
    grid.low_u, grid.low_v = (float(at) for at in plan.low)
    grid.cell, grid.bottom, grid.step = plan.cell, plan.bottom, plan.step
    grid.count_u, grid.count_v = plan.shape
    grid.most = float(2**_HEIGHT_BITS - 1)
    given = [
        warp.array(np.ascontiguousarray(corners, np.float64), dtype=warp.vec3d, device="cpu"),
        warp.array(flags, dtype=warp.uint64, device="cpu"),
        grid,
    ]
    bits = [_HEIGHT_BITS, _FLAG_BITS]
    count = warp.zeros(len(corners), dtype=warp.int64, device="cpu")
    offset = warp.zeros(len(corners), dtype=warp.int64, device="cpu")
    nothing = warp.zeros(0, dtype=warp.uint64, device="cpu")
    kernel: Any = columns.spread  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    warp.launch(kernel, len(corners), [*given, offset, *bits], [count, nothing], device="cpu")
    ends = np.cumsum(count.numpy())
    offset.numpy()[1:] = ends[:-1]
    packed = warp.empty(int(ends[-1]), dtype=warp.uint64, device="cpu")
    if len(packed):
        warp.launch(kernel, len(corners), [*given, offset, *bits], [count, packed], device="cpu")
    return packed.numpy()
