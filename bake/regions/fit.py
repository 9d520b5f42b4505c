"""A region's model: linear least squares for a fixed centre, and the choice of the centre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.arrays import BoolArray, Float64Array, Int32Array, UInt8Array
from bake.region_types import GRID, PARAMETERS, CentreKind, RegionGraph, RegionModels, RegionPoints
from bake.regions.centre_search import search_centres
from bake.regions.empty import fill_empty
from bake.regions.gram import box_volumes, group_boxes
from bake.regions.moments import Moments, squared_error, sum_points
from bake.settings import BakeSettings

RIDGE = 1e-4
"""Added to the mean square of each column but the constant's, in half extents of the region."""

UNSEEN = 0.01
"""How much a grid point without data counts as one that sees the mean, beside the points with data together."""

UNDETERMINED = 1e-8
"""A column whose variance over the points is below this, in half extents squared, says nothing of its derivative."""


@dataclass(frozen=True, slots=True)
class Fit:
    """Models about given centres, one a region; rows of absorbed regions and of those without points are zero.

    Attributes:
        coefficients: Shape (r, 7, 9, k), float64: derivatives times `half`.
        determined: Shape (r, 7): columns that the points determine.
        error: Shape (r, k): mean squared error of AO at the points.
    """

    coefficients: Float64Array
    determined: BoolArray
    error: Float64Array


class GroupedPoints:
    """The points of each region together with those of the regions that it absorbed.

    A point counts for the space it stands for, so that a closet does not outweigh the hall that absorbed it.

    Attributes:
        middle, half: Shape (r, 3): centre and half extents of the box around each group, at its owner's row.
        count: Shape (r,): valid points of the group.
        mass: Shape (r,): the space that they stand for, m³.
    """

    def __init__(self, moments: Moments, minimum: Float64Array, maximum: Float64Array, owner: Int32Array) -> None:
        self._moments, self._owner = moments, owner
        volume = box_volumes(minimum, maximum)
        self._volume_share = volume / self._together(volume)[owner]
        mass = volume * moments.count / GRID**3
        self.mass = self._together(mass)
        self._share = mass / np.maximum(self.mass, 1e-300)[owner]
        self.count = self._together(moments.count)
        self.middle, self.half = group_boxes(minimum, maximum, owner)

    def centre_of_mass(self) -> Float64Array:
        """Shape (r, 3); the middle of the box for groups without points."""
        offset = self._moments.centre_of_mass() - self.middle[self._owner]
        return self.middle + self._together(self._share[:, None] * offset)

    def fit(self, centre: Float64Array) -> Fit:
        """Least squares about centres, shape (r, 3); one factorisation serves all harmonics and distances.

        Minimises the mean of |v - M(p)|² over the valid points, plus RIDGE · Σ |derivative|² with offsets in half
        extents, plus UNSEEN · Σ |v_mean - M(q)|² / GRID³ over the points q of the grid that are not valid, v_mean the
        mean of the valid ones. The latter keeps a slope that a few points in a corner suggest from running wild across
        the box, and vanishes where all points are valid. Columns without points on their side, or with all of them at
        one coordinate, are left out: their derivative is zero.
        """
        design, cross = self._moments.normal_equations(centre[self._owner], self.half[self._owner])
        design = self._together(self._share[:, None, None] * design)
        cross = self._together(self._share[:, None, None, None] * cross)
        square = self._moments.square / np.maximum(self._moments.count, 1.0)[:, None]
        square = self._together(self._share[:, None] * square)
        unseen = UNSEEN * self._moments.unseen(centre[self._owner], self.half[self._owner])
        coefficients, determined = solve(design, cross, self._together(self._volume_share[:, None, None] * unseen))
        return Fit(coefficients, determined, squared_error(design, cross, square, coefficients))

    def gram(self, centre: Float64Array, half: Float64Array) -> Float64Array:
        """What a fit weighs its columns by: means of their products over the valid points, and the little that others
        count, shape (r, 7, 7); offsets from centres, shape (r, 3), in units of `half`, shape (r, 3)."""
        centre, half = centre[self._owner], half[self._owner]
        design = self._together(self._share[:, None, None] * self._moments.normal_equations(centre, half)[0])
        unseen = self._volume_share[:, None, None] * self._moments.unseen(centre, half)
        return design + UNSEEN * self._together(unseen)

    def _together(self, values: Float64Array) -> Float64Array:
        """Sums over each group, at its owner's row."""
        sums = np.zeros_like(values)
        np.add.at(sums, self._owner, values)
        return sums


