"""Spreads faces over square columns: which columns a face overlaps, and between which heights it lies there."""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False, "fast_math": False})

D = wp.float64


@wp.struct
class Grid:
    """A plan of columns.

    Attributes:
        low_u, low_v: Corner of the first column.
        cell: Edge of a column.
        count_u, count_v: Number of columns.
        bottom, step: Height 0 in units, and the length of a unit.
        most: Largest height in units.
    """

    low_u: wp.float64
    low_v: wp.float64
    cell: wp.float64
    count_u: wp.int32
    count_v: wp.int32
    bottom: wp.float64
    step: wp.float64
    most: wp.float64


@wp.func
def apart(p: wp.vec2d, q: wp.vec2d, r: wp.vec2d, half: wp.float64):
    """Whether the line across edge pq separates the face pqr from the square of half edge `half` at the origin."""
    across = wp.vec2d(p[1] - q[1], q[0] - p[0])
    reach = half * (wp.abs(across[0]) + wp.abs(across[1]))
    own, other = wp.dot(p, across), wp.dot(r, across)
    return wp.min(own, other) > reach or wp.max(own, other) < -reach


@wp.func
def first_column(at: wp.float64, low: wp.float64, cell: wp.float64, count: wp.int32):
    """The column that holds a coordinate, cut to the plan."""
    return wp.int32(wp.clamp(wp.floor((at - low) / cell), D(0.0), D(count - 1)))


@wp.kernel(enable_backward=False)
def spread(
    corners: wp.array2d(dtype=wp.vec3d),
    flags: wp.array(dtype=wp.uint64),
    grid: Grid,
    offset: wp.array(dtype=wp.int64),
    height_bits: wp.uint64,
    flag_bits: wp.uint64,
    # Out: without `packed` the columns are only counted.
    count: wp.array(dtype=wp.int64),
    packed: wp.array(dtype=wp.uint64),
):
    """One number for each column that a face overlaps: column, lower end, thickness, flags, from high to low bits."""
    face = wp.tid()
    a, b, c = corners[face, 0], corners[face, 1], corners[face, 2]
    low = wp.min(a, wp.min(b, c))
    high = wp.max(a, wp.max(b, c))
    size_u, size_v = grid.cell * D(grid.count_u), grid.cell * D(grid.count_v)
    if high[0] < grid.low_u or high[1] < grid.low_v or low[0] > grid.low_u + size_u or low[1] > grid.low_v + size_v:
        count[face] = wp.int64(0)
        return
    normal = wp.cross(b - a, c - a)
    steep = wp.abs(normal[2]) <= D(1e-6) * (wp.abs(normal[0]) + wp.abs(normal[1]) + wp.abs(normal[2]))
    rise_u, rise_v = D(0.0), D(0.0)
    if not steep:
        rise_u, rise_v = -normal[0] / normal[2], -normal[1] / normal[2]
    half = D(0.5) * grid.cell * D(1.000001)
    slack = half * (wp.abs(rise_u) + wp.abs(rise_v))
    last_i = first_column(high[0], grid.low_u, grid.cell, grid.count_u)
    last_j = first_column(high[1], grid.low_v, grid.cell, grid.count_v)
    found = wp.int64(0)
    for i in range(first_column(low[0], grid.low_u, grid.cell, grid.count_u), last_i + 1):
        for j in range(first_column(low[1], grid.low_v, grid.cell, grid.count_v), last_j + 1):
            u = grid.low_u + (D(i) + D(0.5)) * grid.cell
            v = grid.low_v + (D(j) + D(0.5)) * grid.cell
            p, q, r = wp.vec2d(a[0] - u, a[1] - v), wp.vec2d(b[0] - u, b[1] - v), wp.vec2d(c[0] - u, c[1] - v)
            if not (apart(p, q, r, half) or apart(q, r, p, half) or apart(r, p, q, half)):
                if packed.shape[0] > 0:
                    bottom, top = low[2], high[2]
                    if not steep:
                        middle = a[2] - p[0] * rise_u - p[1] * rise_v
                        bottom = wp.clamp(middle - slack, low[2], high[2])
                        top = wp.clamp(middle + slack, low[2], high[2])
                    first = wp.uint64(wp.clamp(wp.floor((bottom - grid.bottom) / grid.step), D(0.0), grid.most))
                    last = wp.uint64(wp.clamp(wp.ceil((top - grid.bottom) / grid.step), D(0.0), grid.most))
                    column = wp.uint64(wp.int64(i) * wp.int64(grid.count_v) + wp.int64(j))
                    key = (column << (height_bits + height_bits)) | (first << height_bits) | (last - first)
                    packed[offset[face] + found] = (key << flag_bits) | flags[face]
                found += wp.int64(1)
    count[face] = found
