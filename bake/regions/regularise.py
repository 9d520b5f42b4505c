"""Neighbouring models are drawn together where their regions meet (Sloan et al. 2013, section 2.3)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from bake.arrays import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array
from bake.region_types import PARAMETERS, RegionGraph, RegionModels
from bake.regions.colouring import colouring
from bake.regions.evaluate import basis
from bake.regions.fit import RIDGE
from bake.regions.gram import box_gram, box_volumes, group_boxes
from bake.regions.mismatch import boundary_mismatch

_SPHERE = 4.0 * math.pi
_UNKNOWN = 1e-3  # weight of the fit of a region without points
_UNSEEN = 1e-12  # of the largest eigenvalue: less is rounding
_LARGEST_LOBE = 9.0 / _SPHERE  # Σ Y² of the nine functions, the same in every direction: bounds AO by coefficients


class Regularised(NamedTuple):
    """What came of it.

    Attributes:
        models: The same models, drawn together. Their `rmse` is that of the fit: `fit.with_errors` gives the new one.
        energies: Shape (sweeps + 1,), float64: E before and after each sweep, never rising.
        mismatch: Shape (l, k), float32, as `boundary_mismatch` gives it.
    """

    models: RegionModels
    energies: Float64Array
    mismatch: Float32Array


def regularise(
    models: RegionModels,
    graph: RegionGraph,
    *,
    beta: float = 1.0,
    sweeps: int = 50,
    tolerance: float = 1e-4,
    owner: Int32Array | None = None,
) -> Regularised:
    """Minimises, by block coordinate descent over the regions,

        E = Σ_i |M_i - M_orig,i|² + β Σ_i Σ_{j ∈ N(i)} w_ij |M_i(b_ij) - M_j(b_ij)|²

    |M|² is the mean square of AO over the region's box and over all normals, summed over the distances, plus the fit's
    ridge on the derivatives: in half extents of the region, so that it means the same in a closet and in a hall. w_ij
    is the area of their boundary over the area of all of i's boundaries, so that β has no unit and depends on no scale;
    a link counts from both of its ends. Derivatives that no point determined stay zero; a region without any point has
    no fit to keep to, so that its first term counts next to nothing and its model becomes what suits its neighbours.

    A step sets one region to its minimum while its neighbours stand still, so that E never rises; regions that share no
    link are set side by side. E is a strictly convex quadratic: the descent converges to its minimum.

    Args:
        models: As fitted.
        graph: The regions and their links.
        beta: β; 0 gives the models back as they are.
        sweeps: Most passes over all regions.
        tolerance: It ends once no model's AO, about any normal, changed by more at any boundary in a pass.
        owner: Shape (r,): whose model each region uses (see `Regions.owner`); its own without it.
    """
    owner = np.arange(len(graph), dtype=np.int32) if owner is None else owner
    ends = owner[graph.link]
    joined = (ends[:, 0] != ends[:, 1]) & (graph.link_area > 0.0)
    if beta == 0.0 or sweeps == 0 or not joined.any():
        return Regularised(models, np.zeros(1), boundary_mismatch(models, graph))
    descent = _Descent(models, graph, owner, joined, beta)
    energies = [descent.energy()]
    for _ in range(sweeps):
        changed = descent.sweep()
        energies.append(descent.energy())
        if changed <= tolerance:
            break
    regularised = descent.models()
    return Regularised(regularised, np.array(energies), boundary_mismatch(regularised, graph))


def link_weights(area: Float64Array, ends: Int32Array, count: int) -> Float64Array:
    """w_ij + w_ji of links with the given areas, shape (l,): the share of each in all boundaries of its two regions."""
    total = np.bincount(ends.ravel(), np.repeat(area, 2), count)
    return area * (1.0 / total[ends]).sum(axis=1)


class _Descent:
    """The problem in coordinates y in which |M|² is a plain sum of squares, all harmonics and distances side by side.

    With G = L Lᵀ the Gram matrix of a region's basis functions, y = Lᵀ d for parameters d, and a boundary's value is
    (L⁻¹ φ)ᵀ y. A region's minimum is then K (y_orig + β Σ w φ t), K = (1 + β Σ w φ φᵀ)⁻¹, t its neighbours' values.
    """

    def __init__(
        self, models: RegionModels, graph: RegionGraph, owner: Int32Array, joined: BoolArray, beta: float
    ) -> None:
        self._fitted, self._owner = models, owner
        self._ends: Int32Array = owner[graph.link[joined]]
        self._half = group_boxes(graph.minimum, graph.maximum, owner)[1]
        self._free = np.unpackbits(models.terms[:, None], axis=1, count=PARAMETERS, bitorder="little").astype(np.bool_)
        self._free[:, 0] = True
        unknown = models.terms == 0
        self._free[unknown] = True
        self._root = _whitening(models, graph, owner, self._half, self._free)
        self._root[unknown] *= math.sqrt(_UNKNOWN)
        self._lengths = np.ones((len(graph), PARAMETERS))
        self._lengths[:, 1:] = np.repeat(self._half, 2, axis=1)
        parameters = models.coefficients.reshape(len(graph), PARAMETERS, -1) * self._lengths[:, :, None]
        self._y = np.swapaxes(self._root, 1, 2) @ parameters
        self._start = self._y.copy()
        self._weights = beta * link_weights(graph.link_area[joined], self._ends, len(graph))
        self._phi = np.stack([self._at_boundary(end, graph.link_centre[joined]) for end in self._ends.T], axis=1)
        self._prepare_sweeps(len(graph))
        self._values = self._boundary_values()

    def _at_boundary(self, end: Int32Array, position: Float64Array) -> Float64Array:
        offsets = (position - self._fitted.centre[end]) / self._half[end]
        phi = np.where(self._free[end], basis(offsets), 0.0)
        return np.linalg.solve(self._root[end], phi[:, :, None])[:, :, 0].astype(np.float64)

    def _prepare_sweeps(self, count: int) -> None:
        """What a sweep needs, by colour: regions, their neighbours' values and what each value adds."""
        linked = np.unique(self._ends)
        pull = np.zeros((count, PARAMETERS, PARAMETERS))
        for side in (0, 1):
            phi = self._phi[:, side]
            np.add.at(pull, self._ends[:, side], self._weights[:, None, None] * phi[:, :, None] * phi[:, None, :])
        values, vectors = np.linalg.eigh(pull)
        turned = np.swapaxes(vectors, 1, 2)
        # Directions that no boundary sees must stay free of the rounding errors of those that a large β pins.
        seen: BoolArray = values > _UNSEEN * values[:, -1:]
        shrink = 1.0 / (1.0 + np.where(seen, values, 0.0))
        resting = vectors @ (shrink[:, :, None] * (turned @ self._start))
        colour = colouring(count, self._ends)
        one_end, other_end = self._ends.T.ravel(), self._ends[:, ::-1].T.ravel()
        own_phi = np.concatenate([self._phi[:, 0], self._phi[:, 1]])
        other_phi = np.concatenate([self._phi[:, 1], self._phi[:, 0]])
        own_turned = (turned[one_end] @ own_phi[:, :, None])[:, :, 0]
        own_turned = np.where(seen[one_end], own_turned * shrink[one_end], 0.0)
        added = np.tile(self._weights, 2)[:, None] * (vectors[one_end] @ own_turned[:, :, None])[:, :, 0]
        self._read = _rows(np.concatenate([self._ends[:, 0], self._ends[:, 1]]), own_phi, count)
        self._colours: list[tuple[Int64Array, Float64Array, csr_array, csr_array]] = []
        position = np.zeros(count, np.int64)
        for number in range(int(colour[linked].max()) + 1):
            regions = linked[colour[linked] == number].astype(np.int64)
            position[regions] = np.arange(len(regions))
            here = np.flatnonzero(colour[one_end] == number)
            read = _rows(other_end[here], other_phi[here], count)
            add = _rows(position[one_end[here]], added[here], len(regions)).T.tocsr()
            self._colours.append((regions, resting[regions], read, add))

    def sweep(self) -> float:
        """Sets every region once; returns the most that AO changed at a boundary, about whatever normal."""
        channels = self._y.shape[2]
        for regions, resting, read, add in self._colours:
            moved = add @ (read @ self._y.reshape(-1, channels))
            self._y[regions] = resting + moved.reshape(resting.shape)
        before, self._values = self._values, self._boundary_values()
        change = (self._values - before).reshape(len(before), 9, -1)
        return math.sqrt(_LARGEST_LOBE * float((change**2).sum(axis=1).max(initial=0.0)))

    def energy(self) -> float:
        """E, in squared AO."""
        first, second = np.split(self._values, 2)
        moved = ((self._y - self._start) ** 2).sum()
        return float(moved + (self._weights[:, None] * (first - second) ** 2).sum()) / _SPHERE

    def models(self) -> RegionModels:
        """The models as they stand."""
        fitted = self._fitted
        parameters = np.linalg.solve(np.swapaxes(self._root, 1, 2), self._y) / self._lengths[:, :, None]
        parameters = np.where(self._free[:, :, None], parameters, 0.0)
        coefficients = fitted.coefficients.copy()
        linked = np.unique(self._ends)
        coefficients[linked] = parameters.reshape(fitted.coefficients.shape)[linked]
        return RegionModels(fitted.centre, coefficients[self._owner], fitted.terms, fitted.centre_kind, fitted.rmse)

    def _boundary_values(self) -> Float64Array:
        """Harmonics at every link as its first and then as its second region has them, shape (2 l, 9 k)."""
        return self._read @ self._y.reshape(-1, self._y.shape[2])