def solve(design: Float64Array, cross: Float64Array, unseen: Float64Array) -> tuple[Float64Array, BoolArray]:
    """Solves normal equations; see `GroupedPoints.fit`.

    Args:
        design, cross: Shapes (r, 7, 7) and (r, 7, 9, k): of the valid points.
        unseen: Shape (r, 7, 7): of the others, that want the mean.

    Returns:
        Coefficients, shape (r, 7, 9, k), and which columns took part, shape (r, 7).
    """
    mean = design[:, 0]
    variance = np.diagonal(design, axis1=1, axis2=2) - mean**2
    determined: BoolArray = variance > UNDETERMINED
    determined[:, 0] = mean[:, 0] > 0.0
    both = determined[:, :, None] & determined[:, None, :]
    ridge = np.where(determined, RIDGE, 1.0)
    ridge[:, 0] = np.where(determined[:, 0], 0.0, 1.0)
    system = np.where(both, design + unseen, 0.0) + np.eye(PARAMETERS) * ridge[:, :, None]
    wanted = cross + unseen[:, :, :1, None] * cross[:, :1]
    right = np.where(determined[:, :, None, None], wanted, 0.0)
    solution: Float64Array = np.linalg.solve(system, right.reshape(len(right), PARAMETERS, -1)).astype(np.float64)
    return solution.reshape(right.shape), determined


def fit_regions(
    points: RegionPoints,
    graph: RegionGraph,
    settings: BakeSettings,
    *,
    owner: Int32Array | None = None,
    moments: Moments | None = None,
) -> RegionModels:
    """Fits a model to the valid points of each region (Sloan et al. 2013, section 2.3 and equation 4).

    Two centres are tried, the middle of the box and the centre of mass of the valid points, and the better is kept;
    the setting `optimise_centre` searches on from there. A region without valid points takes the mean of what its
    neighbours' models say at their common boundaries, or counts as open.

    Args:
        points: Traced, their harmonics convolved.
        graph: The regions.
        settings: Those of the bake.
        owner: Shape (r,): whose model each region uses (see `Regions.owner`); its own without it.
        moments: What `sum_points` gives for the same points, if it is at hand.

    Returns:
        One model a region; that of its owner where it was absorbed.
    """
    owner = np.arange(len(graph), dtype=np.int32) if owner is None else owner
    moments = sum_points(points, graph) if moments is None else moments
    groups = GroupedPoints(moments, graph.minimum, graph.maximum, owner)
    centre, kind, fit = _better_centres(groups)
    if settings.optimise_centre:
        found, improved = search_centres(
            lambda tried: groups.fit(tried).error.sum(axis=1), centre, groups.middle, groups.half
        )
        centre, kind = found, np.where(improved, CentreKind.OPTIMISED, kind).astype(np.uint8)
        fit = groups.fit(centre)
    slopes = np.ones((len(graph), PARAMETERS))
    slopes[:, 1:] = 1.0 / np.repeat(groups.half, 2, axis=1)
    fitted = RegionModels(
        centre=centre[owner],
        coefficients=(fit.coefficients * slopes[:, :, None, None]).astype(np.float32)[owner],
        terms=np.packbits(fit.determined, axis=1, bitorder="little")[:, 0][owner],
        centre_kind=kind[owner],
        rmse=np.zeros((len(graph), points.sh.shape[2]), np.float32),
    )
    return with_errors(fill_empty(fitted, graph, owner, groups.count[owner] > 0), moments)


def with_errors(models: RegionModels, moments: Moments) -> RegionModels:
    """The same models with their errors at each region's own points; NaN where it has none."""
    one = np.ones_like(models.centre)
    design, cross = moments.normal_equations(models.centre, one)
    square = moments.square / np.maximum(moments.count, 1.0)[:, None]
    error = squared_error(design, cross, square, models.coefficients.astype(np.float64))
    rmse = np.where(moments.count[:, None] > 0, np.sqrt(error), np.nan).astype(np.float32)
    return RegionModels(models.centre, models.coefficients, models.terms, models.centre_kind, rmse)


def _better_centres(groups: GroupedPoints) -> tuple[Float64Array, UInt8Array, Fit]:
    """The middle of the box, or the centre of mass where that fits better."""
    mass = groups.centre_of_mass()
    at_middle, at_mass = groups.fit(groups.middle), groups.fit(mass)
    better: BoolArray = at_mass.error.sum(axis=1) < at_middle.error.sum(axis=1) * (1.0 - 1e-9)
    return (
        np.where(better[:, None], mass, groups.middle),
        np.where(better, CentreKind.MASS, CentreKind.BOX).astype(np.uint8),
        Fit(
            np.where(better[:, None, None, None], at_mass.coefficients, at_middle.coefficients),
            np.where(better[:, None], at_mass.determined, at_middle.determined),
            np.where(better[:, None], at_mass.error, at_middle.error),
        ),
    )
