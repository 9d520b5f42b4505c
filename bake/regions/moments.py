"""Sums over the valid points of each region, from which every fit and every error follows without the points.

A coordinate takes only GRID values in a region, so each column of a fit is a combination of 25 indicators: one, and
whether the point lies on plane l of axis x, y or z. Their products, summed once, give the normal equations about any
centre, and those of several regions together, in a few hundred operations.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from bake import spherical_harmonics
from bake.arrays import Float64Array, Int64Array
from bake.region_types import GRID, PARAMETERS, PointState, RegionGraph, RegionPoints
from bake.regions.evaluate import AXIS_NORMALS
from bake.regions.grid import grid_levels

_INDICATORS = 1 + 3 * GRID
_REGIONS_A_PART = 64
_AXES = ((2, 3), (1, 3), (1, 2))  # what is summed over for x, y and z


@dataclass(frozen=True, slots=True)
class Moments:
    """Of r regions and k distances.

    Attributes:
        levels: Shape (r, 3, GRID): coordinates of the grid's planes.
        count: Shape (r,): valid points; the sums below run over them.
        design: Shape (r, 25, 25): Σ z zᵀ over the indicators z.
        cross: Shape (r, 25, 9, k): Σ z v over the harmonics v.
        square: Shape (r, k): Σ of squared AO, a mean over the six axis normals.
    """

    levels: Float64Array
    count: Float64Array
    design: Float64Array
    cross: Float64Array
    square: Float64Array

    def of(self, regions: Int64Array) -> Moments:
        """Those of some regions, in the order of their numbers, shape (s,)."""
        return Moments(*(getattr(self, item.name)[regions] for item in dataclasses.fields(self)))

    def normal_equations(self, centre: Float64Array, half: Float64Array) -> tuple[Float64Array, Float64Array]:
        """Means of the products of the columns with each other and with the harmonics.

        Args:
            centre: Shape (r, 3): where each region's model bends.
            half: Shape (r, 3), positive: lengths that offsets are divided by.

        Returns:
            Shapes (r, 7, 7) and (r, 7, 9, k); zero for regions without points.
        """
        columns = self._columns(centre, half)
        total = np.maximum(self.count, 1.0)
        design = columns @ self.design @ np.swapaxes(columns, 1, 2) / total[:, None, None]
        cross = columns @ self.cross.reshape(len(self.cross), _INDICATORS, -1) / total[:, None, None]
        return design, cross.reshape(len(cross), PARAMETERS, *self.cross.shape[2:])

    def unseen(self, centre: Float64Array, half: Float64Array) -> Float64Array:
        """Sums of the products of the columns over the grid points that are not valid, over GRID³, shape (r, 7, 7)."""
        columns = self._columns(centre, half)
        return columns @ (_whole_grid() - self.design) @ np.swapaxes(columns, 1, 2) / GRID**3

    def centre_of_mass(self) -> Float64Array:
        """Mean position of the valid points, shape (r, 3); the middle of the grid without any."""
        levels = np.diagonal(self.design, axis1=1, axis2=2)[:, 1:].reshape(-1, 3, GRID)
        middle = self.levels.mean(axis=2)
        offsets = (levels * (self.levels - middle[:, :, None])).sum(axis=2)
        return middle + offsets / np.maximum(self.count, 1.0)[:, None]

    def _columns(self, centre: Float64Array, half: Float64Array) -> Float64Array:
        """Each column of the fit as a combination of the indicators, shape (r, 7, 25)."""
        offsets = (self.levels - centre[:, :, None]) / half[:, :, None]
        columns = np.zeros((len(offsets), PARAMETERS, _INDICATORS))
        columns[:, 0, 0] = 1.0
        for axis in range(3):
            here = slice(1 + axis * GRID, 1 + (axis + 1) * GRID)
            columns[:, 1 + 2 * axis, here] = np.maximum(offsets[:, axis], 0.0)
            columns[:, 2 + 2 * axis, here] = np.minimum(offsets[:, axis], 0.0)
        return columns


def _whole_grid() -> Float64Array:
    """`Moments.design` of a region whose points are all valid."""
    design = np.zeros((1, _INDICATORS, _INDICATORS))
    _sum_design(np.ones((1, GRID, GRID, GRID)), design)
    return design[0]


def squared_error(
    design: Float64Array, cross: Float64Array, square: Float64Array, coefficients: Float64Array
) -> Float64Array:
    """Mean squared error of AO over the points and the six axis normals.

    Args:
        design, cross: As `Moments.normal_equations` gives them, perhaps summed over regions.
        square: Shape (r, k): means of squared AO.
        coefficients: Shape (r, 7, 9, k): the model, its derivatives times the same half extents.

    Returns:
        Shape (r, k), at least 0.
    """
    at_normals = np.moveaxis(_at_axis_normals(coefficients), 1, 3)  # (r, 6, k, 7)
    predicted = np.moveaxis(_at_axis_normals(cross), 1, 3)
    quadratic = np.einsum("rnki,rij,rnkj->rk", at_normals, design, at_normals, optimize=True)
    mixed = (at_normals * predicted).sum(axis=(1, 3))
    return np.maximum(square + (quadratic - 2.0 * mixed) / len(AXIS_NORMALS), 0.0)


def sum_points(points: RegionPoints, graph: RegionGraph) -> Moments:
    """Sums over the valid points of all regions."""
    regions, k = len(graph), points.sh.shape[2]
    design = np.zeros((regions, _INDICATORS, _INDICATORS))
    cross = np.zeros((regions, _INDICATORS, 9, k))
    square = np.zeros((regions, k))
    state = points.state.reshape(regions, GRID, GRID, GRID)
    firsts = np.searchsorted(points.traced, np.arange(regions + 1) * GRID**3)
    for begin in range(0, regions, _REGIONS_A_PART):
        part = slice(begin, min(begin + _REGIONS_A_PART, regions))
        valid = (state[part] == PointState.VALID).astype(np.float64)
        rows = slice(firsts[part.start], firsts[part.stop])
        values = np.zeros((valid.size, 9, k))
        values[points.traced[rows] - begin * GRID**3] = points.sh[rows]
        values *= valid.reshape(-1, 1, 1)
        at_normals = _at_axis_normals(values[:, None])[:, 0]
        square[part] = (at_normals**2).mean(axis=1).reshape(len(valid), -1, k).sum(axis=1)
        _sum_design(valid, design[part])
        grid = values.reshape(*valid.shape, 9, k)
        cross[part, 0] = grid.sum(axis=(1, 2, 3))
        for axis, others in enumerate(_AXES):
            cross[part, 1 + axis * GRID : 1 + (axis + 1) * GRID] = grid.sum(axis=others)
    return Moments(grid_levels(graph.minimum, graph.maximum), design[:, 0, 0].copy(), design, cross, square)


def _sum_design(valid: Float64Array, design: Float64Array) -> None:
    """Counts points, those on each plane, and those on each pair of planes of different axes."""
    x, y, z = (slice(1 + axis * GRID, 1 + (axis + 1) * GRID) for axis in range(3))
    design[:, 0, 0] = valid.sum(axis=(1, 2, 3))
    diagonal = np.arange(GRID)
    for block, others in zip((x, y, z), _AXES, strict=True):
        on_plane = valid.sum(axis=others)
        design[:, 0, block] = design[:, block, 0] = on_plane
        design[:, block, block][:, diagonal, diagonal] = on_plane
    for first, second, other in ((x, y, 3), (x, z, 2), (y, z, 1)):
        pairs = valid.sum(axis=other)
        design[:, first, second] = pairs
        design[:, second, first] = np.swapaxes(pairs, 1, 2)


def _at_axis_normals(harmonics: Float64Array) -> Float64Array:
    """AO at the six axis normals, shape (r, p, 9, k) → (r, p, 6, k)."""
    return np.einsum("nc,rpck->rpnk", spherical_harmonics.evaluate(AXIS_NORMALS), harmonics, optimize=True)