def _whitening(
    models: RegionModels, graph: RegionGraph, owner: Int32Array, half: Float64Array, free: BoolArray
) -> Float64Array:
    """L of each region's Gram matrix, shape (r, 7, 7): the mean over the boxes that share the model, by volume."""
    volume = box_volumes(graph.minimum, graph.maximum)
    share = volume / np.bincount(owner, volume, len(graph))[owner]
    each = box_gram(graph.minimum, graph.maximum, models.centre[owner], half[owner])
    gram = np.zeros_like(each)
    np.add.at(gram, owner, share[:, None, None] * each)
    gram = np.where(free[:, :, None] & free[:, None, :], gram, 0.0)
    ridge = np.where(free, RIDGE, 1.0)
    ridge[:, 0] = np.where(np.bincount(owner, minlength=len(graph)) > 0, 0.0, 1.0)
    return np.linalg.cholesky(gram + np.eye(PARAMETERS) * ridge[:, :, None]).astype(np.float64)


def _rows(region: np.ndarray, values: Float64Array, count: int) -> csr_array:
    """One row an entry: its seven values in the columns of its region, shape (n, 7 · count)."""
    columns = region[:, None].astype(np.int64) * PARAMETERS + np.arange(PARAMETERS)
    starts = np.arange(len(region) + 1) * PARAMETERS
    return csr_array((values.ravel(), columns.ravel(), starts), shape=(len(region), count * PARAMETERS))
